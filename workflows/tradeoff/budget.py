"""Split the error of a setting by cause, and measure eta's error for tables of many rows."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import TableStyle
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.errors import ChaincorError
from chaincor.workflows.tradeoff.oracles import (
    lepton_formula,
    restitution_with_exact_bonds,
    restitution_without_rounding,
    wider_floats,
)
from chaincor.workflows.tradeoff.reference_solution import ReferenceSolution
from chaincor.workflows.tradeoff.settings import PHASE_WIDTH

# The plan assumes that a force call of bond_style lepton, and a step in NumPy, take this many
# seconds.
_LEPTON_CALL = 2e-4
_WIDE_STAGE = 3e-5
_ROWS: dict[TableStyle, tuple[int, ...]] = {
    "linear": (101, 1_001, 10_001, 100_001),
    "spline": (31, 101, 301, 1_001, 10_001),
}
# A table covers this range if no pilot run determines a range. The range contains most of the
# potential well, so it is suitable for any speed.
_WIDE = (0.8, 1.8)

CAUSES = ("wall", "integrator", "table", "rounding", "output")

# A function of this type reports the finished fraction of a part.
ReportPart = Callable[[float], None]


@dataclass(frozen=True)
class ErrorBudget:
    """Errors of eta in one setting, by cause."""

    name: str  #: Name of the setting.
    scheme: str  #: Scheme of the setting.
    timestep: float  #: Composed step H.
    #: Error from the stock wall: eta with the stock wall minus eta with the event wall at equal
    #: steps, as a root mean square over phases; None for the event wall, which locates contacts to
    #: within rounding.
    wall: float | None
    #: Error from the integrator: eta with the event wall, exact bonds and no rounding, minus eta of
    #: the reference run.
    integrator: float | None
    #: Error from the table: eta with the table minus eta with exact bonds, at equal steps; None if
    #: the bond has no formula or the run would take too long.
    table: float | None
    #: Error from rounding: eta in doubles minus eta in wider floats, at equal steps; None if the
    #: machine has no wider floats.
    rounding: float | None
    #: Error if eta is found from final velocities in a default dump, which have six digits.
    output: float
    #: Error if eta is found from final velocities in chaincor's dumps, which have 17 digits.
    output_exact: float
    total: float  #: Total error of the setting.
    #: Value of eta at these steps with exact bonds, for the study of tables.
    exact_restitution: float | None

    def parts(self) -> dict[str, float | None]:
        """Return the errors by cause."""
        return {cause: getattr(self, cause) for cause in CAUSES}


def printed_restitution(scene: Scene, outcome: Outcome, pattern: str) -> float:
    """Return eta from final velocities that a dump prints in a format such as ``%g``."""
    printed = np.array([float(pattern % v) for v in outcome.velocities])
    return float(restitution(printed, scene.impact_velocity))


def measure_budget(
    reference: ReferenceSolution,
    name: str,
    numerics: Numerics,
    *,
    phases: int,
    oracle_seconds: float,
    advance: ReportPart = lambda _done: None,
) -> ErrorBudget:
    """
    Measure the error budget of a setting by removing one cause of error after the other.

    All errors are absolute values. The error from the stock wall is a root mean square over
    `phases` slightly different steps. `oracle_seconds` limits the time for each
    slow run, which has exact bonds or wider floats.
    """
    advance(0.0)
    scene = reference.scene
    full = located = lammps.run(scene.problem, numerics)
    total = full.eta - reference.restitution
    advance(1.0 / (phases + 2))
    event = replace(numerics, wall="event")
    wall = None
    if numerics.wall == "reflect":
        located = lammps.run(scene.problem, event)
        errors = [total]
        walls = [full.eta - located.eta]
        for phase in range(1, phases):
            step = numerics.timestep * (1.0 - PHASE_WIDTH * phase / phases)
            stock = lammps.run(scene.problem, replace(numerics, timestep=step)).eta
            walls.append(stock - lammps.run(scene.problem, replace(event, timestep=step)).eta)
            errors.append(stock - reference.restitution)
            advance((phase + 1.0) / (phases + 2))
        wall = float(np.sqrt(np.mean(np.square(walls))))
        total = float(np.sqrt(np.mean(np.square(errors))))
    exact, table = located.eta, None
    if scene.bond.is_harmonic:
        table = 0.0
    elif _LEPTON_CALL * located.force_evaluations < oracle_seconds and lepton_formula(scene):
        exact = restitution_with_exact_bonds(scene, event, located)
        table = abs(located.eta - exact)
    advance((phases + 1.0) / (phases + 2))
    integrator = rounding = None
    if wider_floats() and _WIDE_STAGE * located.force_evaluations < oracle_seconds:
        smooth = restitution_without_rounding(scene, event, located)
        integrator = abs(smooth - reference.restitution)
        # Without a run with exact bonds, this difference would also contain the error due to the
        # table.
        rounding = None if table is None else abs(exact - smooth)
    advance(1.0)
    return ErrorBudget(
        name=name,
        scheme=numerics.scheme,
        timestep=numerics.timestep,
        wall=wall,
        integrator=integrator,
        table=table,
        rounding=rounding,
        output=abs(printed_restitution(scene, full, "%g") - full.eta),
        output_exact=abs(printed_restitution(scene, full, "%.17g") - full.eta),
        total=abs(total),
        exact_restitution=None if table is None else exact,
    )


@dataclass(frozen=True)
class TablePoint:
    """Effect of one bond table on eta."""

    style: TableStyle  #: ``linear`` or ``spline``.
    rows: int  #: Number of rows.
    bond_range: str  #: ``scene`` for the bond lengths in this scene, ``wide`` for 0.8 to 1.8.
    #: Largest error in the force that LAMMPS interpolates, from the table's certificate.
    force_error: float
    #: Error of eta from the table: |eta - eta with exact bonds| at equal steps.
    restitution_error: float


def measure_tables(
    reference: ReferenceSolution,
    numerics: Numerics,
    exact: float,
    *,
    quick: bool,
    advance: ReportPart = lambda _done: None,
) -> list[TablePoint]:
    """
    Repeat a run at equal steps with tables of each style, range and number of rows.

    `exact` is eta at these steps with exact bonds. If `quick` is true, tables cover only the bond
    lengths in the scene.
    """
    scene, own = reference.scene, reference.bond_range
    ranges = {"scene": own}
    if not quick and _WIDE[0] < own[0] and own[1] < _WIDE[1]:
        ranges["wide"] = _WIDE
    tables = [(name, style, n) for name in ranges for style, rows in _ROWS.items() for n in rows]
    points = []
    for k, (name, style, rows) in enumerate(tables):
        advance(k / len(tables))
        table = replace(numerics, table=style, table_points=rows, bond_range=ranges[name])
        try:
            outcome = lammps.run(scene.problem, table)
        except ChaincorError:
            continue  # The table is so coarse that the chain breaks.
        points.append(
            TablePoint(
                style=style,
                rows=rows,
                bond_range=name,
                force_error=outcome.details["table"]["force_error"],
                restitution_error=abs(outcome.eta - exact),
            )
        )
    return points
