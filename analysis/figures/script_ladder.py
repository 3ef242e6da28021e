"""Error of a script's number along a ladder, and what it costs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.figures.style import BLACK, CYCLE, GREY, MARKERS, new_figure
from chaincor.lammps_inputs.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDE = 10.0
_FEW = 6


@dataclass(frozen=True)
class LadderCurve:
    """One ladder."""

    label: str  #: Name in the legend.
    #: Value of the variable and distance of the number from the best value, run by run; of shape
    #: (R, M).
    inputs: Array
    errors: Array  #: See ``inputs``.
    seconds: Array  #: Processor time of one run; of shape (R,).
    promised: Array  #: Error that one run on a rung keeps; of shape (R,).
    law: Array | None  #: The fitted law of the error; of shape (R,).


def plot_script_ladders(
    curves: Sequence[LadderCurve], *, variable: str, tolerance: float | None = None
) -> "Axes":
    """
    Draw errors against the variable and against processor time, both logarithmic.

    Dots are single runs, the line of each ladder is what one run on a rung promises, the thin black
    line the fitted law, the grey one the tolerance. Left the variable, right the time.
    """
    figure, (left, right) = new_figure(1, 2, figsize=(8.0, 3.9), sharey=True)
    for k, curve in enumerate(curves):
        colour, marker = CYCLE[k % len(CYCLE)], MARKERS[k % len(MARKERS)]
        runs = curve.errors.shape[1]
        shown = np.where(curve.errors > 0.0, curve.errors, np.nan)
        # A finer rung that cost less did so by chance.
        costs = np.minimum.accumulate(curve.seconds[::-1])[::-1]
        for ax, x in ((left, curve.inputs), (right, np.repeat(costs[:, None], runs, 1))):
            ax.plot(
                x.ravel(), shown.ravel(), color=colour, marker=marker, linestyle="none",
                markersize=3.0, alpha=0.55, markeredgewidth=0.0,
                label=f"{curve.label}: single runs" if ax is left else None,
            )  # fmt: skip
            if np.all(np.isfinite(curve.promised)):
                ax.plot(
                    np.median(x, axis=1), curve.promised, color=colour,
                    label="what one run promises" if ax is left else None,
                )  # fmt: skip
        if curve.law is not None:
            left.plot(
                np.median(curve.inputs, axis=1), np.where(curve.law > 0.0, curve.law, np.nan),
                color=BLACK, linewidth=0.8, linestyle="--", label="fitted power",
            )  # fmt: skip
    # Short runs cost the same on many rungs: logarithms of less than a factor have no room.
    all_costs = np.concatenate([curve.seconds for curve in curves])
    right.set_xscale("log" if all_costs.max() > _WIDE * all_costs.min() else "linear")
    left.set_xscale("log")
    rungs = sorted({float(f"{np.median(row):.3g}") for curve in curves for row in curve.inputs})
    if len(rungs) <= _FEW:
        # Within less than two decades, powers of ten alone are too few, and all between too many.
        left.set_xticks(rungs, [f"{value:g}" for value in rungs])
        left.set_xticks([], minor=True)
    for ax in (left, right):
        ax.set_yscale("log")
        if tolerance is not None:
            ax.axhline(tolerance, color=GREY, linewidth=0.8, label="tolerance")
    left.set_xlabel(variable)
    right.set_xlabel("processor time of one run (s)")
    left.set_ylabel("distance from the best value")
    figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=4, fontsize=8)
    return left
