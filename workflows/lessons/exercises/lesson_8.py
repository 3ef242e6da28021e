"""Define the exercises of lesson 8: limits, their exponents, and last digits."""

import numpy as np

from chaincor.analysis.theory import hard_sphere_limit
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.lessons.exercise import RIGHT, exercise
from chaincor.workflows.lessons.exercises import by_reference
from chaincor.workflows.lessons.judging import Answers

_LOGS = "one axis is in log and the other in log10: use one of them for both"
_TURNED = "each velocity has to be turned round, and only the first ball meets the wall"
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
    yield -exponent, "the sign: longer chains lose less, so the exponent is negative"
    yield -2.0 / 3.0, "-2/3 is the law of long chains on average; fit what these five give"
    yield (
        _slope(np.log(lost), np.log(lengths)),
        "the axes are exchanged: fit ln(1 - eta) against ln n",
    )
    yield (
        _slope(np.log(lengths), np.log(1.0 - lost)),
        "this fits eta, which tends to 1; the power law is of what is lost, 1 - eta",
    )
    yield _slope(np.log10(lengths), np.log(lost)), _LOGS
    yield _slope(np.log(lengths), np.log10(lost)), _LOGS


@exercise(
    "one number: by which factor the difference of eta to that of springs shrinks from 1e-3 to "
    "1e-5 v*",
    tolerance=0.05,
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
        "it shrinks with the speed, not with its square: the first term beyond the spring "
        "is cubic, and lj bonds have it",
    )
    yield 10.0, "that would be the square root of the speed"
    yield 1.0, "it does shrink: the slower the chain, the more it is one of springs"
    yield 2.0, "this is the number of decades; asked is the factor"


@exercise(
    "two numbers: how often a chain of ten hard balls hits the wall, and how many events there "
    "are in all, with the exchanges among the balls"
)
def _exercise_3() -> Answers:
    limit = hard_sphere_limit(10)
    yield [limit.contacts, limit.events], RIGHT
    yield (
        [10, 45],
        "these are the exchanges among the balls; the contacts with the wall come on top",
    )
    yield [10, 100], "each pair exchanges velocities once, not twice"
    yield [1, 10], _TURNED
    yield [1, 55], _TURNED
    yield [10, 20], "count the pairs: n(n - 1)/2 of them exchange"


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
        "this is the distance near 1; it doubles at every power of 2, and 99 lies above 64",
    )
    yield near_one, "this is the distance near 1, and not yet compared with the displacement"
    yield spacing, "this is the distance itself; divide by the displacement"
    yield (
        _PLACE * near_one / _DISPLACEMENT,
        "nearly: the distance does not grow with every number but doubles at 64 and then at 128",
    )
    yield (
        np.spacing(np.float32(_PLACE)) / _DISPLACEMENT,
        "this is single precision; LAMMPS computes in double",
    )
