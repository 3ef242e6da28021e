"""Estimate the error of eta from the limited rows and digits of a user's bond table."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from chaincor.lammps_inputs.bonds.table_bond import SplineBond, TableBond
from chaincor.lammps_inputs.errors import ChaincorError, TableError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.bond_range import bonds_from_start
from chaincor.workflows.accuracy.bounded_run import BoundedRun, reason_missed, table_error_of
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import stepping

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# Below this share of the tolerance, the error of the rows is only estimated.
_NEGLIGIBLE = 0.1
# Altered tables are run at this step if the run has no fixed step. Otherwise they use twice the
# step of the run, at which its error bar was proved.
_STEP = 0.05
# Factor on the change of eta from the values between rows. Slow chains depend on the stiffness at
# one length. With rows twice as far apart, the error of a spline's stiffness is eight times larger,
# not sixteen times like the error of its force. It varies as t(1 - t)(1 - 2t) with the place t
# between two rows, up to twice more than both altered tables show, which leave out even and odd
# rows. Half as much more is added for faster chains.
_BETWEEN = 3.0
# The standard deviation of six random changes is multiplied by this factor, because six samples
# leave it uncertain by a third.
_SHAKEN = 4.0


def with_rows(scene: Scene, bounded_run: BoundedRun, tolerance: float | None) -> BoundedRun:
    """
    Return a run whose error bar includes the error of a user's table.

    The run is for the spline through the rows; for other bonds it is returned unchanged. Raises
    TableError if the table cannot be distinguished from a table with which the collision cannot be
    run.
    """
    error = rows_error(scene, bounded_run.outcome, tolerance or 0.0)
    if error == 0.0:
        return bounded_run
    found = replace(bounded_run, bar=replace(bounded_run.bar, table=bounded_run.bar.table + error))
    return found if tolerance is None else replace(found, reason=reason_missed(found, tolerance))


def rows_error(scene: Scene, outcome: Outcome, tolerance: float) -> float:
    """
    Return the error of eta from the limited rows and digits of a user's table.

    `outcome` is for the spline through the rows. The error is zero for other bonds. Raises
    TableError as :func:`with_rows` does.
    """
    bond = scene.bond
    if not isinstance(bond, TableBond):
        return 0.0
    shortest, longest = bonds_from_start(outcome)
    force_error = bond.rows.largest_error(shortest - 1.0, longest - 1.0)
    estimate = table_error_of("spline", force_error, scene.problem)
    if estimate <= _NEGLIGIBLE * tolerance:
        return estimate
    numerics = Numerics(scheme="order8", timestep=2.0 * (outcome.timestep or _STEP))
    same = scene.replace(
        engine="reference",
        potential="lj",
        bond_file=None,
        tolerance=None,
        arrays=None,
        **_given_speed(scene),
    )
    changes = []
    asked = outcome.eta
    for force in (bond.force_spline, *bond.rows.alternatives()):
        try:
            other = same.replace(potential=_bond_of(force)).problem
            changes.append(stepping.run(other, numerics).eta - asked)
        except ChaincorError as error:
            raise TableError(
                f"the bond table {bond.path!r} has {len(bond.rows.strains)} rows, too few or "
                "too noisy for this collision: the collision fails with other rows that fit "
                f"the same digits ({error}). Give more rows, or more digits"
            ) from None
    changes = [change - changes[0] for change in changes[1:]]
    between, shaken = np.abs(changes[:2]), np.array(changes[2:])
    return float(_BETWEEN * np.max(between) + _SHAKEN * np.sqrt(np.mean(shaken**2)))


def _given_speed(scene: Scene) -> dict[str, float | None]:
    """Return the keys that keep the speed for another bond, whose v* may be different."""
    state = scene.initial_state
    if state is not None and state.velocities is not None:
        return {}
    return {"speed": None, "velocity": scene.impact_velocity}


def _bond_of(force: "CubicSpline") -> SplineBond:
    """Return a bond with a force, shifted so that it vanishes at length 1."""
    from scipy.interpolate import CubicSpline

    zeros = force.roots(extrapolate=False)
    zero = float(zeros[np.argmin(np.abs(zeros))])
    # Altered bonds go little beyond the rows, where the outer cubics are continued.
    reach = 0.05 * float(force.x[-1] - force.x[0])
    return SplineBond(CubicSpline(force.x - zero, force(force.x)), "altered table", reach)
