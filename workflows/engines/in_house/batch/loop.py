"""
The loop that carries many chains before a hard wall side by side, without Python in between.

Each pass moves all SIMD lanes (``lanes``), each by a step of its own. A chain that meets the wall
in a step, or may, waits outside until the time of that is found (``searches``); then it takes a
lane that is free, up to the contact. Everything that decides is what ``motion`` does, in the same
order: what comes of a chain is what comes of it alone, to the last bit.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.batch.end_bounds import EndBounds
from chaincor.workflows.engines.in_house.batch.lanes import LANES, LaneState
from chaincor.workflows.engines.in_house.batch.progress import (
    FREE,
    MEETS,
    MOVING,
    OPEN,
    PROVED,
    REPEATED,
    Progress,
    Queue,
    Room,
)
from chaincor.workflows.engines.in_house.batch.searches import Searches, build_search
from chaincor.workflows.engines.in_house.contact_search import PathPoint, count_sign_changes
from chaincor.workflows.engines.in_house.line_kinds import Source

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

# Looks for the end cost less than a step: so much later, in units of the time that sound takes over
# a bond, and of the time since the last contact.
_FIRST_LOOK, _LATER_LOOKS = 2.0, 0.1


def build_carry(source: Source, take_step: Callable, over: Callable) -> Callable:
    """
    Return the loop over chains.

    Parameters
    ----------
    source : Source
        What it is made from.
    take_step : callable
        One step of all lanes; see ``lanes``.
    over : callable
        ``end_bounds.is_over``; both known to the compiler.

    Returns
    -------
    callable
        ``carry(ledgers, states, near, lanes, steps, goals, statuses, most, fractions, bond, bounds,
        room)`` takes steps of each chain that moves until its goal is reached, its end is proved or
        something needs the caller, which is its status then, or until about `most` steps were taken
        in all. `states` are arrays with a row for each chain: strains and velocities, both after
        the last contact, contacts, and energies. `lanes` are `Lanes` of the chains, `near` of the
        particles near the wall that contacts are searched with.
    """
    force, register = source.force, source.register
    count_changes = register(count_sign_changes)
    begin, go_on = build_search(register)

    @register
    def push(queue: Queue, s: int) -> None:
        queue.chains[queue.held[0]] = s
        queue.held[0] += 1

    @register
    def pop(queue: Queue) -> int:
        queue.held[0] -= 1
        return queue.chains[queue.held[0]]

    if source.kind.unit:

        @register
        def pull(strain: float, _weights: Array, _k: int, bond: Any) -> float:
            return -force(strain, bond)

    else:

        @register
        def pull(strain: float, weights: Array, k: int, bond: Any) -> float:
            return -force(strain, bond) * weights[k]

    @register
    def point_of(lane: LaneState, k: int, weights: Array, bond: Any) -> PathPoint:
        return lane[2][k], lane[1][k], pull(lane[0][k], weights, k, bond)

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
    def begin_step(ledger: Any, s: int, step: float, progress: Progress) -> None:
        progress.begun[s], progress.left[s] = ledger.steps * step, step

    @register
    def wait_if_likely(s: int, start: PathPoint, ledgers: Any, progress: Progress) -> bool:
        # Where a contact is likely, it is searched first, as ``motion`` does.
        left = progress.left[s]
        progress.move[s], progress.known[s] = left, OPEN
        ahead = start[0] + left * (start[1] + 0.5 * left * start[2])
        likely = ahead < motion.LIKELY * left * ledgers[s].impact_velocity
        if likely:
            push(progress.waiting, s)
        return likely

    @register
    def next_in(
        last: int,
        more: bool,
        ledgers: Any,
        states: tuple,
        steps: Array,
        statuses: Counts,
        progress: Progress,
        weights: Array,
        bond: Any,
    ) -> tuple[int, int]:
        # The chain that takes the next lane, -1 for none, and the last of those begun.
        if progress.found.held[0] > 0:
            return pop(progress.found), last
        while more and last + 1 < statuses.shape[0]:
            last += 1
            if statuses[last] != MOVING:
                continue
            begin_step(ledgers[last], last, steps[last], progress)
            rate = pull(states[0][last, 0], weights, 0, bond)
            start = (ledgers[last].position, states[1][last, 0], rate)
            if not wait_if_likely(last, start, ledgers, progress):
                return last, last
        return -1, last

    @register
    def search(
        searches: Searches,
        searching: int,
        near: tuple,
        ledgers: Any,
        states: tuple,
        progress: Progress,
        fractions: tuple,
        bond: Any,
    ) -> int:
        # One point of the path of each chain whose contact is searched; returns how many these are.
        kept, moved, trial, steps, share, parts, forces, weights = near
        for k in range(LANES):
            if searches.whose[k] < 0 and progress.waiting.held[0] > 0:
                s = searches.whose[k] = pop(progress.waiting)
                searching += 1
                load(s, k, ledgers, states, kept)
                begin(k, searches, progress.left[s], point_of(kept, k, weights, bond))
                steps[k] = searches.time[k]
        take_step(kept, moved, trial, steps, share, parts, forces, weights, 1, fractions, bond)
        for k in range(LANES):
            s = searches.whose[k]
            if s < 0:
                continue
            if not go_on(k, searches, point_of(moved, k, weights, bond)):
                steps[k] = searches.time[k]
                continue
            if searches.time[k] >= 0.0:
                progress.move[s], progress.known[s] = searches.time[k], MEETS
            else:
                progress.known[s] = FREE if progress.known[s] == OPEN else REPEATED
            push(progress.found, s)
            searches.whose[k] = -1
            searching -= 1
        return searching

    @register
    def is_free(
        s: int,
        k: int,
        old: LaneState,
        new: LaneState,
        progress: Progress,
        weights: Array,
        bond: Any,
    ) -> bool:
        # Whether there was no contact in this move.
        if progress.known[s] != OPEN:
            return True
        start, end = point_of(old, k, weights, bond), point_of(new, k, weights, bond)
        changes = count_changes(start, end, progress.left[s])
        return changes == 0 and not (end[0] <= 0.0 and end[1] < 0.0)

    @register
    def touch(
        s: int,
        k: int,
        ledgers: Any,
        states: tuple,
        new: LaneState,
        progress: Progress,
        step: float,
        low: Array,
        high: Array,
    ) -> None:
        # At the wall: as ``motion`` reverses particle 1.
        ledger, contacts = ledgers[s], states[4][s]
        speed = abs(new[1][k])
        new[1][k] = speed
        new[2][k] = 0.0
        progress.left[s] -= progress.move[s]
        given = 2.0 * ledger.contact_mass * speed
        now = progress.begun[s] + (step - progress.left[s])
        ledger.momentum += given
        ledger.last_contact = now
        if ledger.contacts == 0:
            ledger.first_contact = now
            ledger.argue_after = ledger.argue_first
        else:
            lasted = now - ledger.first_contact
            ledger.argue_after = ledger.patience * lasted / ledger.contacts
        note(s, k, states[2], states[3], new)
        ledger.contact_min = min(ledger.strain_min, low[k])
        ledger.contact_max = max(ledger.strain_max, high[k])
        contacts[0, ledger.contacts] = now
        contacts[1, ledger.contacts] = speed
        contacts[2, ledger.contacts] = given
        ledger.contacts += 1

    @register
    def as_it_goes_on(ledger: Any, goal: int, room: int) -> int:
        if ledger.steps >= goal:
            return motion.DONE
        return motion.FULL if room - ledger.contacts < motion.SPARE_CONTACTS else MOVING

    @register
    def look(
        s: int, ledgers: Any, states: tuple, goal: int, step: float, bounds: EndBounds, room: int
    ) -> int:
        # Whether the end is proved; if not, when to look again.
        ledger = ledgers[s]
        if over(ledger.position, states[0][s], states[1][s], states[5][s], bounds):
            return PROVED
        away = ledger.steps * step - ledger.last_contact
        ledger.argue_after = away + max(_FIRST_LOOK * bounds.interval, _LATER_LOOKS * away)
        return as_it_goes_on(ledger, goal, room)

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
        return as_it_goes_on(ledger, goal, room)

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
        bounds: EndBounds,
        room: Room,
    ) -> None:
        old, new, trial, lane_steps, share, parts, forces, weights = lanes
        progress, searches, whose, low, high = room
        bonds = states[0].shape[1]
        most_contacts = states[4].shape[2]
        moving = searching = done = 0
        last = -1
        while True:
            # The new state is that from which lanes go on.
            for k in range(LANES):
                if whose[k] >= 0:
                    continue
                more = done < most
                s, last = next_in(
                    last, more, ledgers, states, steps, statuses, progress, weights, bond
                )
                whose[k] = s
                if s < 0:
                    park(k, new, lane_steps)
                    continue
                moving += 1
                load(s, k, ledgers, states, new)
                lane_steps[k] = progress.move[s]
            wanted = searching + progress.waiting.held[0]
            if moving + wanted == 0:
                return
            if wanted >= min(LANES, moving):
                searching = search(
                    searches, searching, near, ledgers, states, progress, fractions, bond
                )
                continue
            old, new = new, old
            take_step(
                old, new, trial, lane_steps, share, parts, forces, weights, bonds, fractions, bond
            )
            note_strains(new[0], low, high)
            done += moving
            for k in range(LANES):
                s = whose[k]
                if s < 0:
                    continue
                ledger, step = ledgers[s], steps[s]
                if progress.known[s] != REPEATED:
                    ledger.evaluations += ledger.step_evaluations
                if not is_free(s, k, old, new, progress, weights, bond):
                    progress.known[s] = REPEATED
                    unload(s, k, ledgers, states, old)
                    push(progress.waiting, s)
                    whose[k] = -1
                    moving -= 1
                    continue
                status = MOVING
                if progress.known[s] == MEETS:
                    touch(s, k, ledgers, states, new, progress, step, low, high)
                    if ledger.contacts == most_contacts:
                        status = motion.CROWDED
                else:
                    progress.left[s] = 0.0
                if status == MOVING and progress.left[s] <= 0.0:
                    status = after_step(ledger, goals[s], step, low[k], high[k], most_contacts)
                    if status == motion.ARGUE and bounds.reaches.shape[0] > 0:
                        unload(s, k, ledgers, states, new)
                        status = look(s, ledgers, states, goals[s], step, bounds, most_contacts)
                    if done < most:
                        begin_step(ledger, s, step, progress)
                if status == MOVING and progress.left[s] > 0.0:
                    if not wait_if_likely(s, point_of(new, k, weights, bond), ledgers, progress):
                        lane_steps[k] = progress.left[s]
                        continue
                else:
                    statuses[s] = status
                unload(s, k, ledgers, states, new)
                whose[k] = -1
                moving -= 1

    return carry
