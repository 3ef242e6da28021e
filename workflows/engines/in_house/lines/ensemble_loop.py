r"""
The loop that carries many collisions with a wall side by side, without Python in between.

They fly in lanes (``lines.lanes``); a step in which particle 1 may meet the wall is done by the
loop of ``motion``. What comes out of one does not depend on which others are there. Most ends
are proved here, by energy and momentum: with all energy that is not in the motion of its centre of
mass the chain cannot stretch back to the wall (``ending``). What that does not rule out is left to
Python.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.lines.lanes import LANES
from chaincor.workflows.engines.in_house.stages import State
from chaincor.workflows.engines.whole_end import ENERGY_MARGIN

Array = NDArray[np.float64]

# Why a collision was left: its end is proved; the time it was to be followed is up; steps are too
# large for its bonds.
PROVED, DUE, UNRESOLVED = range(3)
MOVING = -1

# Looks for the end, in units of the time that sound takes over a bond, and of the time since the
# last contact: one costs less than a step.
_FIRST_LOOK, _LATER_LOOKS = 2.0, 0.1


class EndBounds(NamedTuple):
    """
    What proves an end.

    Attributes
    ----------
    masses : ndarray of shape (n,)
        Of the chain.
    lever : float
        :math:`m_1 M/(M - m_1)` of particle 1 and the chain.
    log_least, log_rung : float
        Logarithm of the smallest energy of the ladder, and of the ratio of its rungs.
    reaches : ndarray of shape (rungs,)
        How far particle 1 can be from where the mean has it, with that energy.
    interval : float
        Time that sound takes over a bond.
    """

    masses: Array
    lever: float
    log_least: float
    log_rung: float
    reaches: Array
    interval: float


def is_over(
    strain: Array,
    velocity: Array,
    first: int,
    energy: float,
    bounds: EndBounds,
) -> bool:
    """
    Return whether the chain can never come back to the wall.

    Parameters
    ----------
    strain : ndarray of shape (N - 1,)
        Along x, with the gap, which is that of the wall to particle 1.
    velocity : ndarray of shape (N,)
        Along x.
    first : int
        Where particle 1 stands.
    energy : float
        All energy of the chain.
    bounds : EndBounds
        What proves it.
    """
    masses = bounds.masses
    whole = 0.0
    momentum = 0.0
    place = strain[first - 1]
    moment = 0.0
    for i in range(masses.shape[0]):
        if i > 0:
            place += strain[first + i - 1]
        whole += masses[i]
        momentum += masses[i] * velocity[first + i]
        moment += masses[i] * place
    speed = momentum / whole
    if not speed > 0.0:
        return False
    free = energy * (1.0 + ENERGY_MARGIN) - 0.5 * whole * speed * speed
    # For particle 1 to meet the wall it must move against the mean.
    free -= 0.5 * speed * speed * bounds.lever
    if free <= 0.0:
        return True
    rung = int(np.ceil((np.log(free) - bounds.log_least) / bounds.log_rung))
    if rung >= bounds.reaches.shape[0]:
        return False
    return moment / whole > bounds.reaches[max(rung, 0)]


def build_carry(
    force: Callable, advance: Callable, leap: Callable, over: Callable, register: Callable
) -> Callable:
    """
    Return the loop over collisions.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain, ``force(strain, parameters)``.
    advance : callable
        See ``motion``: it does the steps in which particle 1 may meet the wall.
    leap : callable
        See ``lines.lanes``: it does all others.
    over : callable
        :func:`is_over`; all known to the compiler.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``carry(ledgers, states, scratch, lanes, step, fractions, parameters, bounds, stopped)``
        moves each collision until its end is proved or its time is up, or until `stopped[0]`.
        `states` are arrays with a row each: strains, velocities, both after the last contact,
        contacts, counts of contacts that have left that list, times of the first one, energies,
        times until which to move, and why it was left. `scratch` is that of ``motion``,
        `lanes` the fields of `Lanes`.
    """

    @register
    def look(
        s: int, ledgers: Any, states: tuple, step: float, bounds: EndBounds, begun: int, status: int
    ) -> bool:
        # Returns whether the collision is left; why is in its status.
        strains, velocities, contacts, counts, firsts = states[0], states[1], *states[4:7]
        energies, untils, statuses = states[7:]
        ledger = ledgers[s]
        if counts[s] == 0 and ledger.contacts > 0:
            firsts[s] = contacts[s, 0, 0]
        if status == motion.FULL:
            # Only how many there were is asked for.
            counts[s] += ledger.contacts
            ledger.contacts = 0
            return False
        if status != motion.DONE:
            statuses[s] = UNRESOLVED
            return True
        quiet = ledger.contacts + counts[s] > 0 and ledger.last_contact <= begun * step
        if quiet and over(strains[s], velocities[s], 1, energies[s], bounds):
            statuses[s] = PROVED
            return True
        if ledger.steps * step >= untils[s]:
            statuses[s] = DUE
            return True
        return False

    @register
    def goal_of(s: int, ledgers: Any, states: tuple, step: float, bounds: EndBounds) -> int:
        counts, untils = states[5], states[8]
        ledger = ledgers[s]
        now = ledger.steps * step
        since = 0.0
        if ledger.contacts + counts[s] > 0:
            since = _LATER_LOOKS * (now - ledger.last_contact)
        later = min(now + max(_FIRST_LOOK * bounds.interval, since), untils[s])
        return max(ledger.steps + 1, int(np.ceil(later / step)))

    @register
    def may_meet(old: State, new: State, k: int, step: float, weights: Array, bond: Any) -> bool:
        # What the nearer end of the path allows in half a step, with the larger speed and twice
        # the larger acceleration of both; what is not a number may.
        one = LANES + k
        gap = min(old[0][k], new[0][k])
        fastest = max(abs(old[1][one]), abs(new[1][one]))
        push = max(abs(force(old[0][one], bond)), abs(force(new[0][one], bond)))
        return not gap > 0.5 * step * (fastest + step * weights[one] * push)

    @register
    def load(s: int, k: int, ledgers: Any, states: tuple, lane: State, strains_met: tuple) -> None:
        for i in range(states[0].shape[1]):
            lane[0][i * LANES + k] = states[0][s, i]
        for i in range(states[1].shape[1]):
            lane[1][i * LANES + k] = states[1][s, i]
        strains_met[0][k], strains_met[1][k] = ledgers[s].strain_min, ledgers[s].strain_max

    @register
    def unload(s: int, k: int, states: tuple, lane: State) -> None:
        for i in range(states[0].shape[1]):
            states[0][s, i] = lane[0][i * LANES + k]
        for i in range(states[1].shape[1]):
            states[1][s, i] = lane[1][i * LANES + k]

    @register
    def park(k: int, lane: State, strains_met: tuple) -> None:
        # At rest and far away, where it costs what any lane does and nothing happens.
        lane[0][k::LANES] = 0.0
        lane[0][k] = 1.0
        lane[1][k::LANES] = 0.0
        strains_met[0][k] = strains_met[1][k] = 0.0

    @register
    def next_waiting(waiting: int, statuses: NDArray[np.int64]) -> int:
        while waiting < statuses.shape[0] and statuses[waiting] != MOVING:
            waiting += 1
        return waiting

    @register
    def step_alone(
        s: int,
        ledgers: Any,
        states: tuple,
        scratch: tuple,
        step: float,
        fractions: tuple,
        parameters: Any,
        bounds: EndBounds,
    ) -> int:
        kept, near, trial, masses, window, log = scratch
        arrays = (
            (states[0][s, 1:], states[1][s, 1:]),
            (states[2][s, 1:], states[3][s, 1:]),
            kept,
            near,
            trial,
            states[4][s],
            masses,
            window,
            log,
        )
        ledger = ledgers[s]
        goal = ledger.steps + 1
        ledger.position = states[0][s, 0]
        while True:
            status = advance(ledger, arrays, goal, step, fractions, parameters)
            if status != motion.FULL:
                states[0][s, 0] = ledger.position
                return status
            look(s, ledgers, states, step, bounds, 0, status)

    def carry(
        ledgers: Any,
        states: tuple,
        scratch: tuple,
        lanes: tuple,
        step: float,
        fractions: tuple,
        parameters: Any,
        bounds: EndBounds,
        stopped: NDArray[np.bool_],
    ) -> None:
        statuses = states[9]
        old, new, trial, forces, weights = lanes
        bond = parameters[0]
        low, high = np.zeros(LANES), np.zeros(LANES)
        whose = np.full(LANES, -1)
        goals, begun = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
        waiting = moving = 0
        for k in range(LANES):
            park(k, old, (low, high))
            waiting = next_waiting(waiting, statuses)
            if waiting < statuses.shape[0]:
                s = waiting
                waiting += 1
                moving += 1
                load(s, k, ledgers, states, old, (low, high))
                whose[k], begun[k] = s, ledgers[s].steps
                goals[k] = goal_of(s, ledgers, states, step, bounds)
        while moving > 0 and not stopped[0]:
            leap(old, new, trial, forces, weights, step, fractions, bond)
            for i in range(1, new[0].shape[0] // LANES):
                for k in range(LANES):
                    low[k] = min(low[k], new[0][i * LANES + k])
                    high[k] = max(high[k], new[0][i * LANES + k])
            for k in range(LANES):
                s = whose[k]
                if s < 0:
                    continue
                ledger = ledgers[s]
                status = motion.DONE
                if may_meet(old, new, k, step, weights, bond):
                    unload(s, k, states, old)
                    status = step_alone(
                        s, ledgers, states, scratch, step, fractions, parameters, bounds
                    )
                    load(s, k, ledgers, states, new, (low, high))
                else:
                    ledger.steps += 1
                    ledger.strain_min, ledger.strain_max = low[k], high[k]
                if not (ledger.strain_floor < low[k] and high[k] < ledger.strain_ceiling):
                    status = motion.OUTSIDE
                if ledger.steps < goals[k] and status == motion.DONE:
                    continue
                unload(s, k, states, new)
                if not look(s, ledgers, states, step, bounds, begun[k], status):
                    begun[k] = ledger.steps
                    goals[k] = goal_of(s, ledgers, states, step, bounds)
                    continue
                moving -= 1
                whose[k] = -1
                park(k, new, (low, high))
                waiting = next_waiting(waiting, statuses)
                if waiting < statuses.shape[0]:
                    s = waiting
                    waiting += 1
                    moving += 1
                    load(s, k, ledgers, states, new, (low, high))
                    whose[k], begun[k] = s, ledgers[s].steps
                    goals[k] = goal_of(s, ledgers, states, step, bounds)
            old, new = new, old

    return carry
