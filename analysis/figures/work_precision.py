"""Error against time, error by cause, error by table: what a study of accuracy found."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
    choose_axes,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SCHEME_COLOURS = {"verlet": VERMILION, "order4": ORANGE, "order6": GREEN, "order8": BLUE}
_SCHEME_MARKERS = {"verlet": "o", "order4": "s", "order6": "^", "order8": "D"}
_CAUSE_COLOURS = CYCLE
# Errors that came out as exactly zero are drawn here.
_LEAST = 1e-17


@dataclass(frozen=True)
class WorkPrecisionCurve:
    """One series of a work-precision study."""

    label: str  #: Name in the legend.
    #: ``lammps``, ``reference`` or another name, for the stock wall: solid, hollow, grey.
    group: str
    scheme: str  #: Decides the colour.
    dashed: bool  #: Drawn dashed.
    #: Time and root-mean-square error of each setting.
    seconds: Sequence[float]
    errors: Sequence[float]  #: See ``seconds``.
    #: Least and largest error over the phases.
    lowest: Sequence[float]
    highest: Sequence[float]  #: See ``lowest``.


@dataclass(frozen=True)
class TableCurve:
    """Effect of tables of one style and range."""

    #: ``linear`` or ``spline``; ``scene`` or ``wide``.
    style: str
    bond_range: str  #: See ``style``.
    rows: Sequence[int]  #: Lengths of the tables.
    errors: Sequence[float]  #: Error of eta due to each.


def plot_work_precision(
    curves: Sequence[WorkPrecisionCurve],
    *,
    front: tuple[Sequence[float], Sequence[float]],
    floor: float | None = None,
) -> "Axes":
    """
    Draw error of eta against time of integration, both logarithmic.

    Bars go from the least to the largest error over the phases. `front`, times and errors of the
    Pareto front, is a broad pale line, `floor`, the error of the converged value, a dotted one. The
    axes are those of a new figure with the legend beside the panel.
    """
    figure, ax = new_figure(figsize=(7.2, 4.4))
    times, errors = front
    ax.plot(
        times, np.maximum(errors, _LEAST), color="#D9D9D9", linewidth=9.0, zorder=1,
        solid_capstyle="round", label="Pareto front of LAMMPS",
    )  # fmt: skip
    for curve in curves:
        stock = curve.group not in ("lammps", "reference")
        colour = GREY if stock else _SCHEME_COLOURS[curve.scheme]
        error = np.maximum(np.asarray(curve.errors), _LEAST)
        bars = np.array([error - np.maximum(curve.lowest, _LEAST), curve.highest - error])
        ax.errorbar(
            curve.seconds,
            error,
            yerr=np.maximum(bars, 0.0),
            color=BLACK if stock else colour,
            marker="X" if stock else _SCHEME_MARKERS[curve.scheme],
            markerfacecolor="white" if curve.group == "reference" else None,
            markersize=6.0 if stock else 4.0,
            linestyle="--" if curve.dashed else ":" if curve.group == "reference" else "-",
            elinewidth=0.7,
            linewidth=1.2,
            label=curve.label,
            zorder=3,
        )
    if floor is not None and floor > 0.0:
        ax.axhline(floor, color=GREY, linewidth=0.8, linestyle=(0, (1, 2)))
        ax.annotate(
            "bar of the converged value", (1.0, floor), xycoords=("axes fraction", "data"),
            xytext=(-2, 3), textcoords="offset points", ha="right", fontsize=8, color=GREY,
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("time of the integration (s)")
    ax.set_ylabel(r"error of $\eta$ (rms over phases; bars: least to worst)")
    figure.legend(loc="outside right upper", fontsize=8, frameon=False)
    return ax


def plot_error_budget(
    budgets: Mapping[str, Mapping[str, float | None]], totals: Mapping[str, float]
) -> "Axes":
    """
    Draw the error of eta by cause, a group of bars for each setting.

    `budgets` gives for each setting its causes and their errors, None where a cause does not apply;
    `totals` its whole error, a line across its group.
    """
    ax = new_figure(figsize=(6.4, 3.6))[1]
    causes = list(next(iter(budgets.values())))
    width = 0.8 / len(causes)
    lowest = min([v for parts in budgets.values() for v in parts.values() if v], default=_LEAST)
    bottom = 10.0 ** np.floor(np.log10(max(min(lowest, min(totals.values())), _LEAST)) - 0.5)
    for k, cause in enumerate(causes):
        for group, parts in enumerate(budgets.values()):
            value = parts[cause]
            place = group + (k - 0.5 * (len(causes) - 1)) * width
            name = "six-digit output" if cause == "output" else cause
            label = name if group == 0 else None
            if value is None or value <= 0.0:
                # Neither zero nor "none" has a place on a logarithmic axis.
                ax.bar(place, 0.0, width, color=_CAUSE_COLOURS[k], label=label)
                text = "none" if value is None else "0"
                ax.annotate(
                    text, (place, bottom), xytext=(0, 2), textcoords="offset points",
                    ha="center", fontsize=7, color=GREY,
                )  # fmt: skip
                continue
            ax.bar(place, value - bottom, 0.92 * width, bottom=bottom, color=_CAUSE_COLOURS[k],
                   label=label)  # fmt: skip
            ax.annotate(
                f"{value:.0e}", (place, value), xytext=(0, 2), textcoords="offset points",
                ha="center", fontsize=7,
            )  # fmt: skip
    for group, name in enumerate(budgets):
        ax.plot([group - 0.45, group + 0.45], [totals[name]] * 2, color=BLACK, linewidth=1.0,
                linestyle="--", label="error before output" if group == 0 else None)  # fmt: skip
    ax.set_yscale("log")
    ax.set_ylim(bottom, 10.0 * max([*totals.values(), lowest, *_largest(budgets)]))
    ax.set_xticks(range(len(budgets)), list(budgets))
    ax.grid(visible=False, axis="x")
    ax.set_ylabel(r"error of $\eta$")
    ax.figure.legend(loc="outside right upper", fontsize=8, frameon=False)
    return ax


def _largest(budgets: Mapping[str, Mapping[str, float | None]]) -> list[float]:
    return [v for parts in budgets.values() for v in parts.values() if v is not None]


def plot_table_errors(curves: Sequence[TableCurve], ax: "Axes | None" = None) -> "Axes":
    """Draw the error of eta due to a bond table against its rows."""
    ax = choose_axes(ax)
    colours = {"linear": VERMILION, "spline": PURPLE}
    ranges = {"scene": "over the scene's lengths", "wide": "over 0.8 to 1.8"}
    for curve in curves:
        ax.loglog(
            curve.rows,
            np.maximum(curve.errors, _LEAST),
            color=colours[curve.style],
            marker="o" if curve.style == "linear" else "D",
            linestyle="-" if curve.bond_range == "scene" else "--",
            label=f"{curve.style}, {ranges[curve.bond_range]}",
        )
    ax.set_xlabel("rows of the bond table")
    ax.set_ylabel(r"error of $\eta$ due to the table")
    ax.legend(fontsize=8)
    return ax
