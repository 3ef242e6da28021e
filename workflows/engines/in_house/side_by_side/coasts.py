"""Coarse flights of many chains, one after the other without Python in between."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def build_coasts(coast: Callable) -> Callable:
    """
    Return the loop over chains.

    Parameters
    ----------
    coast : callable
        See ``motion``; known to the compiler.

    Returns
    -------
    callable
        ``coasts(ledgers, strains, velocities, counts, steps, clearances, done, parameters)``:
        lets each chain, a row of the arrays, take so many coarse steps while it keeps so clear of
        the wall; `done` is how many it took.
    """

    def coasts(
        ledgers: Any,
        strains: Array,
        velocities: Array,
        counts: NDArray[np.int64],
        steps: Array,
        clearances: Array,
        done: NDArray[np.int64],
        parameters: Any,
    ) -> None:
        for k in range(counts.shape[0]):
            glide = (counts[k], steps[k], clearances[k], True, True)
            done[k] = coast(ledgers[k], (strains[k], velocities[k]), glide, parameters)

    return coasts
