"""Estimate the error of eta that the limited rows and digits of a user's bond table cause."""

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

# If the estimated error from the rows is below this share of the tolerance, it is not computed more
# accurately.
_NEGLIGIBLE = 0.1
# Collisions with altered tables are run at twice the step of the original run; the proof of its
# error bar includes a run at this step. If the original run has no fixed step, they are run at
# twice _STEP.
_STEP = 0.05
# Factor on the change of eta that comes from the interpolation between rows. The altered tables
# leave out the even or the odd rows. The motion of a slow chain depends on the stiffness at one
# bond length. If rows are twice as far apart, the error of a spline's stiffness is eight times
# larger, whereas the error of its force is sixteen times larger. The error of the stiffness varies
# as t(1 - t)(1 - 2t), where t is the position between two rows; it may be twice as large as both
# altered tables show. The factor is this 2 times a reserve of 1.5 for faster chains.
_BETWEEN = 3.0
# Factor on the root mean square of the changes of eta in six randomly altered tables. With only six
# samples, the root mean square is uncertain by a third.
_SHAKEN = 4.0


def with_rows(scene: Scene, bounded_run: BoundedRun, tolerance: float | None) -> BoundedRun:
    """
    Return a run whose error bar includes the error of a user's table.

    The bond of the run is the spline through the rows; a run with another kind of bond is returned
    unchanged. Raises TableError if the collision fails with another table that fits the same rows
    and digits.
    """
    error = rows_error(scene, bounded_run.outcome, tolerance or 0.0)
    if error == 0.0:
        return bounded_run
    found = replace(bounded_run, bar=replace(bounded_run.bar, table=bounded_run.bar.table + error))
    return found if tolerance is None else replace(found, reason=reason_missed(found, tolerance))


def rows_error(scene: Scene, outcome: Outcome, tolerance: float) -> float:
    """
    Return the error of eta that the limited rows and digits of a user's table cause.

    The bond of `outcome` is the spline through the rows; for other kinds of bonds the error is
    zero. Raises TableError as :func:`with_rows` does.
    """
    bond = scene.bond
    if not isinstance(bond, TableBond):
        return 0.0
    shortest, longest = bonds_from_start(outcome)
    force_error = bond.rows.largest_error(shortest - 1.0, longest - 1.0)
    estimate = table_error_of("spline", force_error, scene.impact_velocity)
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
    """Return scene keys that keep the velocity if the bond, and with it v*, changes."""
    state = scene.initial_state
    if state is not None and state.velocities is not None:
        return {}
    return {"speed": None, "velocity": scene.impact_velocity}


def _bond_of(force: "CubicSpline") -> SplineBond:
    """Return a bond with the given force, shifted so that the force vanishes at length 1."""
    from scipy.interpolate import CubicSpline

    zeros = force.roots(extrapolate=False)
    zero = float(zeros[np.argmin(np.abs(zeros))])
    # Altered bonds extend only a little beyond the rows, where the outer cubic polynomials
    # continue.
    reach = 0.05 * float(force.x[-1] - force.x[0])
    return SplineBond(CubicSpline(force.x - zero, force(force.x)), "altered table", reach)
