"""Lesson 5: v* and what depends on it."""

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import LennardJones, Power, Toda
from chaincor.workflows.lessons.exercise import Exercise, Mistake
from chaincor.workflows.lessons.exercises.in_house import in_house

_SPEED = 0.8


def _v_star(bond: Potential) -> float:
    assert bond.natural_speed is not None  # of the bonds below, which are no springs
    return bond.natural_speed


def _toda() -> Toda:
    return Toda(5.0)


def _per_particle(speed: float) -> float:
    return in_house(1e-6, potential="lj", particles=100, speed=speed).contacts / 100


def _power_ratio() -> float:
    return _v_star(Power(4, 300.0)) / _v_star(Power(4, 3.0))


EXERCISES = {
    1: Exercise(
        "one number: v* of a Toda bond with b = 5",
        lambda: _v_star(_toda()),
        (
            Mistake(
                lambda: _v_star(_toda()) / np.sqrt(2.0),
                "a factor: the kinetic energy is v^2/2, so v* = sqrt(2 U)",
            ),
            Mistake(
                lambda: 0.5 * _v_star(_toda()) ** 2,
                "this is the energy U(x*); v* is the speed that has it: sqrt(2 U)",
            ),
            Mistake(
                lambda: _v_star(_toda()) ** 2,
                "the square root is forgotten: v*^2 = 2 U(x*)",
            ),
            Mistake(lambda: _v_star(Toda()), "this is b = 10"),
            Mistake(
                lambda: 0.5 * _v_star(Toda()),
                "the other way: a smaller b is a softer bond, which is a spring for longer",
            ),
        ),
    ),
    2: Exercise(
        f"one number: the velocity, in bond lengths per time, of an lj chain at {_SPEED} v*",
        lambda: _SPEED * _v_star(LennardJones()),
        (
            Mistake(lambda: _SPEED, "this is in units of v*: multiply by v* of the bond"),
            Mistake(
                lambda: _SPEED / _v_star(LennardJones()),
                "multiply by v*: a speed of 1 v* is the velocity v*",
            ),
            Mistake(lambda: _SPEED * _v_star(Toda()), "this is v* of the Toda bond"),
            Mistake(
                lambda: 0.5 * (_SPEED * _v_star(LennardJones())) ** 2,
                "this is an energy; asked is the velocity",
            ),
            Mistake(lambda: _v_star(LennardJones()), "this is 1 v*"),
        ),
    ),
    3: Exercise(
        "one number: by which factor v* of a power bond of order 4 changes when c is a hundred "
        "times as large",
        _power_ratio,
        (
            Mistake(
                lambda: 1.0 / _power_ratio(),
                "the other way: the larger c, the sooner the bond stops being a spring",
            ),
            Mistake(
                lambda: 100.0**-0.25,
                "the exponent is -1/(r - 2), not -1/r: the quartic energy is compared with the "
                "quadratic one",
            ),
            Mistake(lambda: 0.01, "v* does not go as 1/c: the exponent is -1/(r - 2), r = 4"),
            Mistake(
                lambda: 1.0,
                "v* depends on c; only eta at a given number of v* does not",
            ),
        ),
    ),
    4: Exercise(
        "two numbers: contacts per particle of an lj chain of 100 at 0.1 v* and at 2 v*",
        lambda: [_per_particle(0.1), _per_particle(2.0)],
        (
            Mistake(
                lambda: [100 * _per_particle(0.1), 100 * _per_particle(2.0)],
                "these are all contacts: divide by the number of particles",
            ),
            Mistake(
                lambda: [_per_particle(2.0), _per_particle(0.1)],
                "the two are exchanged: fast chains are like hard balls, of which each hits once",
            ),
            Mistake(
                lambda: [1.0, 1.0],
                "1 is right for hard balls; a slow chain of springs is at the wall less often",
            ),
            Mistake(
                lambda: [_per_particle(0.1), _per_particle(0.1)],
                "the number does depend on the speed: at 2 v* bonds are like hard balls",
            ),
        ),
        tolerance=6e-3,
    ),
}
