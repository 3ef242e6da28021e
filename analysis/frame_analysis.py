"""From the frames of a dump to the physics of the collision, in one pass and constant memory."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from chaincor.analysis.caveats import (
    Ending,
    collect_caveats,
    find_contradictions,
    mode_caveats,
)
from chaincor.analysis.contacts import contact_statistics
from chaincor.analysis.data_error import restitution_precision
from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.collision_frames import CollisionFrames
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.masses import masses_of_bodies
from chaincor.analysis.followed import Followed, follow
from chaincor.analysis.known import CHAIN_AND_WALL, NOTHING_KNOWN, Known
from chaincor.analysis.modes import anharmonic_remainder, are_equal, mode_energies, mode_frequencies
from chaincor.analysis.restitution import (
    EnergySplit,
    bond_strains,
    centre_of_mass_velocity,
    energy_split,
    momentum_residual,
)
from chaincor.analysis.results import BodyAnalysis, CollisionAnalysis
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential

# An energy so little above that of the translation is that.
_ROUNDINGS = 1e-12
Energies = Sequence[EnergySplit | None]


def analyze_frames(
    frames: Iterable[DumpFrame],
    known: Known = NOTHING_KNOWN,
    notes: Iterable[str] = (),
    is_truncated: Callable[[], bool] = lambda: False,
) -> CollisionAnalysis:
    """
    Analyse a collision frame by frame.

    Parameters
    ----------
    frames : iterable of DumpFrame
        Such as a :class:`~chaincor.analysis.dumps.dump.Dump`.
    known : Known
        What is known besides: the bond, the impact speed, masses, what meets.
    notes : iterable of str
        Caveats known beforehand.
    is_truncated : callable
        Says, after the last frame, whether the dump was cut short.

    Returns
    -------
    CollisionAnalysis
        All results.

    Raises
    ------
    InputError
        If the frames do not show a collision of a chain, or contradict what is known, or masses
        differ and are not known.
    """
    bodies = known.bodies
    reading = CollisionFrames(iter(frames), known.timestep, bodies.targets)
    masses = masses_of_bodies(
        reading.first, reading.layout, given=known.masses, declared=known.declared
    )
    velocity = reading.impact_velocity(masses, known.impact_velocity)
    seen = follow(reading, masses, velocity, known)
    detection = seen.detection
    origin = seen.opening.time if bodies.soft else float(detection.times[0])
    times = detection.times - origin
    statistics = contact_statistics(times, detection.speeds, masses[0].size, velocity)
    states = seen.opening, seen.parted, seen.last
    energies = [_energies(state, masses, known.bond) for state in states]
    drifts = None if known.bond is None else _drifts(energies)
    ending = _ending(seen, known)
    e = seen.last.separation(masses) / velocity
    speed_given = known.impact_velocity is not None and not bodies.targets
    error = restitution_precision(reading, seen, e, speed_given)
    bound = _largest_restitution(energies[0], seen, reading.start.moving)
    contradictions = find_contradictions(e**2, error, detection, bound)
    caveats = collect_caveats(reading, ending, drifts=drifts, truncated=is_truncated())
    chain, *target = _each_body(seen, energies, known.stiffness, origin)
    for body in (chain, *target):
        caveats += mode_caveats(body["mode_frequencies"])
    uncounted = detection.unresolved or reading.start.kind == "late" or bodies.soft
    return CollisionAnalysis(
        **chain,
        particles=masses[0].size,
        bond=known.bond,
        velocity=velocity,
        restitution=e**2,
        restitution_bound=bound,
        kinematic_restitution=e,
        restitution_error=None,
        data_error=error,
        contact_times=times,
        contact_speeds=detection.speeds,
        contact_statistics=statistics,
        contacts=None if uncounted else statistics.count,
        detection=detection,
        anharmonic_remainder=None
        if known.bond is None
        else float(anharmonic_remainder(seen.last.displacements, known.bond)),
        energy_drift=None if drifts is None else drifts[1],
        momentum_residual=_momentum_residual(seen),
        bond_min=min(record.bond_min for record in seen.records),
        bond_max=max(record.bond_max for record in seen.records),
        frames=seen.records[0].count,
        timestep=None if reading.layout.time_known else known.timestep,
        time_start=float(seen.opening.time - origin),
        time_end=float(seen.last.time - origin),
        ending=ending.argument,
        finished=ending.finished,
        contradictions=contradictions,
        caveats=(*contradictions, *notes, *caveats),
        soft=bodies.soft,
        target=BodyAnalysis(**target[0]) if target else None,
    )


def _each_body(
    seen: Followed, energies: Sequence[Energies], stiffness: float, origin: float
) -> list[dict[str, Any]]:
    """Return what a BodyAnalysis holds, of each body; a target's velocity is along x."""
    found = []
    states = zip(seen.masses, seen.opening.bodies, seen.last.bodies, strict=True)
    for k, (m, first, last) in enumerate(states):
        velocity = float(centre_of_mass_velocity(last.velocities, m))
        found.append(
            {
                "masses": m,
                "velocity_after": -velocity if k else velocity,
                "history": seen.records[k].history(origin),
                "energy_start": energies[0][k],
                "energy_end": energies[2][k],
                "mode_frequencies": mode_frequencies(m.size, stiffness, m),
                "mode_energies": mode_energies(last.displacements, last.velocities, stiffness, m),
                "mode_energies_start": mode_energies(
                    first.displacements, first.velocities, stiffness, m
                ),
            }
        )
    return found


def _ending(seen: Followed, known: Known) -> Ending:
    """Return how the dump ends, and why no contact with the wall follows where masses are alike."""
    masses, state, argument = seen.masses[0], seen.last, None
    if (
        known.bond is not None
        and known.end_argument is not None
        and known.bodies == CHAIN_AND_WALL
        and are_equal(masses)
    ):
        # A mass of 1 is taken there: in units of sqrt(m/k) the motion is the same.
        root = float(np.sqrt(masses[0]))
        strains, since = bond_strains(state.displacements), seen.since_contact / root
        argument = known.end_argument(
            state.gap, strains, root * state.velocities, since, known.bond
        )
    return Ending(seen, known.bond, argument)


def _energies(state: ChainState, masses: Sequence[Array], bond: Potential | None) -> Energies:
    """Return the energy of each body; None where the bond is not known."""
    return [
        None if bond is None else energy_split(body.displacements, body.velocities, bond, m)
        for body, m in zip(state.bodies, masses, strict=True)
    ]


def _total(energies: Energies) -> float:
    """Return the energy of all bodies."""
    return sum(float(part.total) for part in energies if part is not None)


def _drifts(energies: Sequence[Energies]) -> tuple[float, float]:
    """Return how the energy changes to the first frame after the last contact, and to the last."""
    start, parted, end = map(_total, energies)
    return (parted - start) / start, (end - start) / start


def _momentum_residual(seen: Followed) -> float:
    """Return what a wall's contacts do not explain, of two bodies by how much both have changed."""
    if len(seen.masses) == 1:
        if seen.detection.method == "none":
            return 0.0  # a soft wall takes any momentum
        return momentum_residual(
            seen.last.velocities, seen.velocity, seen.detection.speeds, seen.masses[0]
        )
    both = [_momentum(each, seen.masses) for each in (seen.opening, seen.last)]
    return abs(both[1] - both[0]) / (float(np.sum(seen.masses[0])) * seen.velocity)


def _momentum(state: ChainState, masses: Sequence[Array]) -> float:
    """Return the momentum of both bodies; mirrored, the target's counts the other way."""
    return sum(
        sign * float(m @ body.velocities)
        for sign, m, body in zip((1.0, -1.0), masses, state.bodies, strict=True)
    )


def _largest_restitution(energies: Energies, seen: Followed, moving: bool) -> float | None:
    """Return eta if all energy of the first frame became relative motion; None if not known."""
    if None in energies:
        return None if moving else 1.0
    masses = [float(np.sum(m)) for m in seen.masses]
    reduced = 1.0 / sum(1.0 / mass for mass in masses)
    energy = _total(energies)
    if len(masses) > 1:
        # What both do as one body stays.
        energy -= 0.5 * _momentum(seen.opening, seen.masses) ** 2 / sum(masses)
    bound = energy / (0.5 * reduced * seen.velocity**2)
    return bound if bound > 1.0 + _ROUNDINGS else 1.0
