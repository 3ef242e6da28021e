"""Construct the outcome from the state after the last contact, for all reference engines."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.table_bond import SplineBond
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.fragments import count_fragments
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH, Frames, Outcome
from chaincor.workflows.errors import (
    BarrierError,
    BondRangeError,
    CrossingError,
    RunError,
    TimestepError,
    UnfinishedCollisionError,
)

# A run for comparison continues for this time after the last contact of the first run. The unit is
# the time that sound takes through one bond. KNOWN_MARGIN exceeds the time between contacts, and
# the difference between the contact times of the two runs.
KNOWN_MARGIN = 5.0

# A bond whose strain exceeds this fraction of its data range may have left the range within one
# step.
_NEAR_END = 0.95

# A collision of n beads is followed for n + 10 times _FOLLOWED, in units of the time in which two
# colliding beads stop each other. At a soft contact, it is also followed for _WHOLE times the time
# in which the column stops, but at most for _LONGEST times that of two beads.
_FOLLOWED, _WHOLE, _LONGEST = 1000.0, 100.0, 1e6


@dataclass(frozen=True)
class LastContact:
    """State of the bodies right after their last contact, and the record of all contacts."""

    #: Bond lengths less one along x, including the gap between two bodies, of shape (N - 1,). A
    #: hard wall does not count as a particle.
    strains: Array
    velocities: Array  #: Velocities along x, positive away from the wall; of shape (N,).
    #: Contact times since the first contact; of shape (contacts,).
    contact_times: Array
    contact_speeds: Array  #: Closing speeds; of shape (contacts,).
    #: Impulses on the chain, of shape (contacts,); None if a wall reversed a particle of mass 1.
    impulses: Array | None = None
    position: float = 0.0  #: Displacement of the first particle along x.
    lasted: float = 0.0  #: Time from the initial state to the end of the last contact.
    #: Lengths of the shortest and longest bond so far.
    bond_range: tuple[float, float] = (1.0, 1.0)
    #: Energy lost to damping until the end of the last contact; None without damping.
    dissipated: float | None = None
    #: Quantities of `tracked.TRACKED`, by name.
    tracked: dict[str, float] = field(default_factory=dict)
    #: Total energy; None if it must be computed from the strains and velocities, which is less
    #: accurate.
    energy: float | None = None


class End(NamedTuple):
    """End of a collision."""

    ending: Ending  #: Evidence that no further contact comes.
    time: float  #: Time since the first contact at which the end was found.
    evaluations: int  #: Number of evaluations of all bond forces until this time.


def displacements_from(position: float, strains: Array) -> Array:
    """Return u_i = x_i - (i - 1), of shape (..., n), from u_1 and the strains of n - 1 bonds."""
    first = np.full((*strains.shape[:-1], 1), position)
    return np.cumsum(np.concatenate((first, strains), axis=-1), axis=-1)


def finish(
    problem: Problem,
    last: LastContact,
    end: End,
    *,
    scheme: str,
    timestep: float | None,
    seconds: float,
    frames: Frames | None = None,
) -> Outcome:
    """
    Return the outcome of a scene from the state after its last contact.

    The keyword arguments are fields of `Outcome`. Raises TimestepError if the energy has grown so
    much that the steps must be unstable.
    """
    bond, line = problem.bond, problem.line
    energy_start = _start_energy(problem)
    energy_end = _end_energy(problem, last) if last.energy is None else last.energy
    if not energy_end <= MOST_ENERGY_GROWTH * energy_start:
        raise TimestepError(
            f"the energy of the {problem.label} chain grew from {energy_start:.6g} to "
            f"{energy_end:.6g}. Take a smaller timestep, or lower the speed"
        )
    taken = last.dissipated
    if taken is None and line.contact.damped:
        # loops with fixed steps do not record the energy lost to damping; it is the loss of total
        # energy
        taken = energy_start - energy_end
    low, high = last.bond_range
    displacements = displacements_from(last.position, last.strains)
    first, targets = (0, 0) if line.at_wall else (line.first, line.targets)
    strains, velocities = last.strains[first:], last.velocities[first:]
    masses = None if line.is_standard else line.chain_masses
    impulses = 2.0 * last.contact_speeds if last.impulses is None else last.impulses
    return Outcome(
        problem=problem,
        engine="reference",
        wall="event",
        scheme=scheme,
        timestep=timestep,
        displacements=displacements[first:],
        velocities=velocities.copy() if first else velocities,
        contact_times=last.contact_times,
        contact_speeds=last.contact_speeds,
        impulses=impulses,
        ending=end.ending,
        duration=end.time,
        bond_min=low,
        bond_max=high,
        energy_start=energy_start,
        energy_end=energy_end,
        fragments=count_fragments(strains, velocities, bond, masses),
        seconds=seconds,
        lasted=last.lasted,
        force_evaluations=end.evaluations,
        crossed=low < 0.0,
        frames=frames,
        dissipated=taken,
        tracked=last.tracked,
        target_displacements=displacements[:targets][::-1],
        target_velocities=last.velocities[:targets][::-1].copy(),
    )


def _start_energy(problem: Problem) -> float:
    """Return the total energy at the start."""
    if problem.line.is_standard:
        return 0.5 * problem.particles * problem.impact_velocity**2
    return problem.start_energy


def _end_energy(problem: Problem, last: LastContact) -> float:
    """Return the total energy after the last contact, computed from strains and velocities."""
    line, bond = problem.line, problem.bond
    with np.errstate(over="ignore", invalid="ignore"):
        if line.is_standard:
            return kinetic_energy(last.velocities) + float(np.sum(bond.energy(last.strains)))
        strains, velocities = last.strains, last.velocities
        if line.at_wall:
            strains, velocities = np.append(0.0, strains), np.append(0.0, velocities)
        return line.energy(bond, strains, velocities)


def kinetic_energy(velocities: Array) -> float:
    """Return the kinetic energy of unit masses, with the same rounding for any memory alignment."""
    # The rounding of the operator `@` would depend on the memory addresses.
    return 0.5 * float(np.sum(np.square(velocities)))


def run_single_particle(
    problem: Problem, scheme: str, timestep: float | None, frame_interval: float | None
) -> Outcome:
    """
    Return the outcome of one particle, which bounces once and keeps its speed.

    With a `frame_interval` the outcome has one snapshot, because the collision is over at t = 0.
    """
    velocities = np.array([problem.impact_velocity])
    frames = None
    if frame_interval is not None:
        frames = Frames(np.zeros(1), np.zeros((1, 1)), velocities.reshape(1, 1).copy())
    return finish(
        problem,
        LastContact(
            *(np.empty(0), velocities, np.zeros(1), velocities.copy()),
            impulses=2.0 * problem.line.contact_mass * velocities,
        ),
        End(Ending("proved"), 0.0, 0),
        scheme=scheme,
        timestep=timestep,
        seconds=0.0,
        frames=frames,
    )


def allowed_strains(bond: Potential) -> tuple[float, float]:
    """
    Return the smallest and the largest allowed strain, at which a run stops.

    At the smallest strain, two particles coincide or the data of the bond end. Particles with
    harmonic bonds have no such limit, because they may pass through each other. The largest strain
    is the strain at the energy barrier or at the end of the data.
    """
    return bond.crossing_strain, min(bond.barrier_strain, bond.strain_max)


def strain_error(problem: Problem, low: float, high: float, time: float, remedy: str) -> RunError:
    """
    Return the error that describes invalid strains of a chain.

    `low` and `high` are the smallest and largest strain so far. `time` counts from the first
    contact. `remedy` is the advice if the numerics are at fault. The error is BarrierError if a
    bond is beyond its energy barrier, CrossingError if a bond has a negative length that its
    potential permits, and BondRangeError if a bond has left the range of its data. In all other
    cases, including strains that are not numbers, it is TimestepError.
    """
    bond = problem.bond
    barrier = bond.barrier_strain
    if high >= barrier:
        return BarrierError(
            f"a {problem.label} bond is stretched to {1.0 + high:.6g} at time {time:.6g}, past its "
            f"energy barrier at {1.0 + barrier:.6g}, beyond which its energy falls; lower the speed"
        )
    with np.errstate(all="ignore"):
        holds = not math.isfinite(float(bond.energy(np.array(-1.0))))
    if low <= -1.0 and not holds:
        return CrossingError(
            f"two particles meet at time {time:.6g}: a {problem.label} bond cannot keep them apart "
            f"at velocity {problem.impact_velocity:.6g}; lower the speed or stiffen the bond"
        )
    # Beyond its data, a bond has no force and strains become NaN; therefore `low` and `high` come
    # from earlier steps.
    first, last = _NEAR_END * bond.strain_min, _NEAR_END * bond.strain_max
    if (bond.strain_min > -1.0 and low <= first) or high >= last:
        remedy = "Extend the table, or lower" if isinstance(bond, SplineBond) else "Lower"
        return BondRangeError(
            f"a {problem.label} bond is {1.0 + low:.6g} to {1.0 + high:.6g} long by time "
            f"{time:.6g}, but its data reach from {1.0 + bond.strain_min:.6g} to "
            f"{1.0 + bond.strain_max:.6g}. {remedy} the speed"
        )
    return TimestepError(
        f"the motion of {problem.label} bonds is not resolved at time {time:.6g} (bond lengths "
        f"{1.0 + low:.6g} to {1.0 + high:.6g}); {remedy}"
    )


def bead_time_limit(problem: Problem) -> float:
    """Return the time for which a collision of beads is followed."""
    line, speed = problem.line, problem.impact_velocity
    # Overlaps of two beads that stop each other, and of the column that stops at its contact
    overlap = -problem.bond.compressed_strain(line.mean_mass * speed**2)
    overlap += float(np.max(line.strains, initial=0.0))
    whole = _WHOLE * line.contact.overlap(0.5 * line.chain_mass * speed**2)
    own = _FOLLOWED * (problem.all_particles + 10) * overlap
    return (own + min(whole, _LONGEST * overlap)) / speed


def unfinished_error(problem: Problem, longest: float) -> UnfinishedCollisionError:
    """Return the error for a collision that did not end within the time `longest`."""
    if problem.bond.only_pushes:
        damped = "damping" in problem.bond.as_keys() or problem.line.contact.damped
        advice = "Lower the damping" if damped else "Give a stiffer contact, or another speed"
        return UnfinishedCollisionError(
            f"the bodies have not parted at time {longest:.6g}. {advice}"
        )
    return UnfinishedCollisionError(
        f"a time of {longest:.6g} after the first contact the {problem.particles} "
        "particles still approach the wall, longer than sound needs to cross them and "
        "come back. Take a smaller timestep, or another speed"
    )
