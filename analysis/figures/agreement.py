"""How two integrators agree: differences in units of their error bars."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from chaincor.analysis.figures.style import CYCLE, GREY, MARKERS, choose_axes, legend_above

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_agreement(
    scenes: Sequence[str], ratios: Mapping[str, Sequence[float]], ax: "Axes | None" = None
) -> "Axes":
    """
    Plot ``|difference| / (both error bars)`` for each scene and quantity.

    There is a ratio for each scene; above 1 the integrators differ.
    """
    ax = choose_axes(ax)
    rows: Any = np.arange(len(scenes))
    for k, (quantity, values) in enumerate(ratios.items()):
        shown = np.clip(np.asarray(values, dtype=float), 1e-6, 1e6)
        offset = 0.12 * (k - 0.5 * (len(ratios) - 1))
        ax.plot(
            shown,
            rows + offset,
            MARKERS[k % len(MARKERS)],
            color=CYCLE[k % len(CYCLE)],
            linestyle="none",
            label=quantity.replace("_", " "),
        )
    ax.axvline(1.0, color=GREY, linewidth=1.0)
    ax.set_xscale("log")
    ax.set_yticks(rows, scenes)
    ax.invert_yaxis()
    ax.set_ylim(len(scenes) - 0.5, -0.5)
    ax.set_xlabel("difference / both error bars (agreement is left of 1)")
    legend_above(ax)
    return ax
