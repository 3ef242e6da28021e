"""Points with error bars: filled by LAMMPS, open in-house, crosses where a limit was put in."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.workflows.reproduce.measurements import Point

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_points(
    ax: "Axes",
    points: Sequence[Point],
    x: ArrayLike,
    y: ArrayLike,
    *,
    colour: str,
    marker: str,
    label: str | None,
    errors: ArrayLike | None = None,
    line: bool = True,
    size: float = 4.5,
) -> None:
    """Draw a quantity y of points against x, with error bars: those of eta by default."""
    x, y = np.asarray(x), np.asarray(y)
    bars = np.nan_to_num([p.error for p in points] if errors is None else errors)
    if line:
        ax.plot(x, y, color=colour, linewidth=0.9, alpha=0.6)
    kinds = ["limit" if point.is_limit else point.source for point in points]
    for kind, face in (("lammps", colour), ("in-house", "white"), ("limit", colour)):
        chosen = np.array([k == kind for k in kinds], dtype=bool)
        if not np.any(chosen):
            continue
        ax.errorbar(
            x[chosen],
            y[chosen],
            yerr=bars[chosen],
            color=colour,
            marker="x" if kind == "limit" else marker,
            markersize=size,
            markerfacecolor=face,
            markeredgewidth=0.9,
            linestyle="none",
            capsize=1.5,
            elinewidth=0.8,
            label=label,
        )
        label = None  # one entry for each set of points
