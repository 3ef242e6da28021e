"""Points with error bars: filled where LAMMPS gave the number, open where in-house did."""

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
    for source, face in (("lammps", colour), ("in-house", "white")):
        chosen = np.array([point.source == source for point in points], dtype=bool)
        if not np.any(chosen):
            continue
        ax.errorbar(
            x[chosen],
            y[chosen],
            yerr=bars[chosen],
            color=colour,
            marker=marker,
            markersize=size,
            markerfacecolor=face,
            markeredgewidth=0.9,
            linestyle="none",
            capsize=1.5,
            elinewidth=0.8,
            label=label,
        )
        label = None  # one entry for each set of points
