"""Carries out a batch: many collisions of one chain with a hard wall, each with its own step."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import EndWatch, longest_collision
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.in_house import bookkeeping
from chaincor.workflows.engines.in_house.batch.chains import Chains
from chaincor.workflows.engines.in_house.batch.compiled import carry_for, look_ahead_for
from chaincor.workflows.engines.in_house.batch.end_bounds import EndBounds
from chaincor.workflows.engines.in_house.batch.lanes import LANES
from chaincor.workflows.engines.in_house.batch.progress import (
    ENDLESS,
    MOVING,
    PROVED,
    Places,
)
from chaincor.workflows.engines.in_house.batch.states import (
    ManyRuns,
    StartStates,
)
from chaincor.workflows.engines.in_house.coarse_run import (
    coarse_ceiling,
    coarse_step,
    required_clearance,
)
from chaincor.workflows.engines.in_house.compile import scalar_force
from chaincor.workflows.engines.in_house.finish import KNOWN_MARGIN
from chaincor.workflows.engines.in_house.line_kinds import Kind
from chaincor.workflows.engines.in_house.moving import Stepper
from chaincor.workflows.engines.in_house.stepping import follow_on
from chaincor.workflows.engines.interrupts import WORK_AT_ONCE, steps_at_once
from chaincor.workflows.engines.piece_bounds import breaking_energy
from chaincor.workflows.engines.schemes import STEP_SCHEMES, Rule
from chaincor.workflows.engines.whole_end import certain_at, next_look
from chaincor.workflows.errors import RunError

# Longer chains fill the vector units by themselves: decides costs only.
LONGEST_IN_LANES = 128
# Collisions of n particles take about so many crossings.
_USUAL_CROSSINGS = 5.0


def serves(line: Line, bond: Potential) -> bool:
    """Return whether collisions are of a kind that is carried here: a hard, rigid wall."""
    compiled = scalar_force(bond) is not None and len(line.chain_masses) > 1
    return line.at_wall and line.first == 1 and bond.smooth and compiled


class Batch:
    """
    Collisions of one chain with a hard wall, which differ in initial state and step.

    Parameters
    ----------
    line : Line
        One of them, which :func:`serves` takes, for what all share: masses, and whether they come
        cold.
    bond : Potential
        The bonds.
    scheme : str
        Of ``schemes``.

    Attributes
    ----------
    stopped : bool
        Set by another thread to leave the loop.
    """

    def __init__(self, line: Line, bond: Potential, scheme: str) -> None:
        self._line, self._bond = line, bond
        self._scheme = STEP_SCHEMES[scheme]
        self._stepper = Stepper.of(line, bond, scheme, math.nan)
        self._kind = Kind.of(line)
        n = self.particles = len(line.chain_masses)
        self._stiffness = bond.stiffness / line.mean_mass
        self._most = steps_at_once(self._scheme.evaluations * n)
        # Only in lanes are ends proved within the loop, of any chain but a plain one.
        self._in_lanes = n <= LONGEST_IN_LANES or not line.plain
        if self._in_lanes:
            self._carry_lanes = carry_for(bond, self._scheme, self._kind)
        parameters = self._stepper.parameters
        bond_parameters = parameters if self._kind.unit else parameters[0]
        self._rule = Rule(self._scheme.fractions, bond_parameters)
        self._bounds: dict[int, EndBounds] = {}
        self.stopped = False

    def share(self, step: float) -> int:
        """Return how many collisions to carry at once, so that progress is seen."""
        n = self.particles
        duration = _USUAL_CROSSINGS * 2.0 * (n + 10.0) / self._stiffness**0.5
        work = duration / step * self._scheme.evaluations * n
        # Towards the end lanes are empty: not too few.
        return int(min(max(WORK_AT_ONCE / work, 4 * LANES), 1024))

    def follow(self, starts: StartStates, steps: Array) -> ManyRuns:
        """
        Carry collisions to their ends, as far as energy proves these, or pieces that part.

        Parameters
        ----------
        starts : StartStates
            Where they begin.
        steps : ndarray of shape (runs,)
            H of each.

        Returns
        -------
        ManyRuns
            As far as they were settled. What comes of one does not depend on the others.

        Raises
        ------
        RunError
            If it was stopped.
        """
        group = Chains(self._line, self._bond, self._stepper, starts, steps)
        started = time.perf_counter()
        n, bond, interval = self.particles, self._bond, 1.0 / self._stiffness**0.5
        bounds = self._bounds_of(float(np.max(group.rows.energies)))
        # Before the contact, which comes as the mean comes nearer, nothing is looked for.
        approach = 1.5 * group.arrival() + 2.0 * interval
        group.follow_until(approach)
        watches: dict[int, EndWatch] = {}
        # Where bonds may break, energy proves little, and pieces have to be looked at.
        may_break = group.rows.energies >= breaking_energy(bond)
        while np.any(group.rows.statuses == MOVING):
            self._carry(group, bounds)
            times = group.times()
            for s in np.flatnonzero(group.rows.statuses == PROVED).tolist():
                group.end(
                    s, Ending("proved"), float(times[s] - group.rows.ledgers["first_contact"][s])
                )
            for s in np.flatnonzero(group.rows.statuses == bookkeeping.DONE).tolist():
                ledger = group.rows.ledgers[s]
                now, last = float(times[s]), float(ledger["last_contact"])
                if ledger["contacts"] == 0:
                    group.follow_on(s, now + float(approach[s]))
                    continue
                watch = watches.setdefault(s, EndWatch(n, bond, self._stiffness))
                longest = watch.followed_until(last)
                group.rows.statuses[s] = ENDLESS
                if not may_break[s]:
                    # Energy alone will prove the end, or there is none.
                    if now < longest:
                        group.follow_on(s, longest + 2.0 * interval)
                    continue
                ending = watch.look_at(now, last, group.chain(s).bodies(bond))
                if ending is None:
                    if now <= longest:
                        later = max(watch.next_look(now, last), now + 2.0 * interval)
                        group.follow_on(s, later)
                elif ending.kind == "proved" or (
                    ending.kind == "argued" and ending.momentum_at_stake == 0.0
                ):
                    group.end(s, ending, now - float(ledger["first_contact"]))
        return group.outcomes(time.perf_counter() - started)

    def follow_cold(self, scenes: Sequence[Scene], steps: Array) -> ManyRuns:
        """Carry collisions of plain chains to the ends that they have alone."""
        group = self._cold(scenes, steps)
        started = time.perf_counter()
        n, stiffness, ledgers = self.particles, self._bond.stiffness, group.rows.ledgers
        group.rows.goals[:] = np.ceil(longest_collision(n, stiffness, 0.0) / steps) + 1
        while np.any(group.rows.statuses == MOVING):
            self._carry(group, EndBounds.none())
            argued = np.flatnonzero(group.rows.statuses == bookkeeping.ARGUE)
            seen, times = self._keep_off(scenes, group, argued), group.times()
            for place, s in enumerate(argued.tolist()):
                ends = seen[place]
                if ends is None:
                    group.rows.statuses[s] = bookkeeping.DONE
                    group.endings[s] = self._follow_alone(scenes[s], group, s)
                elif ends.off:
                    group.end(s, Ending("proved"), ends.time)
                else:
                    now, last = float(times[s]), ledgers["last_contact"][s]
                    later = next_look(now, float(last), ends.time)
                    ledgers["argue_after"][s] = later - float(last)
                    longest = longest_collision(n, stiffness, float(last))
                    group.rows.goals[s] = math.ceil(longest / steps[s]) + 1
                    group.rows.statuses[s] = MOVING
        return group.outcomes(time.perf_counter() - started)

    def compare(self, starts: StartStates, steps: Array, lasts: Array) -> ManyRuns:
        """Carry collisions a little beyond their last contacts, known since the first ones."""
        return self._compare(Chains(self._line, self._bond, self._stepper, starts, steps), lasts)

    def compare_cold(self, scenes: Sequence[Scene], steps: Array, lasts: Array) -> ManyRuns:
        """Do the same with plain chains."""
        return self._compare(self._cold(scenes, steps), lasts)

    def _cold(self, scenes: Sequence[Scene], steps: Array) -> Chains:
        speeds = np.array([scene.impact_velocity for scene in scenes])
        starts = StartStates.cold(speeds, self.particles)
        return Chains(self._line, self._bond, self._stepper, starts, steps, speeds)

    def _compare(self, group: Chains, lasts: Array) -> ManyRuns:
        started = time.perf_counter()
        ledgers, margin = group.rows.ledgers, KNOWN_MARGIN / self._stiffness**0.5
        for name in ("argue_after", "argue_first", "patience"):
            ledgers[name] = np.inf
        while np.any(group.rows.statuses == MOVING):
            met = ledgers["contacts"] > 0
            untils = np.where(met, ledgers["first_contact"] + lasts, group.times()) + margin
            group.rows.goals[:] = np.ceil(untils / group.rows.steps) + 1
            self._carry(group, EndBounds.none())
            # Their time is told from the first contact on.
            group.rows.statuses[(group.rows.statuses == bookkeeping.DONE) & ~met] = MOVING
        group.durations[:] = group.times() - ledgers["first_contact"]
        return group.outcomes(
            time.perf_counter() - started, group.rows.statuses == bookkeeping.DONE
        )

    def _bounds_of(self, largest_energy: float) -> EndBounds:
        """Return what proves ends of chains of this energy at most."""
        top = EndBounds.rung_above(self._bond, largest_energy)
        if top not in self._bounds:
            self._bounds[top] = EndBounds.of(self._line, self._bond, top)
        return self._bounds[top]

    def _follow_alone(self, scene: Scene, group: Chains, s: int) -> Ending | None:
        """Follow a chain that may break to its end; None where it has to be carried out alone."""
        chain = group.chain(s)
        chain.ledger["active"] = self.particles - 1  # as lanes move all bonds
        stepper = self._stepper.of_size(float(group.rows.steps[s]))
        try:
            ending, group.durations[s], evaluations = follow_on(scene, chain, stepper)
        except RunError:
            return None  # it gets its name there
        chain.ledger["evaluations"] = evaluations
        # Otherwise it has more contacts than a row has room for.
        return ending if chain.arrays.contacts.base is group.rows.contacts else None

    def _carry(self, group: Chains, bounds: EndBounds) -> None:
        """Take steps until something needs the caller, or Python has waited for long enough."""
        if self.stopped:
            raise RunError("the collisions were stopped")
        if self._in_lanes:
            places = Places.of(len(group.rows.steps))
            carried = group.rows, group.lanes, group.near, self._rule, bounds, places
            self._carry_lanes(*carried, self._most)
            group.make_room()
            return
        for s in np.flatnonzero(group.rows.statuses == MOVING).tolist():
            step, goal = float(group.rows.steps[s]), int(group.rows.goals[s])
            group.rows.statuses[s] = group.chain(s).advance(self._stepper.of_size(step), goal)

    def _keep_off(
        self, scenes: Sequence[Scene], group: Chains, argued: NDArray[np.int64]
    ) -> list["_Seen | None"]:
        """Look ahead, as ``LookAhead.keeps_off`` does for one."""
        bond, ledgers, times = self._bond, group.rows.ledgers, group.times()
        seen: list[_Seen | None] = []
        ahead: list[tuple[int, int, float, float, float, float]] = []
        for place, s in enumerate(argued.tolist()):
            ledger = ledgers[s]
            now, last = float(times[s]), float(ledger["last_contact"])
            distance = float(ledger["position"])
            speed, momentum = float(ledger["impact_velocity"]), float(ledger["momentum"])
            strains = group.rows.strains[s]
            certain = certain_at(bond, speed, momentum, distance, strains, now, last)
            if certain == math.inf:
                seen.append(None)
                continue
            seen.append(_Seen(certain <= now, now))
            clearance = required_clearance(scenes[s], distance)
            if certain > now and clearance is not None:
                coarse = coarse_step(bond, float(ledger["strain_min"]))
                ahead.append((place, s, now, certain, coarse, clearance))
        if ahead:
            self._look_ahead(group, ahead, seen)
        return seen

    def _look_ahead(
        self,
        group: Chains,
        ahead: list[tuple[int, int, float, float, float, float]],
        seen: list["_Seen | None"],
    ) -> None:
        places, chains, now, certain, steps, clearances = zip(*ahead, strict=True)
        rows = np.array(chains)
        told = group.rows.ledgers, group.rows.strains, group.rows.velocities
        ledgers, strains, velocities = (each[rows] for each in told)
        ledgers["strain_ceiling"] = coarse_ceiling(self._bond)
        ledgers["strain_max"] = np.max(strains, axis=1)
        spans = zip(now, certain, steps, strict=True)
        counts = np.array([max(1, math.ceil((till - since) / step)) for since, till, step in spans])
        done = np.zeros(len(rows), np.int64)
        look_ahead_for(self._bond)(
            *(ledgers, strains, velocities, counts, np.array(steps), np.array(clearances)),
            *(done, self._stepper.parameters),
        )
        whole, ends = (done == counts).tolist(), (np.array(now) + done * np.array(steps)).tolist()
        for place, off, end in zip(places, whole, ends, strict=True):
            seen[place] = _Seen(off, end)
        group.rows.ledgers["evaluations"][rows] = ledgers["evaluations"]


@dataclass(frozen=True)
class _Seen:
    """Whether a chain keeps off the wall, and when that was seen, or until when nothing is."""

    off: bool
    time: float
