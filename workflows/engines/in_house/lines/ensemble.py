"""Many collisions of one chain with a wall, which differ in their initial states and steps."""

import math

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.end_watch import EndWatch
from chaincor.workflows.engines.ending import quiet_time
from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.compile import scalar_force
from chaincor.workflows.engines.in_house.finish import KNOWN_MARGIN, allowed_strains
from chaincor.workflows.engines.in_house.line_stages import LineParameters
from chaincor.workflows.engines.in_house.lines.compiled import (
    EnsembleKernels,
    ensemble_kernels_for,
)
from chaincor.workflows.engines.in_house.lines.ensemble_loop import (
    DUE,
    MOVING,
    PROVED,
    EndBounds,
)
from chaincor.workflows.engines.in_house.lines.lanes import LANES, Lanes
from chaincor.workflows.engines.in_house.lines.many_states import (
    ManyOutcomes,
    StartStates,
    chain_energies,
    each_sum,
)
from chaincor.workflows.engines.interrupts import WORK_AT_ONCE
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH
from chaincor.workflows.engines.parting import bodies_of
from chaincor.workflows.engines.piece_bounds import (
    ENERGY_LADDER,
    Lever,
    breaking_energy,
    reach,
)
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import RunError

Array = NDArray[np.float64]

# Contacts are listed until there are so many; then only their number is kept.
_LISTED = 2 * motion.SPARE_CONTACTS
# Bounds are worked out down to this part of the largest energy.
_LEAST_ENERGY = 1e-4
# Collisions of n particles take about this long.
_USUAL_CROSSINGS = 5.0


def serves(line: Line, bond: Potential) -> bool:
    """Return whether collisions are of a kind that is carried here: a hard, rigid wall."""
    compiled = scalar_force(bond) is not None and len(line.chain_masses) > 1
    return line.rigid and line.first == 1 and not line.soft and bond.smooth and compiled


class ManyCollisions:
    """
    Collisions of one chain with a hard wall, by steps of one kind.

    Parameters
    ----------
    line : Line
        One of them, for what all share.
    bond : Potential
        The bonds.
    scheme : str
        Of ``schemes``.
    """

    def __init__(self, line: Line, bond: Potential, scheme: str) -> None:
        self._line, self._bond = line, bond
        self._scheme = STEP_SCHEMES[scheme]
        kernels = ensemble_kernels_for(bond, self._scheme)
        assert kernels is not None, "serves() says so"
        self._kernels: EnsembleKernels = kernels
        self._stiffness = bond.stiffness / line.mean_mass
        self._parameters = tuple(LineParameters.of(line, kernels.parameters))
        self._bounds: dict[int, EndBounds] = {}
        self.stopped = np.zeros(1, bool)

    @property
    def particles(self) -> int:
        """Of the chain."""
        return len(self._line.chain_masses)

    def share(self, step: float) -> int:
        """Return how many collisions to carry at once, so that progress is seen."""
        n = self.particles
        duration = _USUAL_CROSSINGS * 2.0 * (n + 10.0) / self._stiffness**0.5
        work = duration / step * self._scheme.evaluations * n
        # Towards the end lanes are empty: not too few.
        return int(min(max(WORK_AT_ONCE / work, 4 * LANES), 1024))

    def energies(self, starts: StartStates) -> Array:
        """Return the energy of each chain."""
        return chain_energies(self._line, self._bond, starts)

    def bounds(self, largest_energy: float) -> EndBounds:
        """Return what proves ends of chains of this energy at most."""
        top = math.ceil(math.log(1.1 * largest_energy / self._bond.stiffness) / ENERGY_LADDER)
        if top not in self._bounds:
            self._bounds[top] = _end_bounds(self._line, self._bond, self._stiffness, top)
        return self._bounds[top]

    def run(self, starts: StartStates, step: float, known: ManyOutcomes | None) -> ManyOutcomes:
        """
        Carry collisions to their ends.

        Parameters
        ----------
        starts : StartStates
            Where they begin.
        step : float
            H.
        known : ManyOutcomes or None
            The same collisions with other steps, to be compared with these: their ends are not
            looked for again.

        Returns
        -------
        ManyOutcomes
            As far as they were settled.
        """
        group = _Group(self, starts, step)
        if known is None:
            group.follow()
        else:
            group.compare(known.last_contact_times)
        return group.outcomes(known)


class _Group:
    """Collisions in progress."""

    def __init__(self, of: ManyCollisions, starts: StartStates, step: float) -> None:
        self._of, self._line, self._bond = of, of._line, of._bond
        count, n = starts.strains.shape
        self.step = step
        self.strains = starts.strains.copy()
        self.velocities = np.concatenate((np.zeros((count, 1)), starts.velocities), axis=1)
        self.lasts, self.last_velocities = self.strains.copy(), self.velocities.copy()
        self.contacts = np.zeros((count, 3, _LISTED))
        self.counts = np.zeros(count, np.int64)
        self.firsts = np.zeros(count)
        self.energies = of.energies(starts)
        self._bounds = of.bounds(float(np.max(self.energies)))
        # Where bonds may break, energy proves little, and pieces have to be looked at.
        self._may_break = self.energies >= breaking_energy(of._bond)
        self.statuses = np.full(count, MOVING)
        self.argued = np.zeros(count, bool)
        self.ledgers = self._ledgers(count)
        reach = of._scheme.reach
        end = min(n, reach + 1)
        self._scratch = (
            (np.empty(n - 1), np.empty(n)),
            (np.empty(end - 1), np.empty(end)),
            (np.empty(n - 1), np.empty(n)),
            self._line.chain_masses.copy(),
            np.array([0, end]),
            np.empty((2, 0)),
        )
        self._lanes = Lanes.of(self._line.inverse_masses).unnamed()
        self.untils = np.zeros(count)

    def _ledgers(self, count: int) -> NDArray:
        ledgers = np.zeros(count, motion.LEDGER)
        ledgers["shortest_share"] = 1.0
        ledgers["active"] = self.strains.shape[1] - 1
        ledgers["patience"] = ledgers["argue_first"] = ledgers["argue_after"] = np.inf
        ledgers["contact_mass"] = self._line.contact_mass
        ledgers["strain_floor"], ledgers["strain_ceiling"] = allowed_strains(self._bond)
        bonds = self.strains[:, 1:]
        ledgers["strain_min"] = np.minimum(np.min(bonds, axis=1, initial=0.0), 0.0)
        ledgers["strain_max"] = np.maximum(np.max(bonds, axis=1, initial=0.0), 0.0)
        ledgers["contact_min"], ledgers["contact_max"] = (
            ledgers["strain_min"],
            ledgers["strain_max"],
        )
        ledgers["step_evaluations"] = self._of._scheme.evaluations
        return ledgers

    def _carry(self) -> None:
        of = self._of
        states = (
            *(self.strains, self.velocities, self.lasts, self.last_velocities),
            *(self.contacts, self.counts, self.firsts, self.energies),
            *(self.untils, self.statuses),
        )
        of._kernels.carry(
            self.ledgers,
            states,
            self._scratch,
            self._lanes,
            self.step,
            tuple(of._scheme.fractions),
            of._parameters,
            self._bounds,
            of.stopped,
        )
        if of.stopped[0]:
            raise RunError("the collisions were stopped")

    @property
    def _now(self) -> Array:
        return self.ledgers["steps"] * self.step

    @property
    def _number(self) -> NDArray[np.int64]:
        return self.counts + self.ledgers["contacts"]

    def _arrival(self) -> Array:
        """Return when the mean displacement would be at the wall."""
        masses = self._line.chain_masses / float(np.sum(self._line.chain_masses))
        distance = each_sum(np.cumsum(self.strains, axis=1) * masses)
        return np.maximum(distance, 0.0) / -each_sum(self.velocities[:, 1:] * masses)

    def compare(self, lasts: Array) -> None:
        """Carry all until a while after known last contacts, which are from the first."""
        margin = KNOWN_MARGIN / self._of._stiffness**0.5
        self.untils = self._now + margin
        while np.any(self.statuses == MOVING):
            self._carry()
            due = self.statuses == DUE
            until = np.where(self._number > 0, self.firsts + lasts, self._now) + margin
            again = due & (self._now < until)
            self.untils[again] = until[again]
            self.statuses[again] = MOVING

    def follow(self) -> None:
        """Carry all until their ends."""
        watches: dict[int, EndWatch] = {}
        n, stiffness = self._of.particles, self._of._stiffness
        interval = 2.0 / stiffness**0.5
        # Before the contact, which comes as the mean comes nearer, nothing is looked for.
        approach = 1.5 * self._arrival()
        self.untils = interval + approach
        while np.any(self.statuses == MOVING):
            self._carry()
            for s in np.flatnonzero(self.statuses == DUE).tolist():
                now, last = float(self._now[s]), float(self.ledgers["last_contact"][s])
                if self._number[s] == 0:
                    self.untils[s] = now + interval + approach[s]
                    self.statuses[s] = MOVING
                    continue
                watch = watches.setdefault(s, EndWatch(n, self._bond, stiffness))
                longest = watch.followed_until(last)
                if not self._may_break[s]:
                    # Energy alone will prove the end, or there is none.
                    if now < longest:
                        self.untils[s] = longest + interval
                        self.statuses[s] = MOVING
                    continue
                line = self._line
                bodies = bodies_of(line, self._bond, self.strains[s], self.velocities[s])
                ending = watch.look_at(now, last, bodies)
                if ending is not None:
                    proved = ending.kind == "proved"
                    sure = ending.kind == "argued" and ending.momentum_at_stake == 0.0
                    self.statuses[s] = PROVED if proved or sure else DUE
                    self.argued[s] = sure
                elif now <= longest:
                    self.untils[s] = max(watch.next_look(now, last), now + interval)
                    self.statuses[s] = MOVING

    def outcomes(self, known: ManyOutcomes | None) -> ManyOutcomes:
        """Return what came of them."""
        masses = self._line.chain_masses
        whole = float(np.sum(masses))
        settled = self.statuses == (PROVED if known is None else DUE)
        if known is not None:
            # An end that is proved before what was known of is no less an end.
            settled |= self.statuses == PROVED
        with np.errstate(all="ignore"):
            ends = StartStates(self.lasts, self.last_velocities[:, 1:])
            grown = self._of.energies(ends) <= MOST_ENERGY_GROWTH * self.energies
        return ManyOutcomes(
            settled=settled & grown,
            endless=(self.statuses == DUE) if known is None else known.endless,
            proved=~self.argued if known is None else known.proved,
            speeds=each_sum(self.last_velocities[:, 1:] * masses) / whole,
            contacts=self._number,
            last_contact_times=self.ledgers["last_contact"] - self.firsts,
            silent=self._silent(),
            bond_min=1.0 + self.ledgers["contact_min"],
            bond_max=1.0 + self.ledgers["contact_max"],
        )

    def _silent(self) -> NDArray[np.bool_]:
        times, listed = self.contacts[:, 0], self.ledgers["contacts"]
        between = np.arange(1, _LISTED) < listed[:, None]
        longest = np.max(np.where(between, np.diff(times, axis=1), 0.0), axis=1)
        # Of more contacts than are listed nothing is known.
        quiet = quiet_time(self._of.particles, self._of._stiffness)
        return (longest > quiet) | (self.counts > 0)


def _end_bounds(line: Line, bond: Potential, stiffness: float, top: int) -> EndBounds:
    masses = line.chain_masses
    lever = Lever.of(masses)
    count = math.ceil(-math.log(_LEAST_ENERGY) / ENERGY_LADDER)
    rungs = np.arange(top - count, top + 1)
    energies = bond.stiffness * np.exp(rungs * ENERGY_LADDER)
    reaches = np.array([reach(bond, float(energy), lever) for energy in energies])
    return EndBounds(
        masses=masses,
        lever=lever.whole * lever.mass / lever.rest if lever.rest > 0.0 else 0.0,
        log_least=math.log(float(energies[0])),
        log_rung=ENERGY_LADDER,
        reaches=reaches,
        interval=1.0 / stiffness**0.5,
    )
