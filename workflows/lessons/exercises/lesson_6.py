"""Define answers and usual mistakes of lesson 6: forces, contacts, orders of convergence."""

import numpy as np

from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.schemes import COMPOSITIONS
from chaincor.workflows.lessons.exercise import RIGHT, exercise
from chaincor.workflows.lessons.exercises import by_reference
from chaincor.workflows.lessons.judging import Answers

_HALF = "half of the forces are missing: each bond acts on the particles at both ends"


def _contacts() -> tuple[Array, int, float]:
    chain = by_reference(potential="lj", particles=20, speed=0.4)
    return chain.contact_speeds, chain.particles, chain.velocity


@exercise(
    "a function of the displacements u that returns the accelerations of an lj chain; its "
    "bond gives the force as LennardJones().force(strains)",
    tolerance=1e-9,
    arguments=lambda: (0.02 * np.cos(np.arange(6.0) ** 2),),
)
def _exercise_1(u: Array) -> Answers:
    bond = LennardJones()
    force, around = bond.force(np.diff(u)), bond.force(np.roll(u, -1) - u)
    left, right = np.append(-force, 0.0), np.append(0.0, force)
    yield left + right, RIGHT
    yield (
        -left - right,
        "the sign of the force is wrong: a compressed bond pushes its left particle to the left",
    )
    yield np.roll(around, 1) - around, "this is a ring: the first particle is joined to the last"
    yield left, _HALF
    yield right, _HALF
    yield (
        np.append(-np.diff(-u), 0.0) + np.append(0.0, np.diff(-u)),
        "this is the force of springs; take the force of the lj bond",
    )


@exercise(
    "a function of the contact speeds, n and v0 that returns eta",
    tolerance=1e-3,
    arguments=_contacts,
)
def _exercise_2(speeds: Array, n: int, v0: float) -> Answers:
    given = 2.0 * np.sum(speeds) / (n * v0)
    yield restitution(np.full(n, v0 * given - v0), v0), RIGHT
    yield (
        (0.5 * given - 1.0) ** 2,
        "a contact changes v into -v, so it gives the momentum 2 v, not v",
    )
    yield (
        given**2,
        "this squares the momentum that the wall gave; add the initial momentum -n v0 "
        "before you square",
    )
    yield given - 1.0, "this is e, the ratio of speeds; eta = e^2"
    yield (given + 1.0) ** 2, "the sign is wrong: the chain comes with the velocity -v0"
    yield (
        np.sum(speeds**2) / (n * v0**2),
        "the wall gives momentum, but no energy: add the momenta, then square the sum",
    )


@exercise(
    "one number: how many times smaller the error of a method of order 8 gets at half the step",
    tolerance=2e-3,
    factor="smaller",
)
def _exercise_3() -> Answers:
    gain = 2.0 ** COMPOSITIONS["order8"].order
    yield gain, RIGHT
    yield 8.0, "8 is the exponent: the factor is 2^8"
    yield 10.0, "in Python, 2^8 is 10: write the power as 2**8"
    yield 16.0, "the order is an exponent: the factor is 2^8, not 2 x 8"
    yield 64.0, "base and exponent are exchanged: the factor is 2^8, not 8^2"
    yield (
        1.0 / gain,
        "this is the ratio of the errors; the question asks how many times smaller the error gets",
    )
    yield 4.0, "this is a method of order 2, such as Verlet"
