"""LAMMPS against the in-house engine, point by point, beside the error bars."""

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, VERMILION, new_figure
from chaincor.workflows.reproduce.drawing import Canvas, Figure, point_record
from chaincor.workflows.reproduce.measurements import Measurements

_FLOOR = 1e-14


def figure(measured: Measurements) -> Figure:
    """
    Return the difference of the two engines against the sum of their bars.

    Points above the diagonal disagree.
    """
    points = [p for p in measured.all_points() if p.agrees is not None]
    found = np.abs([p.difference or 0.0 for p in points])
    allowed = np.array([p.allowed_difference or 0.0 for p in points])
    worst = max(found / allowed, default=float("nan"))
    return Figure(
        key="agreement",
        title="LAMMPS against the in-house engine",
        caption=(
            f"Every point that both engines computed: {len(points)}, of which "
            f"{np.count_nonzero(found > allowed)} "
            f"differ by more than the sum of their error bars, and none by more than {worst:.2g} "
            "of it. Below the full line they agree. Right of the dotted one bars are larger than "
            f"{measured.sharp:.0e}, and agreement proves little: "
            f"{np.count_nonzero(allowed > measured.sharp)} of the points, chains that "
            "break or nearly do ([how far to trust this](#trust))."
        ),
        records=[point_record(p) for p in measured.all_points()],
        draw=lambda: _draw(found, allowed, measured.sharp),
        alt=(
            "Nearly all bars are between 1e-8 and 1e-5, and all differences far below them; a few "
            "bars are larger."
        ),
    )


def _draw(found: np.ndarray, allowed: np.ndarray, sharp: float) -> Canvas:
    canvas, ax = new_figure(figsize=(6.4, 4.0))
    for chosen, color, label in (
        (found <= allowed, BLUE, "agree"),
        (found > allowed, VERMILION, "differ"),
    ):
        if np.any(chosen):
            y = np.maximum(found[chosen], _FLOOR)
            ax.plot(allowed[chosen], y, "o", markersize=3.2, color=color, label=label, alpha=0.8)
    if allowed.size:
        line = np.array([allowed.min(), allowed.max()])
        ax.plot(line, line, color=BLACK, linewidth=0.9)
    ax.axvline(sharp, color=BLACK, linewidth=0.8, linestyle=":")
    ax.set(xscale="log", yscale="log", xlabel="sum of the two error bars")
    ax.set_ylabel(r"$|\eta_{\rm LAMMPS}-\eta_{\rm in-house}|$")
    ax.legend(loc="upper left")
    return canvas
