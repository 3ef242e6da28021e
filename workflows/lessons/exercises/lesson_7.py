"""Define answers and usual mistakes of lesson 7: sweeps, their cost and their stores."""

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.lessons.exercise import RIGHT, exercise
from chaincor.workflows.lessons.exercises import by_reference
from chaincor.workflows.lessons.judging import Answers

_LENGTHS = (10, 20, 40)
_SPEEDS = np.linspace(0.1, 2.0, 12)


def _etas(potential: str, particles: int, speeds: Array) -> Array:
    scene = {"potential": potential, "particles": particles}
    return np.array([by_reference(1e-6, **scene, speed=float(v)).restitution for v in speeds])


def _cost(particles: int) -> float:
    # The cost is proportional to the number of particles times the number of steps. The number of
    # steps is proportional to the duration.
    chain = by_reference(1e-6, potential="lj", particles=particles, speed=0.4)
    return particles * chain.last_contact_time


@exercise("two numbers: how many collisions are computed, and how many the store then holds")
def _exercise_1() -> Answers:
    new = len(_LENGTHS) * _SPEEDS.size
    old = 2 * new
    yield [new, old + new], RIGHT
    yield [old + new, old + new], "collisions in the store are not computed again"
    yield [new, new], "earlier collisions stay in the store"
    yield [new, old], "the new collisions go into the same store"
    yield (
        [_SPEEDS.size, old + _SPEEDS.size],
        "axes are combined: the new potential is computed with each length, not with one",
    )
    yield [1, old + 1], "each value of an axis adds many collisions"


@exercise(
    "one number: the speed, in units of v*, at which eta of an lj chain of 40 is least, to 0.02",
    tolerance=0.02,
)
def _exercise_2() -> Answers:
    fine = np.round(np.arange(0.8, 1.21, 0.02), 2)
    etas = _etas("lj", 40, fine)
    yield fine[np.argmin(etas)], RIGHT
    yield etas.min(), "this is eta at the minimum; the question asks for the speed"
    yield (
        _SPEEDS[np.argmin(_etas("lj", 40, _SPEEDS))],
        "this is a point of the coarse sweep; refine the sweep near it",
    )
    yield 0.8, "this is right for longer chains, n = 100 and more"
    yield 2.0, "this is the end of the axis; look for the smallest eta"


@exercise(
    "one number: how many times longer a chain of 80 takes to compute than one of 40, at the "
    "same step",
    tolerance=0.05,
)
def _exercise_3() -> Answers:
    yield _cost(80) / _cost(40), RIGHT
    yield (
        2.0,
        "there are twice the particles, but the collision also lasts twice as long: sound "
        "travels twice as far",
    )
    yield 8.0, "two factors multiply, not three: twice the particles and twice the time"
    yield 1.0, "the time grows with the number of forces and with the number of steps"
    yield 16.0, "bonds join neighbours only: a chain has n - 1 bonds, not n^2"


@exercise(
    "one number: the largest difference of eta, without sign, between lj and toda in the sweep",
    tolerance=0.01,
)
def _exercise_4() -> Answers:
    differences = np.array([_etas("lj", n, _SPEEDS) - _etas("toda", n, _SPEEDS) for n in _LENGTHS])
    yield np.abs(differences).max(), RIGHT
    yield (
        differences.min(),
        "this is the smallest difference with its sign; the question asks for the "
        "largest without sign",
    )
    yield (
        np.abs(differences).mean(),
        "this is the mean; the question asks for the largest difference",
    )
    yield (
        np.abs(differences[-1]).max(),
        "this is for 40 particles only; the sweep has three lengths",
    )
