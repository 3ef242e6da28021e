"""Define answers and usual mistakes of lesson 3: orders of error, impacts, error bars."""

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.schemes import COMPOSITIONS
from chaincor.workflows.lessons.begin import prepared
from chaincor.workflows.lessons.exercise import RIGHT, exercise
from chaincor.workflows.lessons.judging import Answers

_DIFFERENCE = 3e-4
_ORDER = COMPOSITIONS["verlet"].order


@exercise(
    "one number: the order of the event wall, which is the slope of log(error) against log(step)",
    # The tolerance is large, because the errors at the seven steps scatter about the line.
    tolerance=0.13,
)
def _exercise_1() -> Answers:
    steps, reflect, event = np.loadtxt(
        prepared("timestep_and_wall.csv"), delimiter=",", unpack=True
    )
    fitted, stock = (np.polyfit(np.log(steps), np.log(e), 1)[0] for e in (event, reflect))
    turned = (
        "this is the slope against 1/h; the error rises with the step h, so the order is positive"
    )
    yield _ORDER, RIGHT
    yield -fitted, turned
    yield -float(_ORDER), turned
    yield stock, "this is the slope of the reflect wall; fit the event wall"
    yield 1.0 / fitted, "the axes are exchanged: fit log(error) against log(step)"
    yield np.polyfit(steps, event, 1)[0], "take the logarithms of both: np.log(step), np.log(error)"
    yield (
        np.polyfit(np.log(steps), np.log(event), 1)[1],
        "this is the line's value at log(step) = 0; the slope is the first number of np.polyfit",
    )
    yield 1.0, "the reflect wall has order 1 at best; fit the event wall"
    yield (
        2.0**_ORDER,
        "this is how many times smaller half the step makes the error; the order is "
        "the logarithm of this factor to base 2",
    )
    for mixed in (fitted * np.log(10.0), fitted / np.log(10.0)):
        yield mixed, "one axis is in log and the other in log10: use the same logarithm for both"


@exercise(
    "one number: how many times smaller the error gets when the step is halved three times",
    tolerance=2e-3,
    factor="smaller",
)
def _exercise_2() -> Answers:
    yield 2.0 ** (3 * _ORDER), RIGHT
    yield 8.0, "this is a method of order 1; Verlet is of order 2"
    yield (
        4.0,
        "this is one halving; the factors of three halvings multiply (in Python, 2^6 is 4: write "
        "2**6)",
    )
    yield 7.0, "in Python, 4^3 is 7: write the power as 4**3"
    yield 12.0, "factors multiply: 4 x 4 x 4, not 4 + 4 + 4"
    yield 6.0, "the order 2 and the three halvings are exponents: 2^(2 x 3)"
    yield 512.0, "this is a method of order 3; Verlet is of order 2"


@exercise(
    "a function of x, v and a that returns the time to the wall at x = 0, for x > 0 > v",
    tolerance=1e-3,
    elementwise=True,
    arguments=lambda: (
        np.array([0.002, 0.003, 0.004]),
        np.array([-0.05, -0.06, -0.1]),
        np.array([0.2, -0.3, 0.4]),
    ),
)
def _exercise_3(x: Array, v: Array, a: Array) -> Answers:
    root = np.sqrt(v**2 - 2.0 * a * x)
    yield 2.0 * x / (-v + root), RIGHT
    yield (
        -x / v,
        "this is free flight; the chain accelerates the particle, so add the term a s^2/2",
    )
    yield 2.0 * x / (-v + np.sqrt(v**2 - 4.0 * a * x)), "the factor 1/2 in a s^2/2 is missing"
    yield (
        2.0 * x / (-v + np.sqrt(v**2 + 2.0 * a * x)),
        "the sign of a is wrong: at the wall, x + v s + a s^2/2 = 0",
    )
    yield 2.0 * x / (v - root), "this time is negative: v is negative, so take -v"
    yield (
        (-v + root) / a,
        "this is the other root, at which the particle would come back from behind the wall",
    )


@exercise(
    f"one number: the error of the finer of two runs that differ by {_DIFFERENCE:g}",
    tolerance=0.02,
    either_sign=True,
)
def _exercise_4() -> Answers:
    yield _DIFFERENCE / (2.0**_ORDER - 1.0), RIGHT
    yield (
        _DIFFERENCE,
        "this is the difference of the two runs; the error of the finer run is smaller",
    )
    yield (
        _DIFFERENCE / 4.0,
        "4 is the ratio of the two errors; the runs differ by 3 times the error of the finer run",
    )
    yield _DIFFERENCE * 4.0 / 3.0, "this is the error of the coarser run"
    yield _DIFFERENCE / 15.0, "15 = 2^4 - 1 belongs to a method of order 4"
    yield (
        _DIFFERENCE / 2.0,
        "half the step leaves a quarter of the error, not half, for a method of order 2",
    )
