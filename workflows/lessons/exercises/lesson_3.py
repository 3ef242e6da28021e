"""Define the exercises of lesson 3: orders of error, time of an impact, error bars of two runs."""

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.compositions import COMPOSITIONS
from chaincor.workflows.lessons.begin import prepared
from chaincor.workflows.lessons.exercise import RIGHT, exercise
from chaincor.workflows.lessons.judging import Answers

_DIFFERENCE = 3e-4
_ORDER = COMPOSITIONS["verlet"].order


@exercise(
    "one number: the order of the event wall, the slope in the doubly logarithmic picture",
    # The tolerance is large, because the errors at the seven steps scatter about the line.
    tolerance=0.13,
)
def _exercise_1() -> Answers:
    steps, reflect, event = np.loadtxt(
        prepared("timestep_and_wall.csv"), delimiter=",", unpack=True
    )
    fitted, stock = (np.polyfit(np.log(steps), np.log(e), 1)[0] for e in (event, reflect))
    turned = "the slope against 1/h: against the step h the error rises, and the order is positive"
    yield _ORDER, RIGHT
    yield -fitted, turned
    yield -float(_ORDER), turned
    yield stock, "this is the slope of the reflect wall; fit the event wall"
    yield 1.0, "the stock wall has order 1 at best; fit the event wall"
    yield (
        2.0**_ORDER,
        "this is the factor that halving the step gains; the order is its logarithm to base 2",
    )
    for mixed in (fitted * np.log(10.0), fitted / np.log(10.0)):
        yield mixed, "one axis is in log and the other in log10: use one of them for both"


@exercise("one number: how many times smaller the error gets when the step is halved three times")
def _exercise_2() -> Answers:
    yield 2.0 ** (3 * _ORDER), RIGHT
    yield 8.0, "that would be order 1: a step 8 times smaller, 8 times better"
    yield 4.0, "this is one halving; there are three, and factors multiply"
    yield 12.0, "factors multiply: 4 x 4 x 4, not 4 + 4 + 4"
    yield 6.0, "2 and 3 are exponents: 2^(2 x 3)"
    yield 512.0, "that would be order 3; Verlet is of order 2"


@exercise(
    "a function of x, v and a that returns the time to the wall at x = 0, for x > 0 > v",
    tolerance=1e-6,
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
        "this is free flight: the chain pushes, and without a s^2/2 the step does not end "
        "at the wall",
    )
    yield 2.0 * x / (-v + np.sqrt(v**2 - 4.0 * a * x)), "the half of a s^2/2 is forgotten"
    yield (
        2.0 * x / (-v + np.sqrt(v**2 + 2.0 * a * x)),
        "the sign of a: where the wall is, x + v s + a s^2/2 = 0",
    )
    yield 2.0 * x / (v - root), "this is a time in the past: v is negative, so take -v"
    yield (
        (-v + root) / a,
        "this is the other root: the particle would come back to the wall from behind",
    )


@exercise(
    f"one number: the error of the finer of two runs that differ by {_DIFFERENCE:g}",
    tolerance=0.02,
)
def _exercise_4() -> Answers:
    yield _DIFFERENCE / (2.0**_ORDER - 1.0), RIGHT
    yield (
        _DIFFERENCE,
        "this is about the error of the coarser run; the finer one is nearer to the exact number",
    )
    yield (
        _DIFFERENCE / 4.0,
        "4 is the ratio of the two errors; the difference is 3 errors of the finer run",
    )
    yield _DIFFERENCE * 4.0 / 3.0, "this is how far off the coarser run is"
    yield _DIFFERENCE / 15.0, "15 belongs to order 4: 2^4 - 1"
    yield _DIFFERENCE / 2.0, "half the step is not half the error: of order 2 it is a quarter"
