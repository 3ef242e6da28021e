"""Lesson 7: what a sweep computes, what it costs, and what is in it."""

from functools import cache

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.lessons.exercise import Exercise, Mistake
from chaincor.workflows.lessons.exercises.in_house import in_house

_POTENTIALS, _LENGTHS = ("lj", "toda"), (10, 20, 40)
_SPEEDS = np.linspace(0.1, 2.0, 12)
_FINE = np.round(np.arange(0.8, 1.21, 0.02), 2)


@cache
def _etas(potential: str, particles: int, speeds: tuple[float, ...]) -> Array:
    return np.array(
        [
            in_house(1e-6, potential=potential, particles=particles, speed=speed).restitution
            for speed in speeds
        ]
    )


def _slowest(particles: int) -> float:
    return float(_FINE[np.argmin(_etas("lj", particles, tuple(_FINE)))])


def _differences() -> Array:
    speeds = tuple(_SPEEDS.tolist())
    return np.array([_etas("lj", n, speeds) - _etas("toda", n, speeds) for n in _LENGTHS])


def _new() -> int:
    return len(_LENGTHS) * _SPEEDS.size


def _old() -> int:
    return len(_POTENTIALS) * _new()


def _cost(particles: int) -> float:
    # As many steps as the collision is long, each of so many particles.
    return (
        particles * in_house(1e-6, potential="lj", particles=particles, speed=0.4).last_contact_time
    )


EXERCISES = {
    1: Exercise(
        "two numbers: how many collisions are computed, and how many are in the store then",
        lambda: [_new(), _old() + _new()],
        (
            Mistake(
                lambda: [_old() + _new(), _old() + _new()],
                "what is in the store is not computed again",
            ),
            Mistake(
                lambda: [_new(), _new()],
                "the collisions that were there stay in the store",
            ),
            Mistake(lambda: [_new(), _old()], "the new ones go into the same store"),
            Mistake(
                lambda: [_SPEEDS.size, _old() + _SPEEDS.size],
                "axes are crossed: a new potential meets each length, not one",
            ),
            Mistake(lambda: [1, _old() + 1], "one value of an axis is many collisions"),
        ),
    ),
    2: Exercise(
        "one number: the speed, in units of v*, at which an lj chain of 40 keeps least, to 0.03",
        lambda: _slowest(40),
        (
            Mistake(
                lambda: float(_etas("lj", 40, tuple(_FINE)).min()),
                "this is eta at the minimum; asked is the speed",
            ),
            Mistake(
                lambda: float(_SPEEDS[np.argmin(_etas("lj", 40, tuple(_SPEEDS.tolist())))]),
                "this is the nearest point of the coarse sweep; refine it there",
            ),
            Mistake(lambda: 0.8, "this is the minimum of long chains, n = 100 and more"),
            Mistake(lambda: 2.0, "the end of the axis: look for the least eta, not the largest"),
        ),
        tolerance=0.03,
    ),
    3: Exercise(
        "one number: how many times longer a chain of 80 takes to compute than one of 40, at the "
        "same step",
        lambda: _cost(80) / _cost(40),
        (
            Mistake(
                lambda: 2.0,
                "twice the particles, but the collision lasts twice as long as well: sound has "
                "twice as far to go",
            ),
            Mistake(lambda: 8.0, "twice the particles and twice the time: two factors, not three"),
            Mistake(lambda: 1.0, "each particle has a force of its own to be computed"),
            Mistake(
                lambda: 16.0,
                "bonds join neighbours only: a chain has n - 1 of them, not n^2",
            ),
        ),
        tolerance=0.05,
    ),
    4: Exercise(
        "one number: the largest difference of eta, without sign, between lj and toda in the sweep",
        lambda: float(np.abs(_differences()).max()),
        (
            Mistake(
                lambda: float(_differences().min()),
                "this is the least with its sign; asked is the largest without",
            ),
            Mistake(
                lambda: float(np.abs(_differences()).mean()),
                "this is the mean; asked is the largest",
            ),
            Mistake(
                lambda: float(np.abs(_differences()[-1]).max()),
                "this is for 40 particles only; there are three lengths",
            ),
        ),
        tolerance=0.01,
    ),
}
