"""Lesson 3: orders of error, the time of an impact, and error bars from two runs."""

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.compositions import COMPOSITIONS
from chaincor.workflows.lessons.exercise import Exercise, Mistake

_DIFFERENCE = 3e-4


def _order() -> int:
    return COMPOSITIONS["verlet"].order


def _share() -> float:
    """Return the error of the finer run as a share of the difference of two."""
    return 1.0 / (2.0 ** _order() - 1.0)


def _impact(x: Array, v: Array, a: Array) -> Array:
    """Return the first positive root of x + v s + a s^2/2, for x > 0 > v."""
    return 2.0 * x / (-v + np.sqrt(v**2 - 2.0 * a * x))


def _later_root(x: Array, v: Array, a: Array) -> Array:
    return (-v + np.sqrt(v**2 - 2.0 * a * x)) / a


EXERCISES = {
    1: Exercise(
        "one number: the order of the event wall, the slope in the doubly logarithmic picture",
        _order,
        (
            Mistake(
                lambda: -_order(),
                "the slope against 1/h: against the step h the error rises, and the order is "
                "positive",
            ),
            Mistake(lambda: 1.0, "order 1 is what the stock wall has at best; fit the event wall"),
            Mistake(
                lambda: 2.0 ** _order(),
                "this is the factor that halving the step gains; the order is its logarithm to "
                "base 2",
            ),
            Mistake(
                lambda: _order() * np.log(10.0),
                "one axis is in log and the other in log10: use one of them for both",
            ),
        ),
        # Errors of the wall scatter about the line; what a fit to seven steps gives.
        tolerance=0.13,
    ),
    2: Exercise(
        "one number: how many times smaller the error gets when the step is halved three times",
        lambda: 2.0 ** (3 * _order()),
        (
            Mistake(lambda: 8.0, "that would be order 1: a step 8 times smaller, 8 times better"),
            Mistake(lambda: 4.0, "this is one halving; there are three, and factors multiply"),
            Mistake(lambda: 12.0, "factors multiply: 4 x 4 x 4, not 4 + 4 + 4"),
            Mistake(lambda: 6.0, "2 and 3 are exponents: 2^(2 x 3)"),
            Mistake(lambda: 512.0, "that would be order 3; Verlet is of order 2"),
        ),
    ),
    3: Exercise(
        "a function of x, v and a that returns the time to the wall at x = 0, for x > 0 > v",
        _impact,
        (
            Mistake(
                lambda x, v, a: -x / v,
                "this is free flight: the chain pushes, and without a s^2/2 the step does not end "
                "at the wall",
            ),
            Mistake(
                lambda x, v, a: 2.0 * x / (-v + np.sqrt(v**2 - 4.0 * a * x)),
                "the half of a s^2/2 is forgotten",
            ),
            Mistake(
                lambda x, v, a: 2.0 * x / (-v + np.sqrt(v**2 + 2.0 * a * x)),
                "the sign of a: where the wall is, x + v s + a s^2/2 = 0",
            ),
            Mistake(
                lambda x, v, a: 2.0 * x / (v - np.sqrt(v**2 - 2.0 * a * x)),
                "this is a time in the past: v is negative, so take -v",
            ),
            Mistake(
                _later_root,
                "this is the other root: the particle would come back to the wall from behind",
            ),
        ),
        tolerance=1e-6,
        arguments=lambda: (
            np.array([0.002, 0.003, 0.004]),
            np.array([-0.05, -0.06, -0.1]),
            np.array([0.2, -0.3, 0.4]),
        ),
    ),
    4: Exercise(
        f"one number: the error of the finer of two runs that differ by {_DIFFERENCE:g}",
        lambda: _DIFFERENCE * _share(),
        (
            Mistake(
                lambda: _DIFFERENCE,
                "the difference bounds the coarser run; the finer one is nearer to the truth",
            ),
            Mistake(
                lambda: _DIFFERENCE / 4.0,
                "4 is the ratio of the two errors; the difference is 3 errors of the finer run",
            ),
            Mistake(
                lambda: _DIFFERENCE * 4.0 / 3.0,
                "this is how far off the coarser run is",
            ),
            Mistake(
                lambda: _DIFFERENCE / 15.0,
                "15 belongs to order 4: 2^4 - 1",
            ),
            Mistake(
                lambda: _DIFFERENCE / 2.0,
                "half the step is not half the error: of order 2 it is a quarter",
            ),
        ),
        tolerance=0.02,
    ),
}
