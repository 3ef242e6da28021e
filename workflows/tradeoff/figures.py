"""Draw the figures of a trade-off study: error against time, error by cause, error by table."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.figures.style import (
    BLACK,
    BLUE,
    CYCLE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILION,
    new_figure,
)
from chaincor.workflows.tradeoff.budget import CAUSES, ErrorBudget, TablePoint
from chaincor.workflows.tradeoff.front import pareto_front
from chaincor.workflows.tradeoff.settings import Measurement

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SCHEMES = {
    "verlet": (VERMILION, "o"),
    "order4": (ORANGE, "s"),
    "order6": (GREEN, "^"),
    "order8": (BLUE, "D"),
}
_OTHER_SCHEME = (PURPLE, "v")
_STYLES = {"linear": (VERMILION, "o"), "spline": (PURPLE, "D")}
_RANGES = {"scene": ("over the scene's lengths", "-"), "wide": ("over 0.8 to 1.8", "--")}
# Errors that are exactly zero are drawn at this value.
_LEAST = 1e-17


def plot_work_precision(measurements: Sequence[Measurement], floor: float | None = None) -> "Axes":
    """
    Draw the error of eta against the time of integration, on logarithmic axes.

    Error bars extend from the smallest to the largest error over the phases. A broad pale line
    shows the Pareto front of LAMMPS, and a dotted line shows `floor`, the error of the converged
    value. Open symbols are results of the reference engine, and grey symbols are results with the
    stock wall.
    """
    figure, ax = new_figure(figsize=(7.2, 4.4))
    done = [m for m in measurements if not m.failure and m.seconds]
    front = pareto_front(m for m in done if m.setting.engine == "lammps")
    ax.plot(
        [m.time for m in front], np.maximum([m.rms_error for m in front], _LEAST), color="#D9D9D9",
        linewidth=9.0, zorder=1, solid_capstyle="round", label="Pareto front of LAMMPS",
    )  # fmt: skip
    for series in dict.fromkeys(m.setting.series for m in done):
        own = [m for m in done if m.setting.series == series]
        error = np.maximum([m.rms_error for m in own], _LEAST)
        lowest = np.maximum([m.errors.min() for m in own], _LEAST)
        highest = np.array([m.worst_error for m in own])
        setting = own[0].setting
        stock, by_reference = setting.wall == "reflect", setting.engine == "reference"
        colour, marker = (GREY, "X") if stock else _SCHEMES.get(setting.scheme, _OTHER_SCHEME)
        ax.errorbar(
            [m.time for m in own],
            error,
            yerr=np.maximum([error - lowest, highest - error], 0.0),
            color=BLACK if stock else colour,
            marker=marker,
            markerfacecolor="white" if by_reference and not stock else None,
            markersize=6.0 if stock else 4.0,
            linestyle="--"
            if setting.table == "linear"
            else ":"
            if by_reference and not stock
            else "-",
            elinewidth=0.7,
            linewidth=1.2,
            label=series,
            zorder=3,
        )
    if floor is not None and floor > 0.0:
        ax.axhline(floor, color=GREY, linewidth=0.8, linestyle=(0, (1, 2)))
        ax.annotate(
            "error bar of the converged value", (1.0, floor), xycoords=("axes fraction", "data"),
            xytext=(-2, 3), textcoords="offset points", ha="right", fontsize=8, color=GREY,
        )  # fmt: skip
    ax.set(xscale="log", yscale="log", xlabel="time of the integration (s)")
    ax.set_ylabel(r"error of $\eta$ (rms over phases; bars: least to worst)")
    figure.legend(loc="outside right upper", fontsize=8, frameon=False)
    return ax


def plot_error_budget(budgets: Sequence[ErrorBudget]) -> "Axes":
    """
    Draw the error of eta by cause.

    Each budget has a group of bars, and a line for the total error.
    """
    figure, ax = new_figure(figsize=(6.4, 3.6))
    width = 0.8 / len(CAUSES)
    totals = [budget.total for budget in budgets]
    known = [v for budget in budgets for v in budget.parts().values() if v is not None]
    lowest = min(filter(None, known), default=_LEAST)
    bottom = 10.0 ** np.floor(np.log10(max(min(lowest, *totals), _LEAST)) - 0.5)
    for k, cause in enumerate(CAUSES):
        for group, budget in enumerate(budgets):
            value = budget.parts()[cause]
            place = group + (k - 0.5 * (len(CAUSES) - 1)) * width
            height = value or 0.0
            drawn = height > 0.0
            # A logarithmic axis cannot show errors that are zero or missing.
            ax.bar(
                place,
                height - bottom if drawn else 0.0,
                0.92 * width if drawn else width,
                bottom=bottom if drawn else 0.0,
                color=CYCLE[k],
                label=("six-digit output" if cause == "output" else cause) if group == 0 else None,
            )
            text = f"{height:.0e}" if drawn else "none" if value is None else "0"
            ax.annotate(
                text, (place, height if drawn else bottom), xytext=(0, 2), ha="center", fontsize=7,
                textcoords="offset points", color=None if drawn else GREY,
            )  # fmt: skip
    for group, total in enumerate(totals):
        ax.plot([group - 0.45, group + 0.45], [total] * 2, color=BLACK, linewidth=1.0,
                linestyle="--", label="error before output" if group == 0 else None)  # fmt: skip
    ax.set(yscale="log", ylim=(bottom, 10.0 * max([*totals, lowest, *known])))
    names = [f"{each.name}\n{each.scheme}, H {each.timestep:.3g}" for each in budgets]
    ax.set_xticks(range(len(budgets)), names)
    ax.grid(visible=False, axis="x")
    ax.set_ylabel(r"error of $\eta$")
    figure.legend(loc="outside right upper", fontsize=8, frameon=False)
    return ax


def plot_table_errors(points: Sequence[TablePoint]) -> "Axes":
    """Draw the error of eta due to bond tables against their number of rows."""
    ax = new_figure()[1]
    for style, bond_range in dict.fromkeys((p.style, p.bond_range) for p in points):
        own = [p for p in points if (p.style, p.bond_range) == (style, bond_range)]
        (colour, marker), (said, line) = _STYLES[style], _RANGES[bond_range]
        ax.loglog(
            [p.rows for p in own],
            np.maximum([p.restitution_error for p in own], _LEAST),
            color=colour,
            marker=marker,
            linestyle=line,
            label=f"{style}, {said}",
        )
    ax.set(xlabel="rows of the bond table", ylabel=r"error of $\eta$ due to the table")
    ax.legend(fontsize=8)
    return ax
