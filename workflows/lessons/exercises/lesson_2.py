"""Define answers and usual mistakes of lesson 2: forces, slopes and rows of a table."""

from collections.abc import Callable
from functools import cache

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.workflows.lessons.exercise import RIGHT, exercise
from chaincor.workflows.lessons.judging import Answers

_LENGTH = 0.9


def _force(lengths: Array) -> Array:
    return LennardJones().force(np.asarray(lengths) - 1.0)


@cache
def _more_rows(style: str) -> float:
    """Return by which factor the number of rows must grow for a hundred times smaller error."""
    # The exponent follows from the largest errors of the force in two tables, one with twice as
    # many rows as the other.
    between = np.linspace(0.9, 1.1, 4001)
    errors = []
    for rows in (101, 201):
        at = np.linspace(0.9, 1.1, rows)
        errors.append(np.max(np.abs(_interpolate(style, at)(between) - _force(between))))
    return float(100.0 ** (1.0 / np.log2(errors[0] / errors[1])))


def _interpolate(style: str, at: Array) -> Callable[[Array], Array]:
    if style == "linear":
        return lambda lengths: np.interp(lengths, at, _force(at))
    from scipy.interpolate import CubicSpline

    slopes = -LennardJones().curvature(at[[0, -1]] - 1.0)
    return CubicSpline(at, _force(at), bc_type=((1, slopes[0]), (1, slopes[1])))


@exercise(
    "two numbers: how many times more rows a linear table needs for an error a hundred times "
    "smaller, and a spline",
    tolerance=0.03,
)
def _exercise_1() -> Answers:
    yield [_more_rows("linear"), _more_rows("spline")], RIGHT
    yield (
        [100.0, 100.0],
        "this would be right if the error fell as 1/rows; look at the slopes in the picture",
    )
    yield [10.0, 10.0], "the linear table is right; the spline's error falls faster, as 1/rows^4"
    yield (
        [100.0, 1e4],
        "this is how much smaller ten times the rows make the error; the question "
        "asks for the rows",
    )
    yield (
        [100.0**0.25, 10.0],
        "the two numbers are exchanged: the spline needs fewer additional rows",
    )


@exercise(
    "a function of r that returns the force of U = (r^-12 - 2 r^-6 + 1)/72, positive where it "
    "pushes apart",
    tolerance=1e-3,
    elementwise=True,
    arguments=lambda: (np.linspace(0.85, 1.3, 10),),
)
def _exercise_2(r: Array) -> Answers:
    yield _force(r), RIGHT
    yield -_force(r), "the sign of the force: F = -U', and a compressed bond pushes apart, F > 0"
    yield (r**-12 - 2.0 * r**-6 + 1.0) / 72.0, "this is the energy; the force is its negative slope"
    yield 72.0 * _force(r), "the factor 1/72 is forgotten, which makes the stiffness of the bond 1"
    yield (
        (r**-11 - r**-5) / 6.0,
        "differentiation lowers the power by one: r^-12 gives r^-13, not r^-11",
    )
    yield LennardJones().curvature(r - 1.0), "this is U'', differentiated once too often"
    yield 1.0 - r, "this is the force of a spring; it is right only near r = 1"


@exercise(f"one number: the slope that FP gives for the row r = {_LENGTH}")
def _exercise_3() -> Answers:
    slope = -float(LennardJones().curvature(_LENGTH - 1.0))
    force = float(_force(np.array(_LENGTH)))
    yield slope, RIGHT
    yield -slope, "this is U'', the slope of -F; FP gives the slope of the force itself, dF/dr"
    yield force, "this is the force; FP gives the slope of the force, dF/dr"
    yield -force, "this is U', the slope of the energy; FP gives the slope of the force"
    yield 0.0, "this is a force that is flat at the end of the table, the mistake of the broken job"
    yield -1.0, "this is the slope at r = 1, where the stiffness is 1"
