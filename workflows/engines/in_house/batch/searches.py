"""
Searches for contacts side by side, one in each lane, each as ``contact_search`` does it alone.

A search is a row of steps of the particles near the wall, the size of each told by those before.
One chain's are too few numbers for the vector units of a processor, so that a search takes as long
as several steps of a whole chain of twenty; so searches wait until lanes are filled.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house.batch.lanes import LANES
from chaincor.workflows.engines.in_house.contact_search import (
    MOST_ITERATIONS,
    NARROWEST,
    PathPoint,
    count_sign_changes,
    first_root,
    fit_path,
    narrow,
)

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

# What the next point of a path is for: the end of the step, a part of the step, the zero.
LOOK, CUT, REFINE = range(3)


class Searches(NamedTuple):
    """
    Where searches stand.

    Attributes
    ----------
    whose : ndarray of shape (L,)
        Which chain; -1 for none.
    stage : ndarray of shape (L,)
        What the next point is for.
    steps, low, high, width : ndarray of shape (L,)
        The step, and the part of it that is looked at.
    time : ndarray of shape (L,)
        When the next point is; in the end that of the contact, or -1.
    moves : ndarray of shape (L,)
        How often the zero was refined.
    start, end : ndarray of shape (3, L)
        Position, velocity and acceleration of particle 1 where that part begins, and at the end of
        the step.
    """

    whose: Counts
    stage: Counts
    steps: Array
    low: Array
    high: Array
    width: Array
    time: Array
    moves: Counts
    start: Array
    end: Array

    @classmethod
    def of(cls) -> "Searches":
        """Return room for one in each lane."""
        whose, stage, moves = (
            np.full(LANES, -1),
            np.zeros(LANES, np.int64),
            np.zeros(LANES, np.int64),
        )
        steps, low, high, width, time = (np.zeros(LANES) for _ in range(5))
        points = np.zeros((3, LANES)), np.zeros((3, LANES))
        return cls(whose, stage, steps, low, high, width, time, moves, *points)


def build_search(register: Callable) -> tuple[Callable, Callable]:
    """
    Return how a search begins, and how it goes on.

    Parameters
    ----------
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    begin : callable
        ``begin(k, searches, step, start)``: the search within a step, by its end.
    go_on : callable
        ``go_on(k, searches, point)``: with the point that was asked for; returns whether it is
        over.
    """
    count_changes = register(count_sign_changes)
    guess_path = register(fit_path)
    guess_root = register(first_root)
    narrow_down = register(narrow)

    @register
    def begin(k: int, searches: Searches, step: float, start: PathPoint) -> None:
        searches.stage[k], searches.moves[k] = LOOK, 0
        searches.low[k], searches.width[k], searches.steps[k] = 0.0, step, step
        searches.high[k] = searches.time[k] = step
        for i in range(3):
            searches.start[i, k] = start[i]

    @register
    def cut(k: int, searches: Searches, point: PathPoint) -> bool:
        # As `find_contact` does, from where it has the point at the end of a part.
        step, after = searches.steps[k], point
        low, high = searches.low[k], searches.high[k]
        before = (searches.start[0, k], searches.start[1, k], searches.start[2, k])
        end = (searches.end[0, k], searches.end[1, k], searches.end[2, k])
        while True:
            width = high - low
            changes = count_changes(before, after, width)
            if changes > 1 and width > NARROWEST * step:
                width *= 0.5
            elif changes == 1 or (after[0] <= 0.0 and after[1] < 0.0):
                guess = low + width * guess_root(guess_path(before, after, width), 1.0)
                searches.low[k], searches.high[k], searches.stage[k] = low, high, REFINE
                searches.time[k] = guess if low < guess < high else 0.5 * (low + high)
                return False
            else:
                low, width, before = high, 2.0 * width, after
                if not low < step:
                    searches.time[k] = -1.0
                    return True
            high = low + width
            if high < step:
                searches.low[k], searches.high[k], searches.time[k] = low, high, high
                for i in range(3):
                    searches.start[i, k] = before[i]
                return False
            high, after = step, end

    @register
    def refine(k: int, searches: Searches, point: PathPoint) -> bool:
        low, high, time, settled = narrow_down(
            searches.low[k], searches.high[k], searches.time[k], point
        )
        searches.low[k], searches.high[k], searches.time[k] = low, high, time
        searches.moves[k] += 1
        return settled or searches.moves[k] == MOST_ITERATIONS

    @register
    def go_on(k: int, searches: Searches, point: PathPoint) -> bool:
        if searches.stage[k] == REFINE:
            return refine(k, searches, point)
        if searches.stage[k] == LOOK:
            searches.stage[k] = CUT
            for i in range(3):
                searches.end[i, k] = point[i]
        return cut(k, searches, point)

    return begin, go_on
