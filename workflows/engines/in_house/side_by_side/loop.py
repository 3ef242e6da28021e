"""
The loop that carries many short chains before a wall side by side, without Python in between.

Each pass moves all lanes (``lanes``) by what is left of their steps. Where particle 1 met the wall
in it, the time of the contact is searched as ``contact_search`` does for one chain, and the next
pass ends there. Everything that decides is what ``motion`` does, in the same order: what comes of a
chain is what comes of it alone, to the last bit.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.contact_search import (
    PathPoint,
    build_contact_search,
    count_sign_changes,
)
from chaincor.workflows.engines.in_house.lines.lanes import LANES
from chaincor.workflows.engines.in_house.side_by_side.lanes import LaneState
from chaincor.workflows.engines.in_house.stages import State
from chaincor.workflows.engines.schemes import Rule

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

# Not left yet; otherwise why it was, see ``motion``.
MOVING = -1


class LaneSearch(NamedTuple):
    """What the search for a contact works on: the particles near the wall, before a step."""

    distance: float
    kept: State
    near: State
    trial: State
    rule: Rule


class Trips(NamedTuple):
    """
    Where the chains in the lanes are within their steps.

    Attributes
    ----------
    whose : ndarray of shape (L,)
        Which chain; -1 for none.
    begun, left : ndarray of shape (L,)
        When its step began, and what is left of it.
    until : ndarray of shape (L,)
        When the contact comes that this pass ends at; -1 for none.
    low, high : ndarray of shape (L,)
        Its smallest and largest strain now.
    """

    whose: Counts
    begun: Array
    left: Array
    until: Array
    low: Array
    high: Array


def build_carry(
    force: Callable, near_leap: Callable, leap: Callable, register: Callable
) -> Callable:
    """
    Return the loop over chains.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain, ``force(strain, parameters)``.
    near_leap : callable
        One step of one chain, as in ``schemes``, by which contacts are searched.
    leap : callable
        One step of all lanes; see ``lanes``.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``carry(ledgers, states, scratch, lanes, steps, goals, statuses, most, fractions,
        parameters)`` takes steps of each chain that moves until its goal is reached or something
        needs the caller, which is its status then, or until about `most` steps were taken in all.
        `states` are arrays with a row for each chain: strains and velocities, both after the last
        contact, and contacts. `scratch` is three states of the particles near the wall, `lanes`
        that of `Lanes`.
    """
    count_changes = register(count_sign_changes)

    @register
    def probe(time: float, search: LaneSearch) -> PathPoint:
        near, bonds = search.near, search.kept.strain.shape[0]
        x = near_leap(search.distance, search.kept, near, search.trial, bonds, 1, time, search.rule)
        return x, near.velocity[0], -force(near.strain[0], search.rule.parameters)

    find_contact = build_contact_search(probe=probe, register=register)

    @register
    def contact_within(
        ledger: Any, old: LaneState, new: LaneState, k: int, left: float, scratch: tuple, rule: Rule
    ) -> float:
        # As ``motion`` looks for it, whose count of evaluations is kept.
        start = (old[2][k], old[1][k], -force(old[0][k], rule.parameters))
        end = (new[2][k], new[1][k], -force(new[0][k], rule.parameters))
        ahead = start[0] + left * (start[1] + 0.5 * left * start[2])
        likely = ahead < motion.LIKELY * left * ledger.impact_velocity
        ledger.evaluations += ledger.step_evaluations
        if count_changes(start, end, left) == 0 and not (end[0] <= 0.0 and end[1] < 0.0):
            return -1.0
        kept = State(scratch[0][0], scratch[0][1])
        for i in range(kept.strain.shape[0]):
            kept.strain[i] = old[0][i * LANES + k]
        for i in range(kept.velocity.shape[0]):
            kept.velocity[i] = old[1][i * LANES + k]
        near, trial = State(scratch[1][0], scratch[1][1]), State(scratch[2][0], scratch[2][1])
        time = find_contact(left, start, end, LaneSearch(old[2][k], kept, near, trial, rule))
        if time >= 0.0 and not likely:
            ledger.evaluations += ledger.step_evaluations
        return time

    @register
    def set_step(k: int, step: float, steps: Array) -> None:
        for i in range(steps.shape[0] // LANES):
            steps[i * LANES + k] = step

    @register
    def stay(k: int, old: LaneState, new: LaneState) -> None:
        for i in range(old[0].shape[0] // LANES):
            new[0][i * LANES + k] = old[0][i * LANES + k]
        for i in range(old[1].shape[0] // LANES):
            new[1][i * LANES + k] = old[1][i * LANES + k]
        new[2][k] = old[2][k]

    @register
    def load(s: int, k: int, ledgers: Any, states: tuple, lane: LaneState) -> None:
        for i in range(states[0].shape[1]):
            lane[0][i * LANES + k] = states[0][s, i]
        for i in range(states[1].shape[1]):
            lane[1][i * LANES + k] = states[1][s, i]
        lane[2][k] = ledgers[s].wall_distance

    @register
    def unload(s: int, k: int, strains: Array, velocities: Array, lane: LaneState) -> None:
        for i in range(strains.shape[1]):
            strains[s, i] = lane[0][i * LANES + k]
        for i in range(velocities.shape[1]):
            velocities[s, i] = lane[1][i * LANES + k]

    @register
    def park(k: int, lane: LaneState, steps: Array) -> None:
        # At rest, where it costs what any lane does and nothing happens.
        lane[0][k::LANES] = 0.0
        lane[1][k::LANES] = 0.0
        lane[2][k] = 1.0
        set_step(k, 0.0, steps)

    @register
    def next_waiting(waiting: int, statuses: Counts) -> int:
        while waiting < statuses.shape[0] and statuses[waiting] != MOVING:
            waiting += 1
        return waiting

    @register
    def touch(s: int, k: int, ledgers: Any, states: tuple, new: LaneState, trips: Trips) -> None:
        # At the wall: as ``motion`` reverses particle 1.
        ledger, contacts, step = ledgers[s], states[4][s], trips.until[k]
        speed = abs(new[1][k])
        new[1][k] = speed
        new[2][k] = 0.0
        trips.left[k] -= step
        trips.until[k] = -1.0
        ledger.momentum += 2.0 * speed
        unload(s, k, states[2], states[3], new)
        ledger.contact_min = min(ledger.strain_min, trips.low[k])
        ledger.contact_max = max(ledger.strain_max, trips.high[k])
        contacts[1, ledger.contacts] = speed

    @register
    def after_step(
        s: int, k: int, ledgers: Any, goals: Counts, step: float, trips: Trips, room: int
    ) -> int:
        # Why the chain is left, or that it moves on; as at the end of a step of ``motion``.
        ledger = ledgers[s]
        ledger.steps += 1
        low, high = trips.low[k], trips.high[k]
        if not (ledger.strain_min <= low and high <= ledger.strain_max):
            ledger.strain_min = min(ledger.strain_min, low)
            ledger.strain_max = max(ledger.strain_max, high)
            if not (low > ledger.strain_floor and high < ledger.strain_ceiling):
                return motion.OUTSIDE
        away = ledger.steps * step - ledger.last_contact
        if ledger.momentum > 0.0 and away >= ledger.argue_after:
            return motion.ARGUE
        if ledger.steps >= goals[s]:
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
        scratch: tuple,
        lanes: tuple,
        steps: Array,
        goals: Counts,
        statuses: Counts,
        most: int,
        fractions: tuple,
        parameters: Any,
    ) -> None:
        old, new, trial, lane_steps, parts, forces = lanes
        rule = Rule(fractions, parameters)
        room = states[4].shape[2]
        trips = Trips(
            *(np.full(LANES, -1), np.zeros(LANES), np.zeros(LANES)),
            *(np.full(LANES, -1.0), np.zeros(LANES), np.zeros(LANES)),
        )
        waiting = moving = done = 0
        for k in range(LANES):
            park(k, new, lane_steps)
        fill = True
        while True:
            if fill:
                # The new state is that from which lanes go on; some of them have none.
                fill = False
                for k in range(LANES):
                    if trips.whose[k] < 0 and done < most:
                        waiting = next_waiting(waiting, statuses)
                        if waiting < statuses.shape[0]:
                            s = waiting
                            waiting += 1
                            moving += 1
                            trips.whose[k], trips.left[k], trips.until[k] = s, steps[s], -1.0
                            trips.begun[k] = ledgers[s].steps * steps[s]
                            load(s, k, ledgers, states, new)
                            set_step(k, steps[s], lane_steps)
            if moving == 0:
                return
            old, new = new, old
            leap(old, new, trial, lane_steps, parts, forces, fractions, parameters)
            note_strains(new[0], trips.low, trips.high)
            done += moving
            for k in range(LANES):
                s = trips.whose[k]
                if s < 0:
                    continue
                ledger, step = ledgers[s], steps[s]
                if trips.until[k] < 0.0:
                    time = contact_within(ledger, old, new, k, trips.left[k], scratch, rule)
                    if time >= 0.0:
                        trips.until[k] = time
                        stay(k, old, new)
                        set_step(k, time, lane_steps)
                        continue
                else:
                    touch(s, k, ledgers, states, new, trips)
                    ledger.last_contact = trips.begun[k] + (step - trips.left[k])
                    ledger.argue_after = ledger.patience * ledger.last_contact / ledger.contacts
                    states[4][s, 0, ledger.contacts] = ledger.last_contact
                    ledger.contacts += 1
                    if trips.left[k] > 0.0 and ledger.contacts < room:
                        set_step(k, trips.left[k], lane_steps)
                        continue
                ledger.wall_distance = new[2][k]
                status = motion.CROWDED
                if ledger.contacts < room:
                    status = after_step(s, k, ledgers, goals, step, trips, room)
                trips.begun[k], trips.left[k] = ledger.steps * step, step
                if status == MOVING and done < most:
                    set_step(k, step, lane_steps)
                    continue
                unload(s, k, states[0], states[1], new)
                statuses[s] = status
                park(k, new, lane_steps)
                trips.whose[k] = -1
                moving -= 1
                fill = True

    return carry
