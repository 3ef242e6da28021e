"""Define the exercises of lesson 7: sweeps, their cost and their contents."""

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


@exercise("two numbers: how many collisions are computed, and how many are in the store then")
def _exercise_1() -> Answers:
    new = len(_LENGTHS) * _SPEEDS.size
    old = 2 * new
    yield [new, old + new], RIGHT
    yield [old + new, old + new], "what is in the store is not computed again"
    yield [new, new], "the collisions that were there stay in the store"
    yield [new, old], "the new ones go into the same store"
    yield (
        [_SPEEDS.size, old + _SPEEDS.size],
        "axes are crossed: a new potential meets each length, not one",
    )
    yield [1, old + 1], "one value of an axis is many collisions"


@exercise(
    "one number: the speed, in units of v*, at which eta of an lj chain of 40 is least, to 0.02",
    tolerance=0.02,
)
def _exercise_2() -> Answers:
    fine = np.round(np.arange(0.8, 1.21, 0.02), 2)
    etas = _etas("lj", 40, fine)
    yield fine[np.argmin(etas)], RIGHT
    yield etas.min(), "this is eta at the minimum; asked is the speed"
    yield (
        _SPEEDS[np.argmin(_etas("lj", 40, _SPEEDS))],
        "this is the nearest point of the coarse sweep; refine it there",
    )
    yield 0.8, "eta of longer chains, n = 100 and more, is least here"
    yield 2.0, "the end of the axis: look for the least eta, not the largest"


@exercise(
    "one number: how many times longer a chain of 80 takes to compute than one of 40, at the "
    "same step",
    tolerance=0.05,
)
def _exercise_3() -> Answers:
    yield _cost(80) / _cost(40), RIGHT
    yield (
        2.0,
        "twice the particles, but the collision lasts twice as long as well: sound has "
        "twice as far to go",
    )
    yield 8.0, "twice the particles and twice the time: two factors, not three"
    yield 1.0, "each particle has a force of its own to be computed"
    yield 16.0, "bonds join neighbours only: a chain has n - 1 of them, not n^2"


@exercise(
    "one number: the largest difference of eta, without sign, between lj and toda in the sweep",
    tolerance=0.01,
)
def _exercise_4() -> Answers:
    differences = np.array([_etas("lj", n, _SPEEDS) - _etas("toda", n, _SPEEDS) for n in _LENGTHS])
    yield np.abs(differences).max(), RIGHT
    yield differences.min(), "this is the least with its sign; asked is the largest without"
    yield np.abs(differences).mean(), "this is the mean; asked is the largest"
    yield np.abs(differences[-1]).max(), "this is for 40 particles only; there are three lengths"
