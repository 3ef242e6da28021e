"""Define answers and usual mistakes of lesson 8: limits, their exponents, and last digits."""

import numpy as np

from chaincor.analysis.theory import hard_sphere_limit
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.lessons.exercise import RIGHT, exercise
from chaincor.workflows.lessons.exercises import by_reference
from chaincor.workflows.lessons.judging import Answers

_LOGS = "one axis is in log and the other in log10: use the same logarithm for both"
_TURNED = "the velocity of each ball must be reversed, and only the first ball hits the wall"
_PLACE, _DISPLACEMENT = 99.0, 1e-9


def _slope(x: Array, y: Array) -> float:
    return float(np.polyfit(x, y, 1)[0])


@exercise(
    "one number: the exponent p in 1 - eta ~ n^p, fitted to n = 125, 250, 500, 1000, 2000",
    tolerance=0.03,
)
def _exercise_1() -> Answers:
    lengths = np.array([125, 250, 500, 1000, 2000])
    chains = [by_reference(potential="harmonic", particles=int(n), velocity=0.1) for n in lengths]
    lost = np.array([1.0 - chain.restitution for chain in chains])
    exponent = _slope(np.log(lengths), np.log(lost))
    yield exponent, RIGHT
    yield -exponent, "the sign is wrong: longer chains lose less, so the exponent is negative"
    yield -2.0 / 3.0, "-2/3 is the mean law of long chains; fit these five lengths"
    yield (
        _slope(np.log(lost), np.log(lengths)),
        "the axes are exchanged: fit ln(1 - eta) against ln n",
    )
    yield (
        _slope(np.log(lengths), np.log(1.0 - lost)),
        "this fits eta, which tends to 1; the power law holds for the loss, 1 - eta",
    )
    yield _slope(np.log10(lengths), np.log(lost)), _LOGS
    yield _slope(np.log(lengths), np.log10(lost)), _LOGS


@exercise(
    "one number: by which factor the difference of eta to that of springs shrinks from 1e-3 to "
    "1e-5 v*",
    tolerance=0.05,
    factor="smaller",
)
def _exercise_2() -> Answers:
    springs = by_reference(1e-10, potential="harmonic", particles=100, velocity=0.1).restitution
    faster, slower = (
        abs(by_reference(1e-10, potential="lj", particles=100, speed=speed).restitution - springs)
        for speed in (1e-3, 1e-5)
    )
    yield faster / slower, RIGHT
    yield (
        1e4,
        "the difference is proportional to the speed, not to its square: the lj energy has a "
        "cubic term",
    )
    yield (
        10.0,
        "this would be right if the difference were proportional to the square root of the speed",
    )
    yield 1.0, "the difference shrinks: bonds of a slower chain act more like springs"
    yield slower / faster, "this is the reciprocal: the question asks how many times smaller"
    yield 2.0, "this is the number of decades; the question asks for the factor"


@exercise(
    "two numbers: how often a chain of ten hard balls hits the wall, and how many events there "
    "are in all, with the exchanges among the balls"
)
def _exercise_3() -> Answers:
    limit = hard_sphere_limit(10)
    yield [limit.contacts, limit.events], RIGHT
    yield (
        [10, 45],
        "45 counts the exchanges among the balls; add the contacts with the wall",
    )
    yield [10, 100], "each pair exchanges velocities once, not twice"
    yield [1, 10], _TURNED
    yield [1, 55], _TURNED
    yield [10, 20], "count the pairs: each of the n(n - 1)/2 pairs exchanges velocities once"


@exercise(
    f"one number: the distance of neighbouring double-precision numbers near {_PLACE:g}, as a "
    f"share of a displacement of {_DISPLACEMENT:g}",
    tolerance=0.02,
)
def _exercise_4() -> Answers:
    near_one, spacing = np.finfo(float).eps, np.spacing(_PLACE)
    yield spacing / _DISPLACEMENT, RIGHT
    yield (
        near_one / _DISPLACEMENT,
        "this is the distance near 1; it doubles at every power of 2, and 99 is above 64",
    )
    yield near_one, "this is the distance near 1, before division by the displacement"
    yield spacing, "this is the distance itself; divide it by the displacement"
    yield (
        _PLACE * near_one / _DISPLACEMENT,
        "the distance does not grow continuously: it doubles at 64 and again at 128",
    )
    yield (
        np.spacing(np.float32(_PLACE)) / _DISPLACEMENT,
        "this is single precision; LAMMPS computes in double",
    )
