"""Run a column of beads in LAMMPS with its granular styles."""

import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.hertz import Hertz
from chaincor.lammps_inputs.granular import bead_rests
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.fragments import count_fragments
from chaincor.workflows.engines.lammps.contact import ContactRecord, HardContactEvents
from chaincor.workflows.engines.lammps.flight import VerletFlight
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.outcome import Frames, Outcome
from chaincor.workflows.engines.reference.finish import bead_time_limit, unfinished_error
from chaincor.workflows.errors import CrossingError, LostAtomsError

# The interval between checks for the end of the collision, in units of the time in which two
# colliding beads stop each other.
_LOOK = 0.3


def run_beads(
    problem: Problem,
    numerics: Numerics,
    timesteps: Sequence[float],
    frame_interval: float | None = None,
) -> tuple[Outcome, ...]:
    """
    Run one column of beads at several time steps in one LAMMPS instance.

    LAMMPS takes Verlet steps. A step that would end behind a hard wall is shortened to end at the
    wall. For soft bodies, LAMMPS computes the force between the overlapping bodies. Only the first
    run has frames. Raises a RunError that names the failure.
    """
    outcomes = []
    with (
        tempfile.TemporaryDirectory(prefix="chaincor-") as name,
        LammpsChain(problem, numerics, None, Path(name)) as chain,
    ):
        for step in timesteps:
            chain.restart(step)
            column = _Column(problem, chain, frame_interval)
            started = time.perf_counter()
            column.follow()
            seconds = time.perf_counter() - started
            used = replace(numerics, timestep=step)
            outcomes.append(column.outcome(used, seconds))
            frame_interval = None
    return tuple(outcomes)


class _Column:
    """Column in motion, with a record of its contacts, bond lengths, frames and end."""

    def __init__(self, problem: Problem, chain: LammpsChain, frame_interval: float | None) -> None:
        self._problem, self._chain, self._line = problem, chain, problem.line
        n, targets = problem.particles, problem.line.targets
        self._rest = bead_rests(problem.line)
        beads = problem.line.diameters
        # _reach contains minus the diameter of each bead. If the sum of the two gaps beside a bead
        # is at most this value, the neighbours of this bead touch each other.
        self._reach = -(np.ones(n + targets) if beads is None else beads)[
            : n + targets - 1 - bool(targets)
        ]
        self._order = np.append(np.arange(n + targets)[: n - 1 : -1], np.arange(n))
        self._flight = VerletFlight(chain, HardContactEvents(chain, problem.line), False, None)
        self._contacts: list[ContactRecord] = []
        self._touched: tuple[float, float, float] | None = None
        self._seen = self._range = (0.0, 0.0)
        self._last = self._state()
        self._interval = frame_interval
        self._frames: list[tuple[float, Array, Array]] = []
        unit = -problem.bond.compressed_strain(problem.line.mean_mass * problem.impact_velocity**2)
        unit /= problem.impact_velocity
        self._look = _LOOK * unit
        self._longest = bead_time_limit(problem)

    def _state(self) -> tuple[Array, Array]:
        """Return displacements and velocities along x; a rigid wall counts as a particle."""
        u, v = (self._chain.x - self._rest)[self._order], self._chain.v[self._order].copy()
        return (np.append(0.0, u), np.append(0.0, v)) if self._line.rigid else (u, v)

    def follow(self) -> None:
        """Run until the bodies provably do not touch again."""
        flight, ended, next_frame = self._flight, False, 0.0
        while not ended:
            if self._interval is not None and flight.time >= next_frame:
                self._frames.append((flight.time, *self._state()))
                next_frame += self._interval
            until = min(flight.time + self._look, next_frame or np.inf)
            contact = self._overlap(until) if self._line.soft else flight.advance(until)
            if contact is not None:
                self._contacts.append(contact)
                self._last, self._range = self._state(), self._seen
            if not flight.time < self._longest:
                raise unfinished_error(self._problem, flight.time)
            ended = self._watch()
        if self._interval is not None:
            self._frames.append((flight.time, *self._state()))

    def _watch(self) -> bool:
        """Update the range of bond lengths; return whether the bodies have parted for good."""
        line = self._line
        u, v = self._state()
        gaps = np.diff(u)
        if not np.all(np.isfinite(gaps)):
            raise LostAtomsError(
                f"a coordinate is not a number at time {self._flight.time:g}. Take a smaller "
                "timestep"
            )
        strains = np.delete(gaps, line.gap)
        low, high = float(np.min(strains, initial=0.0)), float(np.max(strains, initial=0.0))
        if np.any(gaps[1:] + gaps[:-1] <= self._reach) or np.min(gaps) <= np.min(
            self._reach, initial=-1.0
        ):
            raise CrossingError(
                f"at time {self._flight.time:g}, a bead overlaps with the second bead after it. "
                "LAMMPS would make these two repel each other, although they are no neighbours. "
                "Lower the speed, or use engine 'reference'"
            )
        self._seen = min(low, self._seen[0]), max(high, self._seen[1])
        stiffness = np.delete(line.pair_stiffness, line.gap)
        potential = float(np.sum(stiffness * self._problem.bond.energy(strains)))
        return bool(self._contacts) and bodies_part(line, potential, float(gaps[line.gap]), v)

    def _gap(self) -> tuple[float, float]:
        """Return the gap between the bodies and its rate of change."""
        x, v, n = self._chain.x, self._chain.v, self._problem.particles
        if self._line.rigid:
            return float(x[0]), float(v[0])
        return float(x[0] - x[n]) - 1.0, float(v[0] - v[n])

    def _momentum(self) -> float:
        return float(self._line.chain_masses @ self._chain.v[: self._problem.particles])

    def _overlap(self, until: float) -> ContactRecord | None:
        """Move soft bodies until a time; return the contact that ends before, if any."""
        flight, chain = self._flight, self._chain
        gap, gap_velocity = self._gap()
        if self._touched is None and gap <= 0.0 > gap_velocity:
            self._touched = flight.time, -gap_velocity, self._momentum()
        while flight.time < until:
            before, started = (gap, gap_velocity), flight.time
            chain.run(1)
            flight.time += chain.timestep
            gap, gap_velocity = self._gap()
            if (gap < 0.0) != (self._touched is not None):
                share = before[0] / (before[0] - gap)
                moment = started + share * chain.timestep
                if self._touched is None:
                    speed = -before[1] - share * (gap_velocity - before[1])
                    self._touched = moment, speed, self._momentum()
                elif gap > 0.0:
                    touched, speed, momentum = self._touched
                    self._touched = None
                    return ContactRecord(touched, speed, self._momentum() - momentum, moment)
        return None

    def outcome(self, numerics: Numerics, seconds: float) -> Outcome:
        """Return the raw outcome."""
        line, bond, contacts = self._line, self._problem.bond, self._contacts
        assert isinstance(bond, Hertz)
        first, targets = line.first, line.targets
        u, v = self._last
        began = contacts[0].time
        energy_start, energy_end = self._problem.start_energy, line.energy(bond, np.diff(u), v)
        # LAMMPS does not record the energy lost to damping; it is the loss of total energy.
        missing = energy_start - energy_end if bond.damping > 0.0 else None
        displacements, velocities = u[first:].copy(), v[first:].copy()
        frames = [(moment - began, x, w) for moment, x, w in self._frames]
        return Outcome(
            problem=self._problem,
            engine="lammps",
            wall=numerics.wall,
            scheme=numerics.scheme,
            timestep=numerics.timestep,
            displacements=displacements,
            velocities=velocities,
            target_displacements=u[:targets][::-1].copy(),
            target_velocities=v[:targets][::-1].copy(),
            contact_times=np.array([contact.time - began for contact in contacts]),
            contact_speeds=np.array([contact.speed for contact in contacts]),
            impulses=np.array([contact.impulse for contact in contacts]),
            ending=Ending("proved"),
            duration=self._flight.time - began,
            bond_min=1.0 + self._range[0],
            bond_max=1.0 + self._range[1],
            energy_start=energy_start,
            energy_end=energy_end,
            dissipated=missing,
            fragments=count_fragments(np.diff(displacements), velocities, bond, line.chain_masses),
            seconds=seconds,
            lasted=contacts[-1].end,
            force_evaluations=self._chain.stages_done,
            numerics=numerics,
            frames=Frames.of(line, *zip(*frames, strict=True)) if frames else None,
        )


def bodies_part(line: Line, potential: float, gap: float, velocities: Array) -> bool:
    """
    Return whether it is proved that two bodies at a distance `gap` never touch again.

    `velocities` are along x, of shape (N,). `potential` is an upper bound on the energy of all
    overlaps within the bodies. The docstring of :mod:`..reference.bead_loops` has the proof, which
    compares the velocities of the beads with velocities w that rise along x. The energy limits the
    differences between both sets of velocities.
    """
    if gap < 0.0:
        return False
    first = 1 if line.rigid else 0
    v, masses = velocities[first:], line.masses[first:]
    low = np.minimum.accumulate(v[::-1])[::-1]
    high = np.maximum.accumulate(v)
    if line.rigid:  # a rigid wall does not move
        low, high = np.maximum(low, 0.0), np.maximum(high, 0.0)
    rising = 0.5 * (low + high)
    energy = 0.5 * float(masses @ (v - rising) ** 2) + potential
    faster = np.sqrt(2.0 * energy * line.inverse_masses[[line.gap, line.first]]).sum()
    before = 0.0 if line.rigid else rising[line.gap]
    return bool(rising[line.first - first] - before > faster)
