"""What a bond table costs in accuracy: style, rows and range, each against exact bonds."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import TableStyle
from chaincor.workflows.accuracy.in_house_runs import eta_of
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.errors import ChaincorError
from chaincor.workflows.tradeoff.truth import Truth

_ROWS: dict[TableStyle, tuple[int, ...]] = {
    "linear": (101, 1_001, 10_001, 100_001),
    "spline": (31, 101, 301, 1_001, 10_001),
}
# What one writes down without a scouting run: most of the well, for any speed.
_WIDE = (0.8, 1.8)


@dataclass(frozen=True)
class TablePoint:
    """The effect of one bond table on eta."""

    style: TableStyle  #: ``linear`` or ``spline``.
    rows: int  #: Rows.
    bond_range: str  #: ``scene`` for the lengths this scene's bonds have, ``wide`` for 0.8 to 1.8.
    #: Largest error of LAMMPS's interpolated force, from the table's certificate.
    force_error: float
    restitution_error: float  #: |eta - eta with exact bonds| at the same steps.


def measure_tables(
    scene: Scene,
    truth: Truth,
    numerics: Numerics,
    exact: float,
    *,
    quick: bool,
    advance: Callable[[], None] = lambda: None,
) -> list[TablePoint]:
    """
    Run the same steps with each style, range and number of rows that holds the bonds.

    `exact` is eta of these steps with exact bonds; `quick` keeps to the scene's own range.
    """
    own = truth.scouting.table_range(scene)
    ranges = {"scene": own}
    if not quick and _WIDE[0] < own[0] and own[1] < _WIDE[1]:
        ranges["wide"] = _WIDE
    points = []
    for name, bond_range in ranges.items():
        for style, lengths in _ROWS.items():
            for rows in lengths:
                tabulated = replace(numerics, table=style, table_points=rows, bond_range=bond_range)
                try:
                    outcome = lammps.run(scene, tabulated)
                except ChaincorError:
                    continue  # too coarse to hold the chain together: nothing to show
                finally:
                    advance()
                points.append(
                    TablePoint(
                        style=style,
                        rows=rows,
                        bond_range=name,
                        force_error=outcome.details["table"]["force_error"],
                        restitution_error=abs(eta_of(scene, outcome) - exact),
                    )
                )
    return points
