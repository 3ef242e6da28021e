"""Intervals between contacts, and how fast particle 1 comes in."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import BLACK, BLUE, VERMILION, choose_axes, legend_above
from chaincor.analysis.theory import PAIR_INTERVAL, PAIR_SPEED

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_contact_intervals(
    contact_times: ArrayLike, *, stiffness: float | None = 1.0, ax: "Axes | None" = None
) -> "Axes":
    """
    Draw the time between contacts against the number of the contact.

    `stiffness` is U''(1)/m, for the line of the n = 2 chain at low speed; None for no line.
    """
    ax = choose_axes(ax)
    intervals = np.diff(np.asarray(contact_times, dtype=float))
    number = np.arange(1, intervals.size + 1)
    ax.plot(number, intervals, color=BLUE, marker="o", markersize=2.8, linestyle="none")
    if stiffness is not None:
        ax.axhline(
            PAIR_INTERVAL / stiffness**0.5,
            color=BLACK,
            linewidth=1.0,
            linestyle="--",
            label=r"$n = 2$, low speed: $\pi/\sqrt{2}$",
        )
    ax.margins(y=0.1)
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel(r"contact $q$")
    ax.set_ylabel(r"interval $t_{q+1} - t_q$ ($\sqrt{m/k}$)")
    if stiffness is not None:
        legend_above(ax)
    return ax


def plot_contact_speeds(
    contact_speeds: ArrayLike,
    impact_velocity: float,
    *,
    pair_line: bool = True,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw the incoming speed of particle 1 against the number of the contact.

    `pair_line` is the estimate from the n = 2 chain, which is for equal masses.
    """
    ax = choose_axes(ax)
    speeds = np.asarray(contact_speeds, dtype=float) / impact_velocity
    number = np.arange(1, speeds.size + 1)
    ax.plot(number, speeds, color=VERMILION, marker="s", markersize=2.8, linestyle="none")
    if pair_line:
        ax.axhline(
            PAIR_SPEED,
            color=BLACK,
            linewidth=1.0,
            linestyle="--",
            label=r"$n = 2$ estimate: $\pi/2\sqrt{2}$",
        )
    ax.margins(y=0.1)
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel(r"contact $q$")
    ax.set_ylabel(r"incoming speed $v_q/v_0$")
    if pair_line:
        legend_above(ax)
    return ax
