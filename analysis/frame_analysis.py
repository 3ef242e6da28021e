"""
Analyse a collision from the frames of a dump, in one pass and constant memory.

The caller is `job_analysis.py`, which finds the files of the job.
"""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from chaincor.analysis.caveats import collect_caveats, mode_caveats
from chaincor.analysis.collision_frames import NOTHING_KNOWN, CollisionFrames, Known
from chaincor.analysis.contacts import contact_statistics
from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.frame import DumpFrames
from chaincor.analysis.followed import Followed, follow_frames, restitution_precision
from chaincor.analysis.modes import anharmonic_remainder, mode_energies, mode_frequencies
from chaincor.analysis.restitution import (
    EnergySplit,
    centre_of_mass_velocity,
    energy_split,
    momentum_residual,
)
from chaincor.analysis.results import BodyAnalysis, CollisionAnalysis
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import stiffness_of

# If the total energy exceeds the translational energy by at most this fraction, the excess is due
# to rounding, and the chain does not vibrate.
_ROUNDINGS = 1e-12


def analyze_frames(
    frames: DumpFrames,
    known: Known = NOTHING_KNOWN,
    notes: Iterable[str] = (),
    progress: Callable[[int], None] | None = None,
) -> CollisionAnalysis:
    """
    Analyse a collision frame by frame.

    `notes` are caveats that are already known. `progress` receives the number of bytes read so far.
    Raises InputError if the frames do not show a collision of a chain, if they contradict known
    data, or if masses differ and are unknown.
    """
    reading = CollisionFrames(frames.frames(progress), known)
    masses, velocity, first_state = reading.masses, reading.velocity, reading.first_state
    seen = follow_frames(reading)
    detection = seen.detection
    origin = first_state.time if known.soft else float(detection.times[0])
    times = detection.times - origin
    statistics = contact_statistics(times, detection.speeds, masses[0].size, velocity)
    energies = _energies(seen)
    totals = [sum(float(part.total) for part in split) for split in energies]
    drifts = remainder = None
    if known.bond is not None:
        start, parted, end = totals
        drifts = (parted - start) / start, (end - start) / start
        remainder = float(anharmonic_remainder(seen.last.displacements, known.bond))
    e = seen.last.separation(masses) / velocity
    caveats = collect_caveats(seen, drifts=drifts, truncated=frames.truncated)
    chain, *target = _each_body(seen, energies, origin)
    for body in (chain, *target):
        caveats += mode_caveats(body.mode_frequencies)
    uncounted = detection.unresolved or reading.start == "late" or known.soft
    return CollisionAnalysis(
        **vars(chain),
        particles=masses[0].size,
        bond=known.bond,
        velocity=velocity,
        restitution=e**2,
        restitution_bound=_largest_restitution(totals[0] if totals else None, reading),
        kinematic_restitution=e,
        restitution_error=None,
        data_error=restitution_precision(seen, e),
        contact_times=times,
        contact_speeds=detection.speeds,
        contact_statistics=statistics,
        contacts=None if uncounted else statistics.count,
        detection=detection,
        anharmonic_remainder=remainder,
        energy_drift=None if drifts is None else drifts[1],
        momentum_residual=_momentum_residual(seen),
        bond_min=min(record.bond_min for record in seen.records),
        bond_max=max(record.bond_max for record in seen.records),
        frames=seen.records[0].count,
        timestep=None if reading.layout.time_known else known.timestep,
        time_start=float(first_state.time - origin),
        time_end=float(seen.last.time - origin),
        ending=seen.argument,
        finished=seen.finished,
        notes=(*notes, *caveats),
        soft=known.soft,
        target=target[0] if target else None,
    )


def _energies(seen: Followed) -> list[list[EnergySplit]]:
    """
    Return the energies of the bodies in three frames; empty if the bond is unknown.

    The frames are the first, the first after the last contact, and the last.
    """
    bond = seen.reading.known.bond
    if bond is None:
        return []
    return [
        [
            energy_split(body.displacements, body.velocities, bond, m)
            for body, m in zip(state.bodies, seen.reading.masses, strict=True)
        ]
        for state in (seen.reading.first_state, seen.parted, seen.last)
    ]


def _each_body(
    seen: Followed, energies: Sequence[Sequence[EnergySplit]], origin: float
) -> list[BodyAnalysis]:
    """Return the results for each body; the velocity of a target is along x."""
    reading, found = seen.reading, []
    k = stiffness_of(reading.known.bond)
    states = zip(reading.masses, reading.first_state.bodies, seen.last.bodies, strict=True)
    for i, (m, first, last) in enumerate(states):
        velocity = float(centre_of_mass_velocity(last.velocities, m))
        body = BodyAnalysis(
            masses=m,
            velocity_after=-velocity if i else velocity,
            history=seen.records[i].history(origin),
            energy_start=energies[0][i] if energies else None,
            energy_end=energies[2][i] if energies else None,
            mode_frequencies=mode_frequencies(m.size, k, m),
            mode_energies=mode_energies(last.displacements, last.velocities, k, m),
            mode_energies_start=mode_energies(first.displacements, first.velocities, k, m),
        )
        found.append(body)
    return found


def _momentum_residual(seen: Followed) -> float:
    """Return the momentum that contacts do not explain, or the change of two bodies' momentum."""
    reading = seen.reading
    masses, v0 = reading.masses, reading.velocity
    if len(masses) == 1:
        if seen.detection.method == "none":
            return 0.0  # the impulse of a soft wall is unknown
        return abs(momentum_residual(seen.last.velocities, v0, seen.detection.speeds, masses[0]))
    both = [_momentum(each, masses) for each in (reading.first_state, seen.last)]
    return abs(both[1] - both[0]) / (float(np.sum(masses[0])) * v0)


def _momentum(state: ChainState, masses: Sequence[Array]) -> float:
    """Return the total momentum of both bodies; that of a mirrored target changes sign."""
    return sum(
        sign * float(m @ body.velocities)
        for sign, m, body in zip((1.0, -1.0), masses, state.bodies, strict=True)
    )


def _largest_restitution(energy: float | None, reading: CollisionFrames) -> float | None:
    """Return the largest eta that the energy in the first frame allows; None if unknown."""
    if energy is None:
        return None if reading.start in ("moving", "turned") else 1.0
    masses = [float(np.sum(m)) for m in reading.masses]
    reduced = 1.0 / sum(1.0 / mass for mass in masses)
    if len(masses) > 1:
        # The energy of the common motion of both bodies is conserved.
        energy -= 0.5 * _momentum(reading.first_state, reading.masses) ** 2 / sum(masses)
    bound = energy / (0.5 * reduced * reading.velocity**2)
    return bound if bound > 1.0 + _ROUNDINGS else 1.0
