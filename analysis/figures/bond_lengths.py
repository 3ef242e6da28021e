"""The shortest and the longest bond in time."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import BLACK, BLUE, SKY, VERMILION, choose_axes, legend_above

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_bond_lengths(
    times: ArrayLike, shortest: ArrayLike, longest: ArrayLike, *, ax: "Axes | None" = None
) -> "Axes":
    """Draw the shortest and longest bond of the chain, of shape (frames,), against time."""
    ax = choose_axes(ax)
    ax.fill_between(times, shortest, longest, color=SKY, alpha=0.35, linewidth=0.0)
    ax.plot(times, longest, color=VERMILION, linewidth=1.0, label="longest bond")
    ax.plot(times, shortest, color=BLUE, linewidth=1.0, label="shortest bond")
    ax.axhline(1.0, color=BLACK, linewidth=0.8, linestyle="--", label="natural length")
    # A chain that breaks apart would squeeze everything else to a line.
    if float(np.nanmax(longest)) > 4.0:
        ax.set_yscale("log")
    ax.set_xlim(np.min(times), np.max(times))
    ax.set_xlabel(r"time since first contact ($\sqrt{m/k}$)")
    ax.set_ylabel("bond length (natural lengths)")
    legend_above(ax)
    return ax
