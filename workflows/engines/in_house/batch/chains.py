"""Many chains in motion before a wall: a row for each, and what came of them."""

import math

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.in_house import bookkeeping
from chaincor.workflows.engines.in_house.batch.lanes import Lanes
from chaincor.workflows.engines.in_house.batch.progress import (
    ENDED,
    ENDLESS,
    MOVING,
    ChainRows,
)
from chaincor.workflows.engines.in_house.batch.states import (
    ManyRuns,
    StartStates,
    chain_energies,
    each_sum,
)
from chaincor.workflows.engines.in_house.moving import Motion, Stepper
from chaincor.workflows.engines.in_house.stages import State
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH


class Chains:
    """
    Chains in motion: as ``Motion``, with a row for each.

    Parameters
    ----------
    line : Line
        One of them, for what all share.
    bond : Potential
        The bonds.
    stepper : Stepper
        Of their scheme.
    starts : StartStates
        Where they begin.
    steps : ndarray of shape (chains,)
        H of each.
    speeds : ndarray of shape (chains,), optional
        How fast each approaches the wall; by default that of its centre of mass.

    Attributes
    ----------
    rows : ChainRows
        What the compiled loop changes in place.
    lanes, near : Lanes
        Its SIMD lanes. Each group has its own, as several threads carry groups of one batch.
    durations : ndarray of shape (chains,)
        Simulated time from the first contact to the end.
    endings : ndarray of shape (chains,)
        How each ended, where that was looked for.
    """

    def __init__(
        self,
        line: Line,
        bond: Potential,
        stepper: Stepper,
        starts: StartStates,
        steps: Array,
        speeds: Array | None = None,
    ) -> None:
        self._line, self._bond = line, bond
        count = len(starts)
        energies = chain_energies(line, bond, starts)
        masses = line.chain_masses
        self._shares = masses / float(np.sum(masses))
        approach = -each_sum(starts.velocities * self._shares) if speeds is None else speeds
        first = Motion.in_state(line, bond, stepper.scheme, line.strains, line.velocities, 0.0)
        first.start_front()
        self._first = first
        ledgers = np.repeat(np.array([first.ledger], first.ledger.dtype), count).view(np.recarray)
        strain, velocity = starts.strains[:, 1:].copy(), starts.velocities.copy()
        ledgers["impact_velocity"] = approach
        ledgers["position"] = starts.strains[:, 0]
        ledgers["momentum"] = line.reduced_mass * -approach
        ledgers["strain_min"] = np.minimum(np.min(strain, axis=1, initial=0.0), 0.0)
        ledgers["strain_max"] = np.maximum(np.max(strain, axis=1, initial=0.0), 0.0)
        for name in ("min", "max"):
            ledgers[f"contact_{name}"] = ledgers[f"strain_{name}"]
        contacts = np.zeros((count, *first.arrays.contacts.shape))
        # Chains that touch the wall and approach it have met it.
        met = (starts.strains[:, 0] == 0.0) & (velocity[:, 0] < 0.0)
        closing = np.where(met, -velocity[:, 0], 0.0)
        velocity[met, 0] = closing[met]
        given = 2.0 * line.contact_mass * closing
        contacts[:, 1, 0], contacts[:, 2, 0] = closing, given
        ledgers["contacts"] = met
        ledgers["momentum"] += given
        ledgers["argue_after"] = np.where(met, ledgers["argue_first"], np.inf)
        inverse = 1.0 / masses
        self.lanes = Lanes.of(inverse)
        self.near = Lanes.of(inverse[: stepper.scheme.reach + 1])
        self.rows = ChainRows(
            ledgers=ledgers,
            strains=strain,
            velocities=velocity,
            last_strains=strain.copy(),
            last_velocities=velocity.copy(),
            contacts=contacts,
            energies=energies,
            steps=np.asarray(steps, dtype=float),
            goals=np.zeros(count, np.int64),
            statuses=np.full(count, MOVING),
        )
        self.durations = np.zeros(count)
        self.endings = np.full(count, None)

    def times(self) -> Array:
        """Return how long each has moved, since its start."""
        return np.asarray(self.rows.ledgers["steps"] * self.rows.steps)

    def arrival(self) -> Array:
        """Return when the mean displacements would be at the wall."""
        ledgers, strains = self.rows.ledgers, self.rows.strains
        zeros = np.zeros((len(strains), 1))
        along = np.cumsum(np.concatenate((zeros, strains), axis=1), axis=1)
        distance = ledgers["position"] + each_sum(along * self._shares)
        return np.asarray(np.maximum(distance, 0.0) / ledgers["impact_velocity"])

    def follow_until(self, times: Array) -> None:
        """Move all until times since their starts."""
        self.rows.goals[:] = np.ceil(times / self.rows.steps)

    def follow_on(self, s: int, until: float) -> None:
        """Move one of them on, by a step at least."""
        done, goal = int(self.rows.ledgers["steps"][s]), math.ceil(until / self.rows.steps[s])
        self.rows.goals[s], self.rows.statuses[s] = max(done + 1, goal), MOVING

    def end(self, s: int, ending: Ending, time: float) -> None:
        """Note how one of them ended, and when that was seen, since its first contact."""
        self.endings[s], self.durations[s], self.rows.statuses[s] = ending, time, ENDED

    def make_room(self) -> None:
        """Double the room for contacts where it does not suffice."""
        full = self.rows.statuses == bookkeeping.FULL
        if np.any(full):
            contacts = self.rows.contacts
            more = np.concatenate((contacts, np.zeros_like(contacts)), axis=2)
            self.rows = self.rows._replace(contacts=more)
            self.rows.statuses[full] = MOVING

    def chain(self, s: int) -> Motion:
        """Return one of them, to be changed in place."""
        rows = self.rows
        arrays = self._first.arrays._replace(
            now=State(rows.strains[s], rows.velocities[s]),
            last=State(rows.last_strains[s], rows.last_velocities[s]),
            contacts=rows.contacts[s],
        )
        return Motion(self._line, rows.ledgers[s], arrays)

    def outcomes(self, seconds: float, done: NDArray[np.bool_] | None = None) -> ManyRuns:
        """Return what came of them, where ends were seen or runs are `done`."""
        ledgers, contacts = self.rows.ledgers, self.rows.contacts
        strains, velocities = self.rows.last_strains, self.rows.last_velocities
        if done is None:
            done = np.array([ending is not None for ending in self.endings], bool)
        with np.errstate(all="ignore"):
            energies = np.sum(np.asarray(self._bond.energy(strains)), axis=1)
            whole = energies + 0.5 * each_sum(velocities**2 * self._line.chain_masses)
            bounded = whole <= MOST_ENERGY_GROWTH * self.rows.energies
        contacts[:, 0] -= ledgers["first_contact"][:, None]
        return ManyRuns(
            settled=done & bounded,
            endless=self.rows.statuses == ENDLESS,
            endings=self.endings,
            durations=self.durations,
            evaluations=ledgers["evaluations"],
            strains=strains,
            velocities=velocities,
            speeds=each_sum(velocities * self._shares),
            contacts=contacts[:, :2],
            counts=ledgers["contacts"],
            lasted=ledgers["last_contact"],
            bond_min=1.0 + ledgers["contact_min"],
            bond_max=1.0 + ledgers["contact_max"],
            energies=energies,
            seconds=np.full(len(done), seconds / len(done)),
        )
