"""
The loop that carries many cold chains before a wall, without Python in between.

Short chains fly in lanes (``lanes``), long ones one after the other; a step in which particle 1
meets the wall is done by the loop of ``motion``, and so is every other bit of what decides: what
comes of a chain is what comes of it alone.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.contact_search import count_sign_changes
from chaincor.workflows.engines.in_house.lines.lanes import LANES
from chaincor.workflows.engines.in_house.side_by_side.lanes import LaneState

# Not left yet; otherwise why it was, see ``motion``.
MOVING = -1


def build_carry(force: Callable, advance: Callable, leap: Callable, register: Callable) -> Callable:
    """
    Return the loop over chains.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain, ``force(strain, parameters)``.
    advance : callable
        See ``motion``: it does the steps in which particle 1 meets the wall.
    leap : callable
        See ``lanes``: it does all others of short chains; both known to the compiler.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``carry(ledgers, states, scratch, lanes, steps, goals, statuses, most, fractions,
        parameters)`` takes steps of each chain that moves until its goal is reached or something
        needs the caller, which is its status then, or until about `most` steps were taken in all.
        `states` are arrays with a row for each chain: strains and velocities, both after the last
        contact, and contacts. `scratch` is that of ``motion``, `lanes` that of `Lanes`, or empty
        where chains are moved one by one.
    """
    count_changes = register(count_sign_changes)

    @register
    def alone(
        s: int,
        goal: int,
        ledgers: Any,
        states: tuple,
        scratch: tuple,
        step: float,
        fractions: tuple,
        parameters: Any,
    ) -> int:
        kept, near, trial = scratch
        arrays = (
            (states[0][s], states[1][s]),
            (states[2][s], states[3][s]),
            *(kept, near, trial),
            states[4][s],
        )
        return advance(ledgers[s], arrays, goal, step, fractions, parameters)

    @register
    def may_meet(old: LaneState, new: LaneState, k: int, step: float, bond: Any) -> bool:
        # As the search for a contact begins: what it would not look for further.
        start = (old[2][k], old[1][k], -force(old[0][k], bond))
        end = (new[2][k], new[1][k], -force(new[0][k], bond))
        return count_changes(start, end, step) > 0 or (end[0] <= 0.0 and end[1] < 0.0)

    @register
    def load(s: int, k: int, ledgers: Any, states: tuple, lane: LaneState, met: tuple) -> None:
        strain, velocity = states[0][s], states[1][s]
        for i in range(strain.shape[0]):
            lane[0][i * LANES + k] = strain[i]
        for i in range(velocity.shape[0]):
            lane[1][i * LANES + k] = velocity[i]
        lane[2][k] = ledgers[s].wall_distance
        met[0][k], met[1][k] = ledgers[s].strain_min, ledgers[s].strain_max

    @register
    def unload(s: int, k: int, ledgers: Any, states: tuple, lane: LaneState, met: tuple) -> None:
        strain, velocity = states[0][s], states[1][s]
        for i in range(strain.shape[0]):
            strain[i] = lane[0][i * LANES + k]
        for i in range(velocity.shape[0]):
            velocity[i] = lane[1][i * LANES + k]
        ledgers[s].wall_distance = lane[2][k]
        ledgers[s].strain_min, ledgers[s].strain_max = met[0][k], met[1][k]

    @register
    def park(k: int, lane: LaneState, steps: NDArray[np.float64], met: tuple) -> None:
        # At rest, where it costs what any lane does and nothing happens.
        lane[0][k::LANES] = 0.0
        lane[1][k::LANES] = 0.0
        lane[2][k] = 1.0
        steps[k::LANES] = 0.0
        met[0][k] = met[1][k] = 0.0

    @register
    def next_waiting(waiting: int, statuses: NDArray[np.int64]) -> int:
        while waiting < statuses.shape[0] and statuses[waiting] != MOVING:
            waiting += 1
        return waiting

    @register
    def in_lanes(
        ledgers: Any,
        states: tuple,
        scratch: tuple,
        lanes: tuple,
        steps: NDArray[np.float64],
        goals: NDArray[np.int64],
        statuses: NDArray[np.int64],
        most: int,
        fractions: tuple,
        parameters: Any,
    ) -> None:
        old, new, trial, lane_steps, parts, forces = lanes
        bonds = states[0].shape[1]
        met = (np.zeros(LANES), np.zeros(LANES))
        whose = np.full(LANES, -1)
        waiting = moving = done = 0
        for k in range(LANES):
            park(k, old, lane_steps, met)
            waiting = next_waiting(waiting, statuses)
            if waiting < statuses.shape[0]:
                whose[k] = waiting
                ledgers[waiting].active = bonds
                load(waiting, k, ledgers, states, old, met)
                lane_steps[k::LANES] = steps[waiting]
                waiting += 1
                moving += 1
        while moving > 0 and done < most:
            leap(old, new, trial, lane_steps, parts, forces, fractions, parameters)
            done += moving
            for i in range(bonds):
                for k in range(LANES):
                    met[0][k] = min(met[0][k], new[0][i * LANES + k])
                    met[1][k] = max(met[1][k], new[0][i * LANES + k])
            for k in range(LANES):
                s = whose[k]
                if s < 0:
                    continue
                ledger, step, status = ledgers[s], steps[s], motion.DONE
                if may_meet(old, new, k, step, parameters):
                    low, high = ledger.strain_min, ledger.strain_max
                    unload(s, k, ledgers, states, old, met)
                    ledger.strain_min, ledger.strain_max = low, high
                    goal = ledger.steps + 1
                    status = alone(
                        s, goal, ledgers, states, scratch, step, fractions, parameters
                    )
                    load(s, k, ledgers, states, new, met)
                else:
                    ledger.steps += 1
                    ledger.evaluations += ledger.step_evaluations
                    ledger.strain_min, ledger.strain_max = met[0][k], met[1][k]
                    ledger.wall_distance = new[2][k]
                    low, high = ledger.strain_min, ledger.strain_max
                    away = ledger.steps * step - ledger.last_contact
                    if not (low > ledger.strain_floor and high < ledger.strain_ceiling):
                        status = motion.OUTSIDE
                    elif ledger.momentum > 0.0 and away >= ledger.argue_after:
                        status = motion.ARGUE
                if status == motion.DONE and ledger.steps < goals[s]:
                    continue
                unload(s, k, ledgers, states, new, met)
                statuses[s] = status
                park(k, new, lane_steps, met)
                whose[k] = -1
                moving -= 1
                waiting = next_waiting(waiting, statuses)
                if waiting < statuses.shape[0]:
                    whose[k] = waiting
                    ledgers[waiting].active = bonds
                    load(waiting, k, ledgers, states, new, met)
                    lane_steps[k::LANES] = steps[waiting]
                    waiting += 1
                    moving += 1
            old, new = new, old
        for k in range(LANES):
            if whose[k] >= 0:
                unload(whose[k], k, ledgers, states, old, met)

    @register
    def one_by_one(
        ledgers: Any,
        states: tuple,
        scratch: tuple,
        steps: NDArray[np.float64],
        goals: NDArray[np.int64],
        statuses: NDArray[np.int64],
        most: int,
        fractions: tuple,
        parameters: Any,
    ) -> None:
        left = most
        for s in range(statuses.shape[0]):
            if statuses[s] != MOVING:
                continue
            begun = ledgers[s].steps
            until = min(goals[s], begun + max(left, 1))
            status = alone(s, until, ledgers, states, scratch, steps[s], fractions, parameters)
            left -= ledgers[s].steps - begun
            if status != motion.DONE or ledgers[s].steps >= goals[s]:
                statuses[s] = status
            if left <= 0:
                return

    def carry(
        ledgers: Any,
        states: tuple,
        scratch: tuple,
        lanes: tuple,
        steps: NDArray[np.float64],
        goals: NDArray[np.int64],
        statuses: NDArray[np.int64],
        most: int,
        fractions: tuple,
        parameters: Any,
    ) -> None:
        if lanes[3].shape[0] > 0:
            in_lanes(
                *(ledgers, states, scratch, lanes, steps, goals, statuses),
                *(most, fractions, parameters),
            )
        else:
            one_by_one(
                *(ledgers, states, scratch, steps, goals, statuses, most, fractions, parameters)
            )

    return carry
