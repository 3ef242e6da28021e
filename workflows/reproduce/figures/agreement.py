"""LAMMPS against the in-house engine, point by point, beside what LAMMPS alone tells."""

from typing import Any

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, VERMILION
from chaincor.workflows.reproduce.drawing import Axes, Figure, point_records
from chaincor.workflows.reproduce.measurements import Measurements

_FLOOR = 1e-14


def figure(measured: Measurements) -> Figure:
    """
    Return the difference of the two engines against what LAMMPS's own runs differ by.

    Points above the diagonal disagree.
    """
    points = [p for p in measured.all_points() if p.agrees is not None]
    found = np.abs([p.difference or 0.0 for p in points])
    allowed = np.array([p.allowed_difference or 0.0 for p in points])
    worst = max(found / allowed, default=float("nan"))

    def draw(ax: Axes) -> None:
        agree = found <= allowed
        for chosen, color, label in ((agree, BLUE, "agree"), (~agree, VERMILION, "differ")):
            if np.any(chosen):
                looks: dict[str, Any] = {
                    "markersize": 3.2,
                    "color": color,
                    "label": label,
                    "alpha": 0.8,
                }
                ax.plot(allowed[chosen], np.maximum(found[chosen], _FLOOR), "o", **looks)
        if allowed.size:
            line = np.array([allowed.min(), allowed.max()])
            ax.plot(line, line, color=BLACK, linewidth=0.9)
        ax.set(xscale="log", yscale="log", ylabel=r"$|\eta_{\rm LAMMPS}-\eta_{\rm in-house}|$")
        ax.set_xlabel("what LAMMPS's own runs leave open, and the in-house bar")
        ax.legend(loc="upper left")

    return Figure(
        key="agreement",
        title="LAMMPS against the in-house engine",
        caption=(
            f"Every point that both engines computed: {len(points)}, of which "
            f"{np.count_nonzero(found > allowed)} "
            "differ by more than LAMMPS's run and another at twice its step do, with its table and "
            f"rounding and the in-house error bar; none by more than {worst:.2g} of that. Below "
            "the line they agree. LAMMPS's error bar is shorter, and has no part in this: it holds "
            "the distance to an in-house run ([how far to trust this](#trust))."
        ),
        alt=(
            "Nearly all differences are a hundredth to a ten-thousandth of what LAMMPS's own runs "
            "differ by, which is between 1e-9 and 1e-2."
        ),
        draw=draw,
        records=point_records(list(measured.all_points())),
        size=(6.4, 4.0),
    )
