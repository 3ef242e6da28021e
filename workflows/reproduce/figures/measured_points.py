"""Points with error bars: filled where LAMMPS gave the number, open where in-house did."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from chaincor.workflows.reproduce.measurements import Point

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_points(
    ax: "Axes",
    points: Sequence[Point],
    x: Callable[[Point], float],
    y: Callable[[Point], float],
    *,
    colour: str,
    marker: str,
    label: str | None,
    line: bool = True,
    size: float = 4.5,
) -> None:
    """
    Draw points with the error bars of eta.

    `y` differs from eta by a constant or a sign, so that the error bar of eta is its own.
    """
    if not points:
        return
    places = np.array([x(point) for point in points])
    values = np.array([y(point) for point in points])
    if line:
        ax.plot(places, values, color=colour, linewidth=0.9, alpha=0.6)
    for source, face in (("lammps", colour), ("in-house", "white")):
        chosen = np.array([point.source == source for point in points])
        if not np.any(chosen):
            continue
        ax.errorbar(
            places[chosen],
            values[chosen],
            yerr=np.nan_to_num([point.error for point in points if point.source == source]),
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
