"""What the rows and digits of a user's bond table leave open of the restitution."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from chaincor.lammps_inputs.bonds.table_bond import SplineBond, TableBond
from chaincor.lammps_inputs.errors import ChaincorError, TableError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.bounded_run import BoundedRun, reason_missed, table_error_of
from chaincor.workflows.accuracy.reference_runs import eta_of
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import stepping

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# Below this share of the tolerance the rows are not looked at more closely.
_NEGLIGIBLE = 0.1
# Altered tables are run with twice the step of the answer, which its bar was proved with; where
# that has no fixed length, with twice this one.
_STEP = 0.05
# How much the change by what lies between rows counts. Slow chains ask the stiffness at one length.
# With rows twice as far apart a spline's stiffness errs eight times more, not sixteen times as its
# force, and by t(1 - t)(1 - 2t) of the place t between two rows: up to twice more than both
# altered tables show, which leave out even and odd rows. Half as much again for faster chains.
_BETWEEN = 3.0
# A standard deviation from six shakes is itself uncertain by a third.
_SHAKEN = 4.0


def with_rows(scene: Scene, bounded_run: BoundedRun, tolerance: float | None) -> BoundedRun:
    """
    Return an answer whose bar for the table holds what a user's rows leave open; else the same.

    It is of the spline through the rows. Raises TableError if no such table can be told from one
    with which the collision cannot be carried out.
    """
    error = rows_error(scene, bounded_run.outcome, tolerance or 0.0)
    if error == 0.0:
        return bounded_run
    found = replace(bounded_run, bar=replace(bounded_run.bar, table=bounded_run.bar.table + error))
    return found if tolerance is None else replace(found, reason=reason_missed(found, tolerance))


def rows_error(scene: Scene, outcome: Outcome, tolerance: float) -> float:
    """
    Return how far eta may be off because a user's table has so many rows and digits.

    `outcome` is of the spline through the rows. Zero for other bonds; raises TableError as
    :func:`with_rows` does.
    """
    bond = scene.bond
    if not isinstance(bond, TableBond):
        return 0.0
    force_error = bond.rows.largest_error(outcome.bond_min - 1.0, outcome.bond_max - 1.0)
    estimate = table_error_of("spline", force_error, scene)
    if estimate <= _NEGLIGIBLE * tolerance:
        return estimate
    numerics = Numerics(scheme="order8", timestep=2.0 * (outcome.timestep or _STEP))
    same = scene.replace(
        engine="reference",
        potential="lj",
        bond_file=None,
        speed=None,
        velocity=scene.impact_velocity,
        tolerance=None,
        arrays=None,
    )
    changes = []
    asked = eta_of(scene, outcome)
    for force in (bond.force_spline, *bond.rows.alternatives()):
        try:
            other = same.replace(potential=_bond_of(force))
            changes.append(eta_of(other, stepping.run(other, numerics)) - asked)
        except ChaincorError as error:
            raise TableError(
                f"the bond table {bond.path!r} has {len(bond.rows.strains)} rows, too few or too "
                f"noisy for this collision: with other rows that fit the same digits it cannot "
                f"be carried out ({error}); expected more rows, or more digits"
            ) from None
    changes = [change - changes[0] for change in changes[1:]]
    between, shaken = np.abs(changes[:2]), np.array(changes[2:])
    return float(_BETWEEN * np.max(between) + _SHAKEN * np.sqrt(np.mean(shaken**2)))


def _bond_of(force: "CubicSpline") -> SplineBond:
    """Return a bond with that force, moved so that it has none at length 1."""
    from scipy.interpolate import CubicSpline

    zeros = force.roots(extrapolate=False)
    zero = float(zeros[np.argmin(np.abs(zeros))])
    # What altered bonds reach beyond the rows they do by little: the outer cubics go on.
    reach = 0.05 * float(force.x[-1] - force.x[0])
    return SplineBond(CubicSpline(force.x - zero, force(force.x)), "altered table", reach)
