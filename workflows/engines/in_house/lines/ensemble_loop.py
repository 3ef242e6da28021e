r"""
The loop that carries many collisions with a wall, one after the other, without Python in between.

Each is moved by the loop of ``lines.loop`` and is alone in it: what comes out does not depend on
which others are there. Most ends are proved here, by energy and momentum: with all energy that is
not in the motion of its centre of mass the chain cannot stretch back to the wall (``ending``).
What that does not rule out is left to Python.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house.lines import loop

# Why a collision was left: its end is proved; the time it was to be followed is up; steps are too
# large for its bonds.
PROVED, DUE, UNRESOLVED = range(3)
MOVING = -1

# Looks for the end, in units of the time that sound takes over a bond, and of the time since the
# last contact: one costs less than a step.
_FIRST_LOOK, _LATER_LOOKS = 2.0, 0.1
# Steps keep energy to far less than this part of it.
_ENERGY_MARGIN = 0.01


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

    masses: NDArray[np.float64]
    lever: float
    log_least: float
    log_rung: float
    reaches: NDArray[np.float64]
    interval: float


def is_over(
    strain: NDArray[np.float64],
    velocity: NDArray[np.float64],
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
    free = energy * (1.0 + _ENERGY_MARGIN) - 0.5 * whole * speed * speed
    # For particle 1 to meet the wall it must move against the mean.
    free -= 0.5 * speed * speed * bounds.lever
    if free <= 0.0:
        return True
    rung = int(np.ceil((np.log(free) - bounds.log_least) / bounds.log_rung))
    if rung >= bounds.reaches.shape[0]:
        return False
    return moment / whole > bounds.reaches[max(rung, 0)]


def build_carry(advance: Callable, over: Callable) -> Callable:
    """
    Return the loop over collisions.

    Parameters
    ----------
    advance : callable
        See ``lines.loop``.
    over : callable
        :func:`is_over`; both known to the compiler.

    Returns
    -------
    callable
        ``carry(ledgers, states, scratch, fractions, parameters, bounds)`` moves each collision
        until its end is proved or its time is up. `states` are arrays with a row each: strains,
        velocities, both after the last contact, contacts, counts of contacts that have left that
        list, energies, steps, times until which to move, and why it was left.
    """

    def carry(
        ledgers: Any,
        states: tuple,
        scratch: tuple,
        fractions: tuple,
        parameters: Any,
        bounds: EndBounds,
    ) -> None:
        strains, velocities, lasts, last_speeds, contacts, counts, firsts = states[:7]
        energies, steps, untils, statuses = states[7:]
        kept, trial, near, near_trial, masses, window = scratch
        gap = parameters[2]
        for s in range(ledgers.shape[0]):
            if statuses[s] != MOVING:
                continue
            ledger = ledgers[s]
            step = steps[s]
            arrays = (
                (strains[s], velocities[s]),
                (lasts[s], last_speeds[s]),
                kept,
                trial,
                near,
                near_trial,
                contacts[s],
                masses,
                window,
            )
            while True:
                now = ledger.steps * step
                if now >= untils[s]:
                    statuses[s] = DUE
                    break
                since = 0.0
                if ledger.contacts + counts[s] > 0:
                    since = _LATER_LOOKS * (now - ledger.parted)
                look = min(now + max(_FIRST_LOOK * bounds.interval, since), untils[s])
                goal = max(ledger.steps + 1, int(np.ceil(look / step)))
                status = advance(ledger, arrays, goal, step, fractions, parameters)
                if counts[s] == 0 and ledger.contacts > 0:
                    firsts[s] = contacts[s, 0, 0]
                if status == loop.FULL:
                    # Only how many there were is asked for.
                    counts[s] += ledger.contacts
                    ledger.contacts = 0
                    continue
                if status != loop.DONE:
                    statuses[s] = UNRESOLVED
                    break
                if ledger.contacts + counts[s] == 0 or ledger.parted > now:
                    continue
                if over(strains[s], velocities[s], gap + 1, energies[s], bounds):
                    statuses[s] = PROVED
                    break

    return carry
