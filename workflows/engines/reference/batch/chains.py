"""Store the collisions of a batch: initial states, chains in motion and results."""

import math
from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.batch.lanes import (
    ENDED,
    ENDLESS,
    MOVE,
    MOVING,
    ChainRows,
    Lanes,
)
from chaincor.workflows.engines.reference.finish import displacements_from
from chaincor.workflows.engines.reference.moving import Motion, Stepper
from chaincor.workflows.engines.reference.stages import State


@dataclass(frozen=True)
class Rows:
    """Arrays in which each row belongs to one of many collisions."""

    def chosen(self, which: NDArray) -> Self:
        """Return the rows that `which` selects."""
        return type(self)(*(getattr(self, f.name)[which] for f in fields(self)))


@dataclass(frozen=True)
class StartStates(Rows):
    """Initial states for many collisions of one chain."""

    strains: Array  #: Gap at the wall, then strains of the bonds; of shape (samples, n).
    velocities: Array  #: Velocities, positive away from the wall; of shape (samples, n).

    @classmethod
    def of(cls, lines: list[Line]) -> "StartStates":
        """Return the initial states of chains at a rigid wall."""
        return cls(
            np.array([line.strains for line in lines]),
            np.array([line.velocities[1:] for line in lines]),
        )

    @classmethod
    def cold(cls, speeds: Array, particles: int) -> "StartStates":
        """Return cold chains that touch the wall and approach it at the given speeds."""
        strains = np.zeros((len(speeds), particles))
        return cls(strains, np.repeat(-speeds[:, None], particles, axis=1))

    def __len__(self) -> int:
        return len(self.strains)


@dataclass(frozen=True)
class ManyRuns(Rows):
    """Results of many runs."""

    #: Whether the run reached an end, of shape (runs,); without an end, the other fields have no
    #: meaning.
    settled: NDArray[np.bool_]
    #: Whether no end was found within the simulated time allowed, of shape (runs,). A run at
    #: another step would then find no end either.
    endless: NDArray[np.bool_]
    #: End of each run, of shape (runs,); None if no end was searched for.
    endings: NDArray[np.object_]
    durations: Array  #: Simulated time from the first contact to the end; of shape (runs,).
    evaluations: NDArray[np.int64]  #: Number of evaluations of all bond forces; of shape (runs,).
    #: Strains right after the last contact; of shape (runs, n - 1).
    strains: Array
    velocities: Array  #: Velocities right after the last contact; of shape (runs, n).
    speeds: Array  #: Centre-of-mass velocity right after the last contact; of shape (runs,).
    #: Contact times since the first contact, and incoming speeds; of shape (runs, 2, capacity).
    contacts: Array
    counts: NDArray[np.int64]  #: Number of contacts; of shape (runs,).
    lasted: Array  #: Time from the initial state to the end of the last contact; of shape (runs,).
    #: Length of the shortest bond up to the last contact; of shape (runs,).
    bond_min: Array
    bond_max: Array  #: Length of the longest bond up to the last contact; of shape (runs,).
    energies: Array  #: Energy of all bonds right after the last contact; of shape (runs,).
    #: Wall-clock time of the integration, divided equally among the runs; of shape (runs,).
    seconds: Array

    @property
    def displacements(self) -> Array:
        """Displacements u_i = x_i - (i - 1) after the last contact, of shape (runs, n)."""
        return displacements_from(0.0, self.strains)

    @property
    def listed(self) -> NDArray[np.bool_]:
        """Whether each entry of `contacts` is filled, of shape (runs, capacity)."""
        return np.arange(self.contacts.shape[2]) < self.counts[:, None]

    @property
    def last_contact_times(self) -> Array:
        """Times of the last contacts."""
        return self.contacts[np.arange(len(self.counts)), 0, self.counts - 1]

    @property
    def longest_silences(self) -> Array:
        """Longest time between two contacts in each run; 0 if there is only one contact."""
        gaps = np.diff(self.contacts[:, 0], axis=1)
        return np.asarray(np.max(gaps, axis=1, where=self.listed[:, 1:], initial=0.0))

    @property
    def proved(self) -> NDArray[np.bool_]:
        """Whether the end of each run is proved; otherwise it is argued."""
        kinds = [ending is not None and ending.kind == "proved" for ending in self.endings]
        return np.array(kinds, bool)


def chain_energies(line: Line, bond: Potential, starts: StartStates) -> Array:
    """Return the energy of each chain, of shape (samples,)."""
    motion = 0.5 * each_sum(starts.velocities**2 * line.chain_masses)
    return motion + np.sum(bond.energy(starts.strains[:, 1:]), axis=1)


def each_sum(terms: Array) -> Array:
    """
    Return the sum of each row.

    In a matrix product, the rounding of one row may depend on the number of rows.
    """
    return np.asarray(np.sum(terms, axis=1))


class Chains:
    """
    Chains in motion; the counterpart of ``Motion`` for many chains, with one row per chain.

    `stepper` has the properties that all chains share; `starts` and `steps` contain the initial
    state and the step H of each chain. `speeds` are the speeds at which the chains approach the
    wall, by default the speeds of their centres of mass. The compiled loop changes `rows` in place.
    """

    def __init__(
        self,
        stepper: Stepper,
        starts: StartStates,
        steps: Array,
        speeds: Array | None = None,
    ) -> None:
        self._stepper, line = stepper, stepper.line
        count, masses = len(starts), line.chain_masses
        self._shares = masses / float(np.sum(masses))
        approach = -each_sum(starts.velocities * self._shares) if speeds is None else speeds
        first = Motion.in_state(stepper, line.strains, line.velocities, 0.0)
        first.start_front()
        self._first = first
        run_states = np.repeat(np.array([first.run_state], first.run_state.dtype), count).view(
            np.recarray
        )
        strain, velocity = starts.strains[:, 1:].copy(), starts.velocities.copy()
        run_states["impact_velocity"] = approach
        run_states["position"] = starts.strains[:, 0]
        run_states["momentum"] = line.reduced_mass * -approach
        if strain.size > 0:
            run_states["strain_min"] = np.min(strain, axis=1)
            run_states["strain_max"] = np.max(strain, axis=1)
        for name in ("min", "max"):
            run_states[f"contact_{name}"] = run_states[f"strain_{name}"]
        contacts = np.zeros((count, *first.arrays.contacts.shape))
        # Chains that touch the wall and approach it have their first contact now.
        met = (starts.strains[:, 0] == 0.0) & (velocity[:, 0] < 0.0)
        closing = np.where(met, -velocity[:, 0], 0.0)
        velocity[met, 0] = closing[met]
        given = 2.0 * line.contact_mass * closing
        contacts[:, 1, 0], contacts[:, 2, 0] = closing, given
        run_states["contacts"] = met
        run_states["momentum"] += given
        run_states["argue_after"] = np.where(met, run_states["argue_first"], np.inf)
        inverse = 1.0 / masses
        # Each object has its own SIMD lanes, because several threads compute parts of one batch.
        self.lanes = Lanes.of(inverse)
        self.near = Lanes.of(inverse[: stepper.scheme.reach + 1])
        self.rows = ChainRows(
            run_states=run_states,
            moves=np.zeros(count, MOVE).view(np.recarray),
            strains=strain,
            velocities=velocity,
            last_strains=strain.copy(),
            last_velocities=velocity.copy(),
            contacts=contacts,
            energies=chain_energies(line, stepper.bond, starts),
            steps=np.asarray(steps, dtype=float),
            target_steps=np.zeros(count, np.int64),
            statuses=np.full(count, MOVING),
        )
        self.durations = np.zeros(count)  # simulated time from the first contact to the end
        self.endings = np.full(count, None)  # end of each chain; None if it was not searched for

    def times(self) -> Array:
        """Return the time of each chain since its start."""
        return np.asarray(self.rows.run_states["steps"] * self.rows.steps)

    def arrival(self) -> Array:
        """Return the times at which the centres of mass would reach the wall."""
        run_states, strains = self.rows.run_states, self.rows.strains
        along = displacements_from(0.0, strains)
        distance = run_states["position"] + each_sum(along * self._shares)
        return np.asarray(np.maximum(distance, 0.0) / run_states["impact_velocity"])

    def follow_until(self, times: Array) -> None:
        """Let every chain continue until its time in `times`, counted from the start."""
        self.rows.target_steps[:] = np.ceil(times / self.rows.steps)

    def follow_on(self, s: int, until: float) -> None:
        """Let one chain continue until a time, for at least one step."""
        done, target_steps = (
            int(self.rows.run_states["steps"][s]),
            math.ceil(until / self.rows.steps[s]),
        )
        self.rows.target_steps[s], self.rows.statuses[s] = max(done + 1, target_steps), MOVING

    def end(self, s: int, ending: Ending, time: float) -> None:
        """Record the end of one chain, found at `time` after its first contact."""
        self.endings[s], self.durations[s], self.rows.statuses[s] = ending, time, ENDED

    def make_room(self) -> None:
        """Double the room for contacts if a chain needs it."""
        full = self.rows.statuses == bookkeeping.FULL
        if np.any(full):
            contacts = self.rows.contacts
            more = np.concatenate((contacts, np.zeros_like(contacts)), axis=2)
            self.rows = self.rows._replace(contacts=more)
            self.rows.statuses[full] = MOVING

    def chain(self, s: int) -> Motion:
        """Return one chain, to be changed in place."""
        rows = self.rows
        arrays = self._first.arrays._replace(
            now=State(rows.strains[s], rows.velocities[s]),
            last=State(rows.last_strains[s], rows.last_velocities[s]),
            contacts=rows.contacts[s],
        )
        return Motion(self._stepper.of_size(float(rows.steps[s])), rows.run_states[s], arrays)

    def outcomes(self, seconds: float, done: NDArray[np.bool_] | None = None) -> ManyRuns:
        """Return the results; runs without an end, or not in `done`, count as not settled."""
        run_states, contacts = self.rows.run_states, self.rows.contacts
        strains, velocities = self.rows.last_strains, self.rows.last_velocities
        if done is None:
            done = np.array([ending is not None for ending in self.endings], bool)
        with np.errstate(all="ignore"):
            energies = np.sum(np.asarray(self._stepper.bond.energy(strains)), axis=1)
            whole = energies + 0.5 * each_sum(velocities**2 * self._stepper.line.chain_masses)
            bounded = whole <= MOST_ENERGY_GROWTH * self.rows.energies
        contacts[:, 0] -= run_states["first_contact"][:, None]
        return ManyRuns(
            settled=done & bounded,
            endless=self.rows.statuses == ENDLESS,
            endings=self.endings,
            durations=self.durations,
            evaluations=run_states["evaluations"],
            strains=strains,
            velocities=velocities,
            speeds=each_sum(velocities * self._shares),
            contacts=contacts[:, :2],
            counts=run_states["contacts"],
            lasted=run_states["last_contact"],
            bond_min=1.0 + run_states["contact_min"],
            bond_max=1.0 + run_states["contact_max"],
            energies=energies,
            seconds=np.full(len(done), seconds / len(done)),
        )
