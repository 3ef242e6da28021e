"""
The loop that carries many short chains before a wall side by side, without Python in between.

Each pass moves all lanes (``lanes``), each by a step of its own. A chain that meets the wall in a
step, or may, waits outside until the time of that is found (``hunts``); then it takes a lane that
is free, up to the contact. Everything that decides is what ``motion`` does, in the same order: what
comes of a chain is what comes of it alone, to the last bit.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.contact_search import PathPoint, count_sign_changes
from chaincor.workflows.engines.in_house.lines.lanes import LANES
from chaincor.workflows.engines.in_house.side_by_side.hunts import Hunts, build_hunt
from chaincor.workflows.engines.in_house.side_by_side.lanes import LaneState
from chaincor.workflows.engines.in_house.side_by_side.trips import (
    FREE,
    MEETS,
    MOVING,
    OPEN,
    REPEATED,
    Queue,
    Room,
    Trips,
)

Array = NDArray[np.float64]
Counts = NDArray[np.int64]


def build_carry(force: Callable, leap: Callable, register: Callable) -> Callable:
    """
    Return the loop over chains.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain, ``force(strain, parameters)``.
    leap : callable
        One step of all lanes; see ``lanes``.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``carry(ledgers, states, near, lanes, steps, goals, statuses, most, fractions, parameters,
        room)`` takes steps of each chain that moves until its goal is reached or something needs
        the caller, which is its status then, or until about `most` steps were taken in all.
        `states` are arrays with a row for each chain: strains and velocities, both after the last
        contact, and contacts. `lanes` are `Lanes` of the chains, `near` of the particles near the
        wall that contacts are searched with.
    """
    count_changes = register(count_sign_changes)
    begin, go_on = build_hunt(register)

    @register
    def push(queue: Queue, s: int) -> None:
        queue.chains[queue.held[0]] = s
        queue.held[0] += 1

    @register
    def pop(queue: Queue) -> int:
        queue.held[0] -= 1
        return queue.chains[queue.held[0]]

    @register
    def point_of(lane: LaneState, k: int, bond: Any) -> PathPoint:
        return lane[2][k], lane[1][k], -force(lane[0][k], bond)

    @register
    def load(s: int, k: int, ledgers: Any, states: tuple, lane: LaneState) -> None:
        # As many particles as lanes have room for.
        for i in range(lane[0].shape[0] // LANES):
            lane[0][i * LANES + k] = states[0][s, i]
        for i in range(lane[1].shape[0] // LANES):
            lane[1][i * LANES + k] = states[1][s, i]
        lane[2][k] = ledgers[s].position

    @register
    def note(s: int, k: int, strains: Array, velocities: Array, lane: LaneState) -> None:
        for i in range(strains.shape[1]):
            strains[s, i] = lane[0][i * LANES + k]
        for i in range(velocities.shape[1]):
            velocities[s, i] = lane[1][i * LANES + k]

    @register
    def unload(s: int, k: int, ledgers: Any, states: tuple, lane: LaneState) -> None:
        note(s, k, states[0], states[1], lane)
        ledgers[s].position = lane[2][k]

    @register
    def park(k: int, lane: LaneState, steps: Array) -> None:
        # At rest, where it costs what any lane does and nothing happens.
        for i in range(lane[0].shape[0] // LANES):
            lane[0][i * LANES + k] = 0.0
        for i in range(lane[1].shape[0] // LANES):
            lane[1][i * LANES + k] = 0.0
        lane[2][k] = 1.0
        steps[k] = 0.0

    @register
    def begin_step(ledger: Any, s: int, step: float, trips: Trips) -> None:
        trips.begun[s], trips.left[s] = ledger.steps * step, step

    @register
    def wait_if_likely(s: int, start: PathPoint, ledgers: Any, trips: Trips) -> bool:
        # Where a contact is likely, it is searched first, as ``motion`` does.
        left = trips.left[s]
        trips.move[s], trips.known[s] = left, OPEN
        ahead = start[0] + left * (start[1] + 0.5 * left * start[2])
        likely = ahead < motion.LIKELY * left * ledgers[s].impact_velocity
        if likely:
            push(trips.waiting, s)
        return likely

    @register
    def next_in(
        last: int,
        more: bool,
        ledgers: Any,
        states: tuple,
        steps: Array,
        statuses: Counts,
        trips: Trips,
        bond: Any,
    ) -> tuple[int, int]:
        # The chain that takes the next lane, -1 for none, and the last of those begun.
        if trips.found.held[0] > 0:
            return pop(trips.found), last
        while more and last + 1 < statuses.shape[0]:
            last += 1
            if statuses[last] != MOVING:
                continue
            begin_step(ledgers[last], last, steps[last], trips)
            speed, push = states[1][last, 0], -force(states[0][last, 0], bond)
            start = (ledgers[last].position, speed, push)
            if not wait_if_likely(last, start, ledgers, trips):
                return last, last
        return -1, last

    @register
    def hunt(
        hunts: Hunts,
        hunting: int,
        near: tuple,
        ledgers: Any,
        states: tuple,
        trips: Trips,
        fractions: tuple,
        bond: Any,
    ) -> int:
        # One point of the path of each chain whose contact is searched; returns how many these are.
        kept, moved, trial, steps, share, parts, forces = near
        for k in range(LANES):
            if hunts.whose[k] < 0 and trips.waiting.held[0] > 0:
                s = hunts.whose[k] = pop(trips.waiting)
                hunting += 1
                load(s, k, ledgers, states, kept)
                begin(k, hunts, trips.left[s], point_of(kept, k, bond))
                steps[k] = hunts.time[k]
        leap(kept, moved, trial, steps, share, parts, forces, 1, fractions, bond)
        for k in range(LANES):
            s = hunts.whose[k]
            if s < 0:
                continue
            if not go_on(k, hunts, point_of(moved, k, bond)):
                steps[k] = hunts.time[k]
                continue
            if hunts.time[k] >= 0.0:
                trips.move[s], trips.known[s] = hunts.time[k], MEETS
            else:
                trips.known[s] = FREE if trips.known[s] == OPEN else REPEATED
            push(trips.found, s)
            hunts.whose[k] = -1
            hunting -= 1
        return hunting

    @register
    def is_free(
        s: int, k: int, old: LaneState, new: LaneState, ledgers: Any, trips: Trips, bond: Any
    ) -> bool:
        # Whether there was no contact in this move.
        if trips.known[s] != OPEN:
            return True
        start, end = point_of(old, k, bond), point_of(new, k, bond)
        changes = count_changes(start, end, trips.left[s])
        return changes == 0 and not (end[0] <= 0.0 and end[1] < 0.0)

    @register
    def touch(
        s: int,
        k: int,
        ledgers: Any,
        states: tuple,
        new: LaneState,
        trips: Trips,
        step: float,
        low: Array,
        high: Array,
    ) -> None:
        # At the wall: as ``motion`` reverses particle 1.
        ledger, contacts = ledgers[s], states[4][s]
        speed = abs(new[1][k])
        new[1][k] = speed
        new[2][k] = 0.0
        trips.left[s] -= trips.move[s]
        ledger.momentum += 2.0 * speed
        ledger.last_contact = trips.begun[s] + (step - trips.left[s])
        ledger.argue_after = ledger.patience * ledger.last_contact / ledger.contacts
        note(s, k, states[2], states[3], new)
        ledger.contact_min = min(ledger.strain_min, low[k])
        ledger.contact_max = max(ledger.strain_max, high[k])
        contacts[0, ledger.contacts] = ledger.last_contact
        contacts[1, ledger.contacts] = speed
        contacts[2, ledger.contacts] = 2.0 * speed
        ledger.contacts += 1

    @register
    def after_step(ledger: Any, goal: int, step: float, low: float, high: float, room: int) -> int:
        # Why the chain is left, or that it moves on; as at the end of a step of ``motion``.
        ledger.steps += 1
        if not (ledger.strain_min <= low and high <= ledger.strain_max):
            ledger.strain_min = min(ledger.strain_min, low)
            ledger.strain_max = max(ledger.strain_max, high)
            if not (low > ledger.strain_floor and high < ledger.strain_ceiling):
                return motion.OUTSIDE
        away = ledger.steps * step - ledger.last_contact
        if ledger.momentum > 0.0 and away >= ledger.argue_after:
            return motion.ARGUE
        if ledger.steps >= goal:
            return motion.DONE
        return motion.FULL if room - ledger.contacts < motion.SPARE_CONTACTS else MOVING

    @register
    def note_strains(strain: Array, low: Array, high: Array) -> None:
        for k in range(LANES):
            low[k] = strain[k]
            high[k] = strain[k]
        for i in range(1, strain.shape[0] // LANES):
            for k in range(LANES):
                low[k] = min(low[k], strain[i * LANES + k])
                high[k] = max(high[k], strain[i * LANES + k])

    def carry(
        ledgers: Any,
        states: tuple,
        near: tuple,
        lanes: tuple,
        steps: Array,
        goals: Counts,
        statuses: Counts,
        most: int,
        fractions: tuple,
        bond: Any,
        room: Room,
    ) -> None:
        old, new, trial, lane_steps, share, parts, forces = lanes
        trips, hunts, whose, low, high = room
        bonds = states[0].shape[1]
        most_contacts = states[4].shape[2]
        moving = hunting = done = 0
        last = -1
        while True:
            # The new state is that from which lanes go on.
            for k in range(LANES):
                if whose[k] >= 0:
                    continue
                s, last = next_in(last, done < most, ledgers, states, steps, statuses, trips, bond)
                whose[k] = s
                if s < 0:
                    park(k, new, lane_steps)
                    continue
                moving += 1
                load(s, k, ledgers, states, new)
                lane_steps[k] = trips.move[s]
            wanted = hunting + trips.waiting.held[0]
            if moving + wanted == 0:
                return
            if wanted >= min(LANES, moving):
                hunting = hunt(hunts, hunting, near, ledgers, states, trips, fractions, bond)
                continue
            old, new = new, old
            leap(old, new, trial, lane_steps, share, parts, forces, bonds, fractions, bond)
            note_strains(new[0], low, high)
            done += moving
            for k in range(LANES):
                s = whose[k]
                if s < 0:
                    continue
                ledger, step = ledgers[s], steps[s]
                if trips.known[s] != REPEATED:
                    ledger.evaluations += ledger.step_evaluations
                if not is_free(s, k, old, new, ledgers, trips, bond):
                    trips.known[s] = REPEATED
                    unload(s, k, ledgers, states, old)
                    push(trips.waiting, s)
                    whose[k] = -1
                    moving -= 1
                    continue
                status = MOVING
                if trips.known[s] == MEETS:
                    touch(s, k, ledgers, states, new, trips, step, low, high)
                    if ledger.contacts == most_contacts:
                        status = motion.CROWDED
                else:
                    trips.left[s] = 0.0
                if status == MOVING and trips.left[s] <= 0.0:
                    status = after_step(ledger, goals[s], step, low[k], high[k], most_contacts)
                    if done < most:
                        begin_step(ledger, s, step, trips)
                if status == MOVING and trips.left[s] > 0.0:
                    if not wait_if_likely(s, point_of(new, k, bond), ledgers, trips):
                        lane_steps[k] = trips.left[s]
                        continue
                else:
                    statuses[s] = status
                unload(s, k, ledgers, states, new)
                whose[k] = -1
                moving -= 1

    return carry
