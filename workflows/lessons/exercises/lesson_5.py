"""Define answers and usual mistakes of lesson 5: the unit of speed v*."""

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import LennardJones, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.workflows.lessons.exercise import RIGHT, exercise
from chaincor.workflows.lessons.exercises import by_reference
from chaincor.workflows.lessons.judging import Answers

_SPEED = 0.8


def _v_star(bond: Potential) -> float:
    assert bond.natural_speed is not None  # The bonds below are anharmonic, so their v* exists.
    return bond.natural_speed


@exercise("one number: v* of a Toda bond with b = 5")
def _exercise_1() -> Answers:
    v_star, other = _v_star(Toda(5.0)), _v_star(Toda())
    yield v_star, RIGHT
    yield (
        v_star / np.sqrt(2.0),
        "a factor is missing: the kinetic energy is v^2/2, so v* = sqrt(2 U)",
    )
    yield (
        0.5 * v_star**2,
        "this is the energy U(x*); v* is the speed with this kinetic energy: sqrt(2 U)",
    )
    yield v_star**2, "the square root is missing: v*^2 = 2 U(x*)"
    yield other, "this is v* for b = 10"
    yield _v_star(LennardJones()), "this is v* of the Lennard-Jones bond"
    yield (
        0.5 * other,
        "v* does not grow with b: the stiffness is 1 for every b, and a bond of "
        "smaller b acts as a spring over a longer range",
    )


@exercise(f"one number: the velocity, in bond lengths per time, of an lj chain at {_SPEED} v*")
def _exercise_2() -> Answers:
    v_star = _v_star(LennardJones())
    yield _SPEED * v_star, RIGHT
    yield _SPEED, "this is in units of v*: multiply by v* of the bond"
    yield _SPEED / v_star, "do not divide by v*: multiply by it"
    yield _SPEED * _v_star(Toda()), "this is the velocity of a Toda chain"
    yield 0.5 * (_SPEED * v_star) ** 2, "this is an energy; the question asks for the velocity"
    yield v_star, "this is the velocity at 1 v*; multiply it by 0.8"


@exercise(
    "one number: by which factor v* of a power bond of order 4 changes when c is a hundred "
    "times as large",
    factor="remaining",
)
def _exercise_3() -> Answers:
    ratio = _v_star(Power(4, 300.0)) / _v_star(Power(4, 3.0))
    yield ratio, RIGHT
    yield (
        1.0 / ratio,
        "v* decreases: the larger c, the smaller the strain at which the bond stops being a spring",
    )
    yield (
        100.0**-0.25,
        "the exponent is -1/(r - 2), not -1/r: at v* the quartic energy equals the quadratic "
        "energy",
    )
    yield 0.01, "v* is not proportional to 1/c: the exponent is -1/(r - 2) with r = 4"
    yield -0.5, "this is the exponent; the factor is 100^(-1/2)"
    yield 1.0, "v* depends on c; only eta at a given speed in units of v* does not"


@exercise(
    "two numbers: contacts per particle of an lj chain of 100 at 0.1 v* and at 2 v*",
    tolerance=6e-3,
)
def _exercise_4() -> Answers:
    slow, fast = (
        by_reference(1e-6, potential="lj", particles=100, speed=speed).contacts / 100
        for speed in (0.1, 2.0)
    )
    yield [slow, fast], RIGHT
    yield (
        [100 * slow, 100 * fast],
        "these are numbers of contacts: divide them by the number of particles",
    )
    yield (
        [fast, slow],
        "the two numbers are exchanged: at 2 v* bonds act like hard balls, with one "
        "contact per particle",
    )
    yield (
        [1.0, 1.0],
        "1 is right for hard balls; a slow chain of springs touches the wall less often",
    )
    yield [slow, slow], "the number depends on the speed: at 2 v* bonds act like hard balls"
