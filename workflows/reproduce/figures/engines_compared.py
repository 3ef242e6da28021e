"""LAMMPS against the in-house engine, point by point, beside the error bars."""

from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, VERMILION, new_figure
from chaincor.workflows.reproduce.figures.figure import Figure
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.tables import point_record, table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

_FLOOR = 1e-14


def agreement(measured: Measurements) -> Figure:
    """
    Return the difference of the two engines against the sum of their bars.

    Points above the diagonal disagree.
    """
    points = [p for p in measured.all_points() if p.agrees is not None]
    outside = [p for p in points if p.agrees is False]
    sharp = measured.sharp
    blunt = sum((p.allowed_difference or 0.0) > sharp for p in points)
    worst = max((_excess(p) for p in points), default=float("nan"))
    return Figure(
        key="agreement",
        title="LAMMPS against the in-house engine",
        caption=(
            f"Every point that both engines computed: {len(points)}, of which {len(outside)} "
            f"differ by more than the sum of their error bars, and none by more than {worst:.2g} "
            "of it. Below the full line they agree. Right of the dotted one bars are larger than "
            f"{sharp:.0e}, and agreement proves little: {blunt} of the points, chains that "
            "break or nearly do ([how far to trust this](#trust))."
        ),
        table=table_of([point_record(p) for p in measured.all_points()]),
        draw=lambda: _draw(points, sharp),
        alt=(
            "Nearly all bars are between 1e-8 and 1e-5, and all differences far below them; a few "
            "bars are larger."
        ),
    )


def _excess(point: Point) -> float:
    assert point.difference is not None
    assert point.allowed_difference is not None
    return abs(point.difference) / point.allowed_difference


def _draw(points: list[Point], sharp: float) -> "Canvas":
    figure, ax = new_figure(figsize=(6.4, 4.0))
    allowed = np.array([p.allowed_difference or 0.0 for p in points])
    found = np.maximum(np.abs([p.difference or 0.0 for p in points]), _FLOOR)
    fine = np.array([bool(p.agrees) for p in points], dtype=bool)
    for chosen, colour, label in ((fine, BLUE, "agree"), (~fine, VERMILION, "differ")):
        if np.any(chosen):
            ax.plot(
                allowed[chosen],
                found[chosen],
                "o",
                markersize=3.2,
                color=colour,
                label=label,
                alpha=0.8,
            )
    if len(points):
        line = np.array([allowed.min(), allowed.max()])
        ax.plot(line, line, color=BLACK, linewidth=0.9)
    ax.axvline(sharp, color=BLACK, linewidth=0.8, linestyle=":")
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("sum of the two error bars")
    ax.set_ylabel(r"$|\eta_{\rm LAMMPS}-\eta_{\rm in-house}|$")
    ax.legend(loc="upper left")
    return figure
