"""Error of a script's number along a ladder, and what it costs."""

from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.figures.style import BLACK, CYCLE, GREY, MARKERS, new_figure
from chaincor.workflows.scripts.study import ScriptStudy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDE = 10.0
_FEW = 6


def plot_script_ladders(study: ScriptStudy) -> "Axes":
    """
    Draw errors against the variable and against processor time, both logarithmic.

    Dots are single runs, the line of each ladder is what one run on a rung promises, the thin black
    line the fitted law, the grey one the tolerance. Left the variable, right the time.
    """
    figure, (left, right) = new_figure(1, 2, figsize=(8.0, 3.9), sharey=True)
    curves = [(each, number) for each in study.ladders for number in each.numbers]
    for k, (each, number) in enumerate(curves):
        colour, marker = CYCLE[k % len(CYCLE)], MARKERS[k % len(MARKERS)]
        verdict = number.verdict
        fixed = ", ".join(f"{name} {value}" for name, value in each.fixed.items())
        several = number.name if len(each.numbers) > 1 else ""
        label = ", ".join(filter(None, [fixed, several])) or verdict.kind
        best = float(number.results[-1].mean()) if verdict.value is None else verdict.value
        errors = np.abs(number.results - best)
        shown = np.where(errors > 0.0, errors, np.nan)
        # A finer rung that cost less did so by chance.
        costs = np.minimum.accumulate(each.seconds[::-1])[::-1]
        for ax, x in ((left, each.inputs), (right, np.repeat(costs[:, None], shown.shape[1], 1))):
            ax.plot(
                x.ravel(), shown.ravel(), color=colour, marker=marker, linestyle="none",
                markersize=3.0, alpha=0.55, markeredgewidth=0.0,
                label=f"{label}: single runs" if ax is left else None,
            )  # fmt: skip
            if np.all(np.isfinite(number.verdict.promised)):
                ax.plot(
                    np.median(x, axis=1), number.verdict.promised, color=colour,
                    label="what one run promises" if ax is left else None,
                )  # fmt: skip
        if verdict.fit is not None:
            steps = np.vectorize(each.ladder.step)(each.inputs)
            law = np.abs(verdict.fit.bias(np.median(steps / steps.max(), axis=1)))
            left.plot(
                np.median(each.inputs, axis=1), np.where(law > 0.0, law, np.nan),
                color=BLACK, linewidth=0.8, linestyle="--", label="fitted power",
            )  # fmt: skip
    # Short runs cost the same on many rungs: logarithms of less than a factor have no room.
    all_costs = np.concatenate([each.seconds for each in study.ladders])
    right.set_xscale("log" if all_costs.max() > _WIDE * all_costs.min() else "linear")
    left.set_xscale("log")
    rungs = sorted(
        {float(f"{np.median(row):.3g}") for each in study.ladders for row in each.inputs}
    )
    if len(rungs) <= _FEW:
        # Within less than two decades, powers of ten alone are too few, and all between too many.
        left.set_xticks(rungs, [f"{value:g}" for value in rungs])
        left.set_xticks([], minor=True)
    for ax in (left, right):
        ax.set_yscale("log")
        if study.tolerance is not None:
            ax.axhline(study.tolerance, color=GREY, linewidth=0.8, label="tolerance")
    left.set(xlabel=study.ladders[0].ladder.name, ylabel="distance from the best value")
    right.set_xlabel("processor time of one run (s)")
    figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=4, fontsize=8)
    return left
