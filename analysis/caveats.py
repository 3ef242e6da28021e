"""Collect the caveats on the results from a dump, in sentences."""

import numpy as np

from chaincor.analysis.collision_frames import CollisionFrames
from chaincor.analysis.dumps.chain_frames import DISPLACEMENT_COLUMN, SCALED_COLUMNS
from chaincor.analysis.dumps.contact_detection import DetectedContacts
from chaincor.analysis.followed import Followed
from chaincor.analysis.modes import indistinct_modes
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential

# Velocities that are printed more coarsely than this, relative to the impact speed, have lost
# digits of their 16-digit float64 values.
_ALL_DIGITS = 1e-14
_LARGE_DRIFT = 1e-6
_LARGE_MISS = 1e-6
_UNUSUAL_BOND = 1e-3


def collect_caveats(
    seen: Followed, *, drifts: tuple[float, float] | None, truncated: bool
) -> list[str]:
    """
    Return the caveats on the results; the list is empty for a dump without faults.

    `drifts` are two relative changes of the energy since the first frame: up to the first frame
    after the last contact, and up to the last frame. `drifts` is None if the bond is unknown.
    `truncated` says whether the last frame is incomplete.
    """
    reading, layout, bond = seen.reading, seen.reading.layout, seen.reading.known.bond
    caveats = []
    if truncated:
        caveats.append(
            "the last frame of the dump is incomplete and was left out; the last complete frame "
            f"is at step {seen.last.step}"
        )
    if not layout.targets and np.any(np.diff(layout.rows[0]) != 1):
        caveats.append(
            "ids do not count particles from the wall outwards; particles were numbered by their "
            "positions in the first frame"
        )
    caveats += _precision_caveats(reading)
    if reading.start == "late":
        caveats.append(
            "the first frame lies inside the collision: earlier contacts are missing, and times "
            "are counted from the first contact in the dump"
        )
    caveats += _ending_caveats(seen)
    caveats += _contact_caveats(seen.detection, bond)
    if bond is None:
        caveats.append(
            "the bond is unknown, so there is no energy balance, and mode energies assume "
            "stiffness 1; give the bond (--potential)"
        )
    if drifts is not None:
        caveats += _drift_caveats(drifts[0], drifts[1] - drifts[0])
    return caveats


def _precision_caveats(reading: CollisionFrames) -> list[str]:
    first, digits, caveats = reading.first, reading.digits, []
    resolution = float(np.max(reading.last.resolution("vx", digits))) / reading.velocity
    if resolution > _ALL_DIGITS:
        caveats.append(
            f"velocities are printed to {resolution:.0e} of the impact speed; "
            "'dump_modify ID format float %.17g' keeps all digits"
        )
    column = reading.layout.displacement_column
    if column != DISPLACEMENT_COLUMN:
        resolution = float(np.max(first.resolution(column, digits)))
        if column in SCALED_COLUMNS:
            resolution *= float(first.bounds[0, 1] - first.bounds[0, 0])
        caveats.append(
            f"displacements are taken from column {column}, good to {resolution:.0e} of a bond "
            "length; a column of displacements keeps all digits"
        )
        strains = np.diff(reading.first_state.displacements)
        if strains.size and abs(np.median(strains)) > _UNUSUAL_BOND + 2.0 * resolution:
            caveats.append(
                f"bonds are {1.0 + np.median(strains):.6g} long in the first frame, not 1; all "
                "lengths are taken to be in units of the natural bond length"
            )
    return caveats


def mode_caveats(frequencies: Array) -> list[str]:
    """Return caveats on modes that cannot be distinguished."""
    groups = indistinct_modes(frequencies)
    if not groups:
        return []
    named = ", ".join(f"{first} to {last}" for first, last in groups[:3])
    more = f" and {len(groups) - 3} groups more" if len(groups) > 3 else ""
    return [
        f"the frequencies of modes {named}{more} agree to rounding, so only the sum of their "
        "energies is known; each of these modes gets an equal share"
    ]


def _drift_caveats(before: float, after: float) -> list[str]:
    caveats = []
    if abs(before) > _LARGE_DRIFT:
        caveats.append(
            f"the energy changes by a fraction of {before:.1e} between the first frame and the "
            "last contact, so the run is no more accurate than this"
        )
    # Scripts that dump at contacts use a larger time step after the last contact. The last frame
    # was computed with this larger step.
    if abs(after) > max(_LARGE_DRIFT, abs(before)):
        caveats.append(
            f"the energy changes by a fraction of {after:.1e} after the last contact; restitution "
            "is unaffected, but vibration and modes are no more accurate than this"
        )
    return caveats


def _ending_caveats(seen: Followed) -> list[str]:
    since = f"the dump ends {seen.since_contact:.3g} after the last contact"
    two = len(seen.reading.masses) > 1
    if not seen.parting:
        other = "target" if two else "wall"
        return [
            f"the chain still moves towards the {other} in the last frame: the collision is not "
            "over, and the final restitution will differ"
        ]
    if seen.argument == "proved" or seen.alone:
        return []
    if seen.argument == "argued":
        return [
            "energy alone does not rule out a contact after the last frame; such a contact would "
            "need an unlikely concentration of energy in one bond"
        ]
    if seen.since_contact <= seen.sound_returns:
        longer = "the longer body" if two else "the chain"
        return [
            f"{since}; sound needs {seen.sound_returns:.3g} to cross {longer} and come back, so "
            "a later contact cannot be ruled out"
        ]
    return [f"{since}; nothing else shows that no later contact follows"]


def _contact_caveats(detection: DetectedContacts, bond: Potential | None) -> list[str]:
    if detection.method == "none":
        return ["contacts of soft bodies last for some time, so no contact times are given"]
    if detection.unresolved:
        advice = (
            "write frames closer together"
            if bond is not None
            else "give the potential (--potential), or write frames closer together"
        )
        return [
            f"frames are up to {detection.largest_gap:.3g} apart, and between "
            f"{detection.unresolved} pairs of them the number of contacts is unknown: "
            f"contacts is at least {detection.times.size}; {advice}"
        ]
    if detection.method == "interpolation" and detection.largest_gap > 0.0:
        return [
            f"contact times are interpolated between frames up to {detection.largest_gap:.3g} "
            "apart; the potential (--potential) would locate them"
        ]
    if detection.worst_miss > _LARGE_MISS:
        return [
            "contact times and speeds are uncertain: the momentum integrated from frame to frame "
            f"differs from the momentum in the dump by up to {detection.worst_miss:.1e} v0"
        ]
    return []
