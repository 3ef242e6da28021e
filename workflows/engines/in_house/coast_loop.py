"""The loop over coarse Verlet steps, with which the stepping engine looks ahead."""

from collections.abc import Callable

import numpy as np


def build_coast(stage: Callable, drift: Callable, count_outside: Callable) -> Callable:
    """
    Return the loop over coarse steps.

    Parameters
    ----------
    stage, drift, count_outside : callable
        As in ``stages``.

    Returns
    -------
    callable
        ``coast(ledger, strain, velocity, steps, step, clearance, first, last, parameters)``: takes
        Verlet steps and returns how many, fewer than `steps` where particle 1 comes nearer to the
        wall than `clearance` or a strain is not allowed; the state is half a step off then. It is
        so too between the parts of a flight, unless this is the `first` or the `last` of them.
    """

    def coast(ledger, strain, velocity, steps, step, clearance, first, last, parameters):
        bonds = strain.shape[0]
        ahead = 0.5 * step if first else step  # the drifts of neighbouring steps merge
        for taken in range(steps):
            ledger.wall_distance += ahead * velocity[0]
            stage(strain, velocity, bonds, ahead, step, parameters)
            ahead = step
            ledger.evaluations += 1
            if not ledger.wall_distance > clearance:
                return taken
            if count_outside(strain, bonds, ledger.strain_min, ledger.strain_max) > 0:
                low, high = np.min(strain), np.max(strain)
                ledger.strain_min = min(ledger.strain_min, low)
                ledger.strain_max = max(ledger.strain_max, high)
                if not (low > ledger.strain_floor and high < ledger.strain_ceiling):
                    return taken
        if last:
            ledger.wall_distance += 0.5 * step * velocity[0]
            drift(strain, velocity, bonds, 0.5 * step)
        return steps

    return coast
