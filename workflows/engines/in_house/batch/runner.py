"""Carries out a batch: many collisions of one chain with a hard wall, each with its own step."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import EndWatch, longest_collision
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.batch.compiled import carry_for, look_ahead_for
from chaincor.workflows.engines.in_house.batch.end_bounds import EndBounds
from chaincor.workflows.engines.in_house.batch.lanes import LANES, Lanes
from chaincor.workflows.engines.in_house.batch.progress import (
    ENDED,
    ENDLESS,
    MOVING,
    PROVED,
    Room,
)
from chaincor.workflows.engines.in_house.batch.states import (
    ManyRuns,
    StartStates,
    chain_energies,
    each_sum,
)
from chaincor.workflows.engines.in_house.coarse_run import (
    coarse_ceiling,
    coarse_step,
    required_clearance,
)
from chaincor.workflows.engines.in_house.compile import scalar_force
from chaincor.workflows.engines.in_house.finish import KNOWN_MARGIN
from chaincor.workflows.engines.in_house.line_kinds import Kind
from chaincor.workflows.engines.in_house.moving import Motion, Stepper
from chaincor.workflows.engines.in_house.stages import State
from chaincor.workflows.engines.in_house.stepping import follow_on
from chaincor.workflows.engines.interrupts import WORK_AT_ONCE, steps_at_once
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH
from chaincor.workflows.engines.piece_bounds import breaking_energy
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.engines.whole_end import certain_at, next_look
from chaincor.workflows.errors import RunError

Array = NDArray[np.float64]

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
        self._bond_parameters = parameters if self._kind.unit else parameters[0]
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
        group = _Group(self._line, self._bond, self._stepper, starts, steps)
        started = time.perf_counter()
        n, bond, interval = self.particles, self._bond, 1.0 / self._stiffness**0.5
        bounds = self._bounds_of(float(np.max(group.energies)))
        # Before the contact, which comes as the mean comes nearer, nothing is looked for.
        approach = 1.5 * group.arrival() + 2.0 * interval
        group.follow_until(approach)
        watches: dict[int, EndWatch] = {}
        # Where bonds may break, energy proves little, and pieces have to be looked at.
        may_break = group.energies >= breaking_energy(bond)
        while np.any(group.statuses == MOVING):
            self._carry(group, bounds)
            times = group.times()
            for s in np.flatnonzero(group.statuses == PROVED).tolist():
                group.end(s, Ending("proved"), float(times[s] - group.ledgers["first_contact"][s]))
            for s in np.flatnonzero(group.statuses == motion.DONE).tolist():
                ledger = group.ledgers[s]
                now, last = float(times[s]), float(ledger["last_contact"])
                if ledger["contacts"] == 0:
                    group.follow_on(s, now + float(approach[s]))
                    continue
                watch = watches.setdefault(s, EndWatch(n, bond, self._stiffness))
                longest = watch.followed_until(last)
                group.statuses[s] = ENDLESS
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
        n, stiffness, ledgers = self.particles, self._bond.stiffness, group.ledgers
        group.goals[:] = np.ceil(longest_collision(n, stiffness, 0.0) / steps) + 1
        while np.any(group.statuses == MOVING):
            self._carry(group, EndBounds.none())
            argued = np.flatnonzero(group.statuses == motion.ARGUE)
            seen, times = self._keep_off(scenes, group, argued), group.times()
            for place, s in enumerate(argued.tolist()):
                ends = seen[place]
                if ends is None:
                    group.statuses[s] = motion.DONE
                    group.endings[s] = self._follow_alone(scenes[s], group, s)
                elif ends.off:
                    group.end(s, Ending("proved"), ends.time)
                else:
                    now, last = float(times[s]), ledgers["last_contact"][s]
                    later = next_look(now, float(last), ends.time)
                    ledgers["argue_after"][s] = later - float(last)
                    longest = longest_collision(n, stiffness, float(last))
                    group.goals[s] = math.ceil(longest / steps[s]) + 1
                    group.statuses[s] = MOVING
        return group.outcomes(time.perf_counter() - started)

    def compare(self, starts: StartStates, steps: Array, lasts: Array) -> ManyRuns:
        """Carry collisions a little beyond their last contacts, known since the first ones."""
        return self._compare(_Group(self._line, self._bond, self._stepper, starts, steps), lasts)

    def compare_cold(self, scenes: Sequence[Scene], steps: Array, lasts: Array) -> ManyRuns:
        """Do the same with plain chains."""
        return self._compare(self._cold(scenes, steps), lasts)

    def _cold(self, scenes: Sequence[Scene], steps: Array) -> "_Group":
        speeds = np.array([scene.impact_velocity for scene in scenes])
        starts = StartStates.cold(speeds, self.particles)
        return _Group(self._line, self._bond, self._stepper, starts, steps, speeds)

    def _compare(self, group: "_Group", lasts: Array) -> ManyRuns:
        started = time.perf_counter()
        ledgers, margin = group.ledgers, KNOWN_MARGIN / self._stiffness**0.5
        for name in ("argue_after", "argue_first", "patience"):
            ledgers[name] = np.inf
        while np.any(group.statuses == MOVING):
            met = ledgers["contacts"] > 0
            untils = np.where(met, ledgers["first_contact"] + lasts, group.times()) + margin
            group.goals[:] = np.ceil(untils / group.steps) + 1
            self._carry(group, EndBounds.none())
            # Their time is told from the first contact on.
            group.statuses[(group.statuses == motion.DONE) & ~met] = MOVING
        group.durations[:] = group.times() - ledgers["first_contact"]
        return group.outcomes(time.perf_counter() - started, group.statuses == motion.DONE)

    def _bounds_of(self, largest_energy: float) -> EndBounds:
        """Return what proves ends of chains of this energy at most."""
        top = EndBounds.rung_above(self._bond, largest_energy)
        if top not in self._bounds:
            self._bounds[top] = EndBounds.of(self._line, self._bond, top)
        return self._bounds[top]

    def _follow_alone(self, scene: Scene, group: "_Group", s: int) -> Ending | None:
        """Follow a chain that may break to its end; None where it has to be carried out alone."""
        chain = group.chain(s)
        chain.ledger["active"] = self.particles - 1  # as lanes move all bonds
        stepper = self._stepper.of_size(float(group.steps[s]))
        try:
            ending, group.durations[s], evaluations = follow_on(scene, chain, stepper)
        except RunError:
            return None  # it gets its name there
        chain.ledger["evaluations"] = evaluations
        # Otherwise it has more contacts than a row has room for.
        return ending if chain.arrays.contacts.base is group.states[4] else None

    def _carry(self, group: "_Group", bounds: EndBounds) -> None:
        """Take steps until something needs the caller, or Python has waited for long enough."""
        if self.stopped:
            raise RunError("the collisions were stopped")
        if self._in_lanes:
            self._carry_lanes(
                *(group.ledgers, group.states, group.near, group.lanes, group.steps),
                *(group.goals, group.statuses, self._most, tuple(self._scheme.fractions)),
                *(self._bond_parameters, bounds, Room.of(len(group.steps))),
            )
            group.make_room()
            return
        for s in np.flatnonzero(group.statuses == MOVING).tolist():
            step, goal = float(group.steps[s]), int(group.goals[s])
            group.statuses[s] = group.chain(s).advance(self._stepper.of_size(step), goal)

    def _keep_off(
        self, scenes: Sequence[Scene], group: "_Group", argued: NDArray[np.int64]
    ) -> list["_Seen | None"]:
        """Look ahead, as ``LookAhead.keeps_off`` does for one."""
        bond, ledgers, times = self._bond, group.ledgers, group.times()
        seen: list[_Seen | None] = []
        ahead: list[tuple[int, int, float, float, float, float]] = []
        for place, s in enumerate(argued.tolist()):
            ledger = ledgers[s]
            now, last = float(times[s]), float(ledger["last_contact"])
            distance = float(ledger["position"])
            speed, momentum = float(ledger["impact_velocity"]), float(ledger["momentum"])
            strains = group.states[0][s]
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
        group: "_Group",
        ahead: list[tuple[int, int, float, float, float, float]],
        seen: list["_Seen | None"],
    ) -> None:
        places, chains, now, certain, steps, clearances = zip(*ahead, strict=True)
        rows = np.array(chains)
        ledgers, strains, velocities = group.ledgers[rows], *(a[rows] for a in group.states[:2])
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
        group.ledgers["evaluations"][rows] = ledgers["evaluations"]


@dataclass(frozen=True)
class _Seen:
    """Whether a chain keeps off the wall, and when that was seen, or until when nothing is."""

    off: bool
    time: float


class _Group:
    """Chains in motion: as ``Motion``, with a row for each."""

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
        self.steps = np.asarray(steps, dtype=float)
        self.energies = chain_energies(line, bond, starts)
        masses = line.chain_masses
        self._shares = masses / float(np.sum(masses))
        approach = -each_sum(starts.velocities * self._shares) if speeds is None else speeds
        first = Motion.in_state(line, bond, stepper.scheme, line.strains, line.velocities, 0.0)
        first.start_front()
        self._first = first
        self.ledgers = np.repeat(np.array([first.ledger], first.ledger.dtype), count)
        self.ledgers = self.ledgers.view(np.recarray)
        ledgers, strain, velocity = self.ledgers, starts.strains[:, 1:], starts.velocities.copy()
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
        # Its own: several threads carry groups of one batch.
        inverse = 1.0 / masses
        self.lanes = Lanes.of(inverse).unnamed()
        self.near = Lanes.of(inverse[: stepper.scheme.reach + 1]).unnamed()
        strain = strain.copy()
        self.states = strain, velocity, strain.copy(), velocity.copy(), contacts, self.energies
        self.goals = np.zeros(count, np.int64)
        self.statuses = np.full(count, MOVING)
        self.durations = np.zeros(count)
        self.endings = np.full(count, None)

    def times(self) -> Array:
        """Return how long each has moved, since its start."""
        return np.asarray(self.ledgers["steps"] * self.steps)

    def arrival(self) -> Array:
        """Return when the mean displacements would be at the wall."""
        zeros = np.zeros((len(self.steps), 1))
        along = np.cumsum(np.concatenate((zeros, self.states[0]), axis=1), axis=1)
        distance = self.ledgers["position"] + each_sum(along * self._shares)
        return np.asarray(np.maximum(distance, 0.0) / self.ledgers["impact_velocity"])

    def follow_until(self, times: Array) -> None:
        """Move all until times since their starts."""
        self.goals[:] = np.ceil(times / self.steps)

    def follow_on(self, s: int, until: float) -> None:
        """Move one of them on, by a step at least."""
        self.goals[s] = max(int(self.ledgers["steps"][s]) + 1, math.ceil(until / self.steps[s]))
        self.statuses[s] = MOVING

    def end(self, s: int, ending: Ending, time: float) -> None:
        """Note how one of them ended, and when that was seen, since its first contact."""
        self.endings[s], self.durations[s], self.statuses[s] = ending, time, ENDED

    def make_room(self) -> None:
        """Double the room for contacts where it does not suffice."""
        full = self.statuses == motion.FULL
        if np.any(full):
            contacts = self.states[4]
            more = np.concatenate((contacts, np.zeros_like(contacts)), axis=2)
            self.states = *self.states[:4], more, self.energies
            self.statuses[full] = MOVING

    def chain(self, s: int) -> Motion:
        """Return one of them, to be changed in place."""
        strains, velocities, last_strains, last_velocities, contacts, _ = self.states
        arrays = self._first.arrays._replace(
            now=State(strains[s], velocities[s]),
            last=State(last_strains[s], last_velocities[s]),
            contacts=contacts[s],
        )
        return Motion(self._line, self.ledgers[s], arrays)

    def outcomes(self, seconds: float, done: NDArray[np.bool_] | None = None) -> ManyRuns:
        """Return what came of them, where ends were seen or runs are `done`."""
        ledgers, bond = self.ledgers, self._bond
        _, _, strains, velocities, contacts, _ = self.states
        if done is None:
            done = np.array([ending is not None for ending in self.endings], bool)
        with np.errstate(all="ignore"):
            energies = np.sum(np.asarray(bond.energy(strains)), axis=1)
            whole = energies + 0.5 * each_sum(velocities**2 * self._line.chain_masses)
            bounded = whole <= MOST_ENERGY_GROWTH * self.energies
        contacts[:, 0] -= ledgers["first_contact"][:, None]
        return ManyRuns(
            settled=done & bounded,
            endless=self.statuses == ENDLESS,
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
