"""Runs of many cold chains of one kind before a wall, which differ in speed and step."""

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import longest_collision
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.finish import KNOWN_MARGIN
from chaincor.workflows.engines.in_house.lines.many_states import Rows
from chaincor.workflows.engines.in_house.motion_coast import coarse_ceiling
from chaincor.workflows.engines.in_house.moving import Motion, Stepper
from chaincor.workflows.engines.in_house.side_by_side.compiled import carry_for, coasts_for
from chaincor.workflows.engines.in_house.side_by_side.lanes import Lanes
from chaincor.workflows.engines.in_house.side_by_side.trips import MOVING, Room
from chaincor.workflows.engines.in_house.stages import State
from chaincor.workflows.engines.in_house.stepping import follow_on
from chaincor.workflows.engines.interrupts import steps_at_once
from chaincor.workflows.engines.look_ahead import coarse_step, required_clearance
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.engines.whole_end import certain_at, next_look
from chaincor.workflows.errors import RunError

Array = NDArray[np.float64]

# Longer chains fill the vector units by themselves: decides costs only.
LONGEST_IN_LANES = 128


@dataclass(frozen=True)
class ManyRuns(Rows):
    """
    What came of many runs.

    Attributes
    ----------
    settled : ndarray of shape (runs,)
        Whether a run was carried to an end; nothing else counts where it was not.
    endings : ndarray of shape (runs,)
        How it ended, where that was looked for.
    durations : ndarray of shape (runs,)
        Simulated time from the first contact to the end.
    evaluations : ndarray of shape (runs,)
        Of all bond forces.
    strains, velocities : ndarray of shape (runs, n - 1) and (runs, n)
        Right after the last contact.
    contacts : ndarray of shape (runs, 2, capacity)
        Times and incoming speeds.
    counts : ndarray of shape (runs,)
        How many contacts there were.
    bond_min, bond_max : ndarray of shape (runs,)
        Shortest and longest bond up to the last contact.
    energies : ndarray of shape (runs,)
        Of the bonds right after the last contact, in rows.
    seconds : ndarray of shape (runs,)
        Wall-clock time of the integration of each: that of all, in equal parts.
    """

    settled: NDArray[np.bool_]
    endings: NDArray[np.object_]
    durations: Array
    evaluations: NDArray[np.int64]
    strains: Array
    velocities: Array
    contacts: Array
    counts: NDArray[np.int64]
    bond_min: Array
    bond_max: Array
    energies: Array
    seconds: Array

    @property
    def displacements(self) -> Array:
        """The same as ``strains``, u_i = x_i - (i - 1), of shape (runs, n)."""
        zeros = np.zeros((len(self.strains), 1))
        return np.cumsum(np.concatenate((zeros, self.strains), axis=1), axis=1)

    @property
    def listed(self) -> NDArray[np.bool_]:
        """Which places of `contacts` hold one, of shape (runs, capacity)."""
        return np.arange(self.contacts.shape[2]) < self.counts[:, None]

    @property
    def last_contact_times(self) -> Array:
        """When particle 1 left the wall."""
        return self.contacts[np.arange(len(self.counts)), 0, self.counts - 1]


class ChainRunner:
    """
    Carries out runs that differ in speed and step.

    Parameters
    ----------
    scene : Scene
        One of the collisions: a cold chain of unit masses before a hard wall, of two particles at
        least, with bonds whose force compiles; chain and bonds are those of all.
    scheme : str
        Of ``schemes``.
    """

    def __init__(self, scene: Scene, scheme: str) -> None:
        self._scene, self._bond = scene, scene.bond
        self._scheme = STEP_SCHEMES[scheme]
        self._stepper = Stepper.of(scene.line, self._bond, scheme, math.nan)
        n = self._particles = scene.particles
        self._coasts = coasts_for(self._bond)
        self._most = steps_at_once(self._scheme.evaluations * n)
        self._in_lanes = n <= LONGEST_IN_LANES
        if self._in_lanes:
            self._carry_lanes = carry_for(self._bond, self._scheme)
            self._lanes = Lanes.of(n).unnamed()
            self._near = Lanes.of(min(n, self._scheme.reach + 1)).unnamed()

    def follow(self, scenes: list[Scene], steps: Array) -> ManyRuns:
        """Carry collisions to their ends; side by side as far as energy alone proves these."""
        group = _Group(self._started(scenes), steps)
        started = time.perf_counter()
        n, stiffness, ledgers = self._particles, self._bond.stiffness, group.ledgers
        group.goals[:] = np.ceil(longest_collision(n, stiffness, 0.0) / steps) + 1
        while np.any(group.statuses == MOVING):
            self._carry(group)
            argued = np.flatnonzero(group.statuses == motion.ARGUE)
            seen = self._keep_off(scenes, group, argued)
            for place, s in enumerate(argued.tolist()):
                ends = seen[place]
                if ends is None:
                    group.statuses[s] = motion.DONE
                    group.endings[s] = self._follow_on(scenes[s], group, s)
                elif ends.off:
                    group.statuses[s] = motion.DONE
                    group.endings[s] = Ending("proved")
                    group.durations[s] = ends.time
                else:
                    now, last = float(ledgers["steps"][s] * steps[s]), ledgers["last_contact"][s]
                    later = next_look(now, float(last), ends.time)
                    ledgers["argue_after"][s] = later - float(last)
                    longest = longest_collision(n, stiffness, float(last))
                    group.goals[s] = math.ceil(longest / steps[s]) + 1
                    group.statuses[s] = MOVING
        ended = np.array([ending is not None for ending in group.endings])
        return self._outcomes(group, ended, time.perf_counter() - started)

    def compare(self, scenes: list[Scene], steps: Array, lasts: Array) -> ManyRuns:
        """Carry collisions a little beyond their last contacts, which are known."""
        group = _Group(self._started(scenes), steps)
        started = time.perf_counter()
        group.ledgers["argue_after"] = group.ledgers["patience"] = np.inf
        untils = lasts + KNOWN_MARGIN / self._bond.stiffness**0.5
        group.goals[:] = np.ceil(untils / steps) + 1
        while np.any(group.statuses == MOVING):
            self._carry(group)
        group.durations[:] = group.ledgers["steps"] * steps
        done = group.statuses == motion.DONE
        return self._outcomes(group, done, time.perf_counter() - started)

    def _follow_on(self, scene: Scene, group: "_Group", s: int) -> Ending | None:
        """Follow a chain that may break to its end; None where it has to be carried out alone."""
        chain = group.chain(s)
        chain.ledger["active"] = self._particles - 1  # as lanes move all bonds
        stepper = self._stepper.of_size(float(group.steps[s]))
        try:
            ending, group.durations[s], evaluations = follow_on(scene, chain, stepper)
        except RunError:
            return None  # it gets its name there
        chain.ledger["evaluations"] = evaluations
        # Otherwise it has more contacts than a row has room for.
        return ending if chain.arrays.contacts.base is group.states[4] else None

    def _started(self, scenes: list[Scene]) -> tuple[Motion, Array]:
        first = Motion.at_start(self._scene, self._scheme)
        return first, np.array([scene.impact_velocity for scene in scenes])

    def _carry(self, group: "_Group") -> None:
        """Take steps until something needs the caller, or Python has waited for long enough."""
        if self._in_lanes:
            numbers = tuple(self._scheme.fractions), self._stepper.parameters
            assert self._carry_lanes is not None, "its force compiles"
            self._carry_lanes(
                *(group.ledgers, group.states, self._near, self._lanes, group.steps),
                *(group.goals, group.statuses, self._most, *numbers, Room.of(len(group.steps))),
            )
            return
        for s in np.flatnonzero(group.statuses == MOVING).tolist():
            step, goal = float(group.steps[s]), int(group.goals[s])
            group.statuses[s] = group.chain(s).advance(self._stepper.of_size(step), goal)

    def _keep_off(
        self, scenes: list[Scene], group: "_Group", argued: NDArray[np.int64]
    ) -> list["_Seen | None"]:
        """Look ahead, as ``LookAhead.keeps_off`` does for one."""
        bond, ledgers = self._bond, group.ledgers
        seen: list[_Seen | None] = []
        coasting: list[tuple[int, int, float, float, float, float]] = []
        for place, s in enumerate(argued.tolist()):
            ledger = ledgers[s]
            now, last = float(ledger["steps"] * group.steps[s]), float(ledger["last_contact"])
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
                coasting.append((place, s, now, certain, coarse, clearance))
        if coasting:
            self._coast(group, coasting, seen)
        return seen

    def _coast(
        self,
        group: "_Group",
        coasting: list[tuple[int, int, float, float, float, float]],
        seen: list["_Seen | None"],
    ) -> None:
        places, chains, now, certain, steps, clearances = zip(*coasting, strict=True)
        rows = np.array(chains)
        ledgers, strains, velocities = group.ledgers[rows], *(a[rows] for a in group.states[:2])
        ledgers["strain_ceiling"] = coarse_ceiling(self._bond)
        ledgers["strain_max"] = np.max(strains, axis=1)
        spans = zip(now, certain, steps, strict=True)
        counts = np.array([max(1, math.ceil((till - since) / step)) for since, till, step in spans])
        done = np.zeros(len(rows), np.int64)
        assert self._coasts is not None, "its force compiles"
        self._coasts(
            *(ledgers, strains, velocities, counts, np.array(steps), np.array(clearances)),
            *(done, self._stepper.parameters),
        )
        whole, ends = (done == counts).tolist(), (np.array(now) + done * np.array(steps)).tolist()
        for place, off, end in zip(places, whole, ends, strict=True):
            seen[place] = _Seen(off, end)
        group.ledgers["evaluations"][rows] = ledgers["evaluations"]

    def _outcomes(self, group: "_Group", settled: NDArray[np.bool_], seconds: float) -> ManyRuns:
        ledgers = group.ledgers
        _, _, strains, velocities, contacts = group.states
        speeds = ledgers["impact_velocity"]
        with np.errstate(all="ignore"):
            bonds = np.asarray(self._bond.energy(strains))
            energies = np.sum(bonds, axis=1)
            whole = energies + 0.5 * np.sum(velocities**2, axis=1)
            bounded = whole <= MOST_ENERGY_GROWTH * 0.5 * self._particles * speeds**2
        return ManyRuns(
            settled=settled & bounded,
            endings=group.endings,
            durations=group.durations,
            evaluations=ledgers["evaluations"],
            strains=strains,
            velocities=velocities,
            contacts=contacts[:, :2],
            counts=ledgers["contacts"],
            bond_min=1.0 + ledgers["contact_min"],
            bond_max=1.0 + ledgers["contact_max"],
            energies=energies,
            seconds=np.full(len(settled), seconds / len(settled)),
        )


@dataclass(frozen=True)
class _Seen:
    """Whether a chain keeps off the wall, and when that was seen, or until when nothing is."""

    off: bool
    time: float


class _Group:
    """Chains in motion: as ``Motion``, with a row for each."""

    def __init__(self, started: tuple[Motion, Array], steps: Array) -> None:
        first, speeds = started
        count = len(speeds)
        self.steps = np.asarray(steps, dtype=float)
        self.ledgers = np.repeat(np.array([first.ledger], first.ledger.dtype), count)
        self.ledgers = self.ledgers.view(np.recarray)
        self.ledgers["impact_velocity"] = speeds
        n = len(first.velocity)
        self.ledgers["momentum"] = (2 - n) * speeds
        strain = np.zeros((count, n - 1))
        velocity = np.repeat(-speeds[:, None], n, axis=1)
        velocity[:, 0] = speeds
        contacts = np.zeros((count, *first.arrays.contacts.shape))
        contacts[:, 1, 0], contacts[:, 2, 0] = speeds, 2.0 * speeds
        self.states = strain, velocity, strain.copy(), velocity.copy(), contacts
        self._first = first
        self.goals = np.zeros(count, np.int64)
        self.statuses = np.full(count, MOVING)
        self.durations = np.zeros(count)
        self.endings = np.full(count, None)

    def chain(self, s: int) -> Motion:
        """Return one of them, to be changed in place."""
        strains, velocities, last_strains, last_velocities, contacts = self.states
        arrays = self._first.arrays._replace(
            now=State(strains[s], velocities[s]),
            last=State(last_strains[s], last_velocities[s]),
            contacts=contacts[s],
        )
        return Motion(self._first.line, self.ledgers[s], arrays)
