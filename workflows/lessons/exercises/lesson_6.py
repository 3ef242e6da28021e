"""Lesson 6: the forces of a chain, what contacts alone tell, and orders."""

from functools import cache
from typing import Any

import numpy as np

from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.workflows.engines.compositions import COMPOSITIONS
from chaincor.workflows.lessons.exercise import Exercise, Mistake
from chaincor.workflows.lessons.exercises.in_house import in_house

_HALF = "half of the forces are missing: each bond acts on the particles at both its ends"


def _bond_force(strains: Array) -> Array:
    return LennardJones().force(strains)


def _acceleration(u: Array) -> Array:
    force = _bond_force(np.diff(u))
    return np.append(-force, 0.0) + np.append(0.0, force)


def _ring(u: Array) -> Array:
    force = _bond_force(np.roll(u, -1) - u)
    return np.roll(force, 1) - force


@cache
def _chain() -> Any:
    return in_house(potential="lj", particles=20, speed=0.4)


def _contacts() -> tuple[Array, int, float]:
    return _chain().contact_speeds, _chain().particles, _chain().velocity


def _eta_of_contacts(speeds: Array, n: int, v0: float) -> float:
    return float(restitution(np.full(n, 2.0 * np.sum(speeds) / n - v0), v0))


def _gain() -> float:
    return 2.0 ** COMPOSITIONS["order8"].order


EXERCISES = {
    1: Exercise(
        "a function of the displacements u that returns the accelerations of an lj chain; its "
        "bond gives the force as LennardJones().force(strains)",
        _acceleration,
        (
            Mistake(
                lambda u: -_acceleration(u),
                "the sign of the force: a compressed bond pushes its left particle to the left",
            ),
            Mistake(_ring, "the first particle is joined to the last: this is a ring"),
            Mistake(lambda u: np.append(-_bond_force(np.diff(u)), 0.0), _HALF),
            Mistake(lambda u: np.append(0.0, _bond_force(np.diff(u))), _HALF),
            Mistake(
                lambda u: np.append(-np.diff(-u), 0.0) + np.append(0.0, np.diff(-u)),
                "these are springs; take the force of the bond",
            ),
        ),
        tolerance=1e-9,
        arguments=lambda: (0.02 * np.cos(np.arange(6.0) ** 2),),
    ),
    2: Exercise(
        "a function of the contact speeds, n and v0 that returns eta",
        _eta_of_contacts,
        (
            Mistake(
                lambda s, n, v0: (np.sum(s) / (n * v0) - 1.0) ** 2,
                "a contact turns v into -v, and so gives the momentum 2 v, not v",
            ),
            Mistake(
                lambda s, n, v0: (2.0 * np.sum(s) / (n * v0)) ** 2,
                "this is all that the wall gave; the chain came with -n v0 of its own",
            ),
            Mistake(
                lambda s, n, v0: 2.0 * np.sum(s) / (n * v0) - 1.0,
                "this is e, the ratio of speeds; eta is its square",
            ),
            Mistake(
                lambda s, n, v0: (2.0 * np.sum(s) / (n * v0) + 1.0) ** 2,
                "the sign: the chain comes with -v0",
            ),
            Mistake(
                lambda s, n, v0: np.sum(s**2) / (n * v0**2),
                "the wall gives momentum and no energy: add momenta, and square at the end",
            ),
        ),
        tolerance=1e-6,
        arguments=_contacts,
    ),
    3: Exercise(
        "one number: how many times smaller the error of a method of order 8 gets at half the step",
        _gain,
        (
            Mistake(lambda: 8.0, "8 is the exponent: 2^8"),
            Mistake(lambda: 16.0, "the order is an exponent: 2^8, not 2 x 8"),
            Mistake(lambda: 64.0, "the other way round: 2^8, not 8^2"),
            Mistake(
                lambda: 1.0 / _gain(), "this is the error itself; asked is how many times less"
            ),
            Mistake(lambda: 4.0, "that would be order 2, as Verlet has"),
        ),
    ),
}
