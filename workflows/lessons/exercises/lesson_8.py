"""Lesson 8: limits, their exponents, and the last digits."""

from functools import cache

import numpy as np

from chaincor.analysis.theory import hard_sphere_limit
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.lessons.exercise import Exercise, Mistake
from chaincor.workflows.lessons.exercises.in_house import in_house

_LOGS = "one axis is in log and the other in log10: use one of them for both"
_TURNED = "each velocity has to be turned round, and only the first ball meets the wall"
_LENGTHS = (125, 250, 500, 1000, 2000)
_PLACE, _DISPLACEMENT = 99.0, 1e-9


@cache
def _lost() -> Array:
    chains = [in_house(potential="harmonic", particles=n, velocity=0.1) for n in _LENGTHS]
    return np.array([1.0 - chain.restitution for chain in chains])


def _slope(x: Array, y: Array) -> float:
    return float(np.polyfit(x, y, 1)[0])


def _exponent() -> float:
    return _slope(np.log(_LENGTHS), np.log(_lost()))


@cache
def _away_from_springs(speed: float) -> float:
    springs = in_house(1e-10, potential="harmonic", particles=100, velocity=0.1)
    slow = in_house(1e-10, potential="lj", particles=100, speed=speed)
    return abs(slow.restitution - springs.restitution)


def _shrinks() -> float:
    return _away_from_springs(1e-3) / _away_from_springs(1e-5)


def _events(n: int = 10) -> list[float]:
    limit = hard_sphere_limit(n)
    return [limit.contacts, limit.exchanges]


EXERCISES = {
    1: Exercise(
        "one number: the exponent p in 1 - eta ~ n^p, fitted to n = 125, 250, 500, 1000, 2000",
        _exponent,
        (
            Mistake(
                lambda: -_exponent(),
                "the sign: longer chains lose less, so the exponent is negative",
            ),
            Mistake(
                lambda: -2.0 / 3.0,
                "this is the law of long chains on average; fit what these five give",
            ),
            Mistake(
                lambda: _slope(np.log(_lost()), np.log(_LENGTHS)),
                "the axes are exchanged: fit ln(1 - eta) against ln n",
            ),
            Mistake(
                lambda: _slope(np.log(_LENGTHS), np.log(1.0 - _lost())),
                "this fits eta, which tends to 1; the power law is of what is lost, 1 - eta",
            ),
            Mistake(lambda: _slope(np.log10(_LENGTHS), np.log(_lost())), _LOGS),
            Mistake(lambda: _slope(np.log(_LENGTHS), np.log10(_lost())), _LOGS),
        ),
        tolerance=0.03,
    ),
    2: Exercise(
        "one number: by which factor the difference of eta to that of springs shrinks from 1e-3 to "
        "1e-5 v*",
        _shrinks,
        (
            Mistake(
                lambda: 1e4,
                "it shrinks with the speed, not with its square: the first term beyond the spring "
                "is cubic, and lj bonds have it",
            ),
            Mistake(lambda: 10.0, "that would be the square root of the speed"),
            Mistake(
                lambda: 1.0, "it does shrink: the slower the chain, the more it is one of springs"
            ),
            Mistake(lambda: 2.0, "this is the number of decades; asked is the factor"),
        ),
        tolerance=0.05,
    ),
    3: Exercise(
        "two numbers: how often a chain of ten hard balls hits the wall, and how many events there "
        "are in all, with the exchanges among the balls",
        _events,
        (
            Mistake(
                lambda: [10, 45],
                "these are the exchanges among the balls; the contacts with the wall come on top",
            ),
            Mistake(
                lambda: [10, 100],
                "each pair exchanges velocities once, not twice",
            ),
            Mistake(lambda: [1, 10], _TURNED),
            Mistake(lambda: [1, 55], _TURNED),
            Mistake(lambda: [10, 20], "count the pairs: n(n - 1)/2 of them exchange"),
        ),
    ),
    4: Exercise(
        f"one number: the distance of neighbouring double-precision numbers near {_PLACE:g}, as a "
        f"share of a displacement of {_DISPLACEMENT:g}",
        lambda: float(np.spacing(_PLACE)) / _DISPLACEMENT,
        (
            Mistake(
                lambda: float(np.finfo(float).eps) / _DISPLACEMENT,
                "this is the distance near 1; it doubles at every power of 2, and 99 lies above 64",
            ),
            Mistake(
                lambda: float(np.finfo(float).eps),
                "this is the distance near 1, and not yet compared with the displacement",
            ),
            Mistake(
                lambda: float(np.spacing(_PLACE)),
                "this is the distance itself; divide by the displacement",
            ),
            Mistake(
                lambda: _PLACE * float(np.finfo(float).eps) / _DISPLACEMENT,
                "nearly: the distance does not grow with every number but doubles at 64 and then "
                "at 128",
            ),
            Mistake(
                lambda: float(np.spacing(np.float32(_PLACE))) / _DISPLACEMENT,
                "this is single precision; LAMMPS computes in double",
            ),
        ),
        tolerance=0.02,
    ),
}
