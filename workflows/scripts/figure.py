"""Draw a script study: errors against the setting, or distances between runs against time."""

from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.figures.style import BLACK, CYCLE, GREY, MARKERS, new_figure
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.ladder_runs import NumberLadder, ScriptLadder
from chaincor.workflows.scripts.parting import PARTED, PartingComparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from chaincor.workflows.scripts.study import ScriptStudy

# The cost panel is drawn if the costs of the runs differ by at least this factor.
_COSTS_APART = 2.0
_WIDE = 10.0
# Largest number of ticks on an axis. More ticks would overlap.
_MOST_TICKS = 6
_CRASHED = "#c00000"


def has_figure(study: "ScriptStudy") -> bool:
    """Return whether a study has an error or a distance above 0 to draw."""
    return bool(_drawn_names(study)) or any(
        np.any(each.distances > 0.0) for each in study.comparisons
    )


def plot_script_study(study: "ScriptStudy") -> "Axes":
    """
    Draw a study and return the first axes.

    If a setting was varied, each quantity has a panel with errors against the setting. If there is
    only one quantity and the costs differ, a second panel shows errors against processor time. Dots
    are single runs, solid lines show the largest error of one run, dashed lines the fitted power
    law, and grey lines the tolerance. Crosses mark values at which a run failed. If runs were
    compared, the figure shows the distance between their particles against time. Raise InputError
    if all runs gave the same results.
    """
    if not has_figure(study):
        raise InputError(
            "all runs of the study gave the same numbers, so there is no difference to "
            "draw. Vary a setting that changes the result"
        )
    if study.comparisons:
        return _plot_distances(study.comparisons)
    names = _drawn_names(study)
    costs = np.concatenate([each.seconds for each in study.ladders])
    with_costs = len(names) == 1 and costs.max() > _COSTS_APART * costs.min()
    columns = 2 if with_costs else min(len(names), 3)
    rows = 1 if with_costs else -(-len(names) // columns)
    size = (max(4.0 * columns, 5.0) if columns < 3 else 10.0, 0.8 + 3.1 * rows)
    figure, grid = new_figure(
        rows, columns, figsize=size, squeeze=False, sharey="row" if with_costs else False
    )
    panels = list(grid.ravel())
    for panel, name in zip(panels, names, strict=False):
        _plot_number(panel, study, name)
    if with_costs:
        _plot_costs(panels[1], study, names[0])
    for panel in panels[len(names) + with_costs :]:
        panel.remove()
    entries = {
        label: handle
        for panel in panels
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        list(entries.values()), list(entries), loc="outside upper left", ncols=4, fontsize=8
    )
    return panels[0]


def _numbers(study: "ScriptStudy", name: str) -> list[tuple[ScriptLadder, NumberLadder]]:
    found = [(each, number) for each in study.ladders for number in each.numbers]
    return [pair for pair in found if pair[1].name == name]


def _errors(number: NumberLadder) -> np.ndarray:
    """Return the difference of each run from the best value, with nan in place of 0."""
    best = number.verdict.value
    errors = np.abs(number.results - (float(number.results[-1].mean()) if best is None else best))
    return np.where(errors > 0.0, errors, np.nan)


def _drawn_names(study: "ScriptStudy") -> list[str]:
    names = dict.fromkeys(number.name for each in study.ladders for number in each.numbers)
    return [
        name
        for name in names
        if any(np.any(np.isfinite(_errors(number))) for _, number in _numbers(study, name))
    ]


def _plot_number(panel: "Axes", study: "ScriptStudy", name: str) -> None:
    """Draw the errors of one quantity against the varied setting."""
    curves = _numbers(study, name)
    for k, (each, number) in enumerate(curves):
        colour, verdict = CYCLE[k % len(CYCLE)], number.verdict
        fixed = ", ".join(f"{key} {value}" for key, value in each.fixed.items())
        panel.plot(
            each.inputs.ravel(), _errors(number).ravel(), color=colour,
            marker=MARKERS[k % len(MARKERS)], linestyle="none", markersize=3.0, alpha=0.55,
            markeredgewidth=0.0, label=", ".join(filter(None, ["single runs", fixed])),
        )  # fmt: skip
        if np.all(np.isfinite(verdict.promised)):
            panel.plot(
                np.median(each.inputs, axis=1), verdict.promised, color=colour,
                label="largest error of one run",
            )  # fmt: skip
        if verdict.fit is not None:
            steps = np.vectorize(each.ladder.step)(each.inputs)
            law = np.abs(verdict.fit.bias(np.median(steps / steps.max(), axis=1)))
            panel.plot(
                np.median(each.inputs, axis=1), np.where(law > 0.0, law, np.nan),
                color=BLACK, linewidth=0.8, linestyle="--", label="fitted power",
            )  # fmt: skip
        if number.tolerance is not None and k == 0:
            panel.axhline(number.tolerance, color=GREY, linewidth=0.8, label="tolerance")
    panel.set(xscale="log", yscale="log", title=name if study.asked.pattern != name else "")
    panel.set(xlabel=curves[0][0].ladder.name, ylabel="distance from the best value")
    if study.crashes:
        panel.plot(
            [crash.value for crash in study.crashes], [0.97] * len(study.crashes), color=_CRASHED,
            marker="X", linestyle="none", transform=panel.get_xaxis_transform(), clip_on=False,
            label="run failed",
        )  # fmt: skip
    values = {float(f"{np.median(row):.3g}") for each, _ in curves for row in each.inputs}
    ticks = sorted(values | {crash.value for crash in study.crashes})
    ticks = ticks[:: -(-len(ticks) // _MOST_TICKS)]
    panel.set_xticks(ticks, [f"{value:g}" for value in ticks], fontsize=8)
    panel.set_xticks([], minor=True)


def _plot_costs(panel: "Axes", study: "ScriptStudy", name: str) -> None:
    """Draw the errors of one quantity against processor time."""
    largest = smallest = 0.0
    for k, (each, number) in enumerate(_numbers(study, name)):
        # If a run on a finer rung took less time than on a coarser rung, the machine was busy.
        costs = np.minimum.accumulate(each.seconds[::-1])[::-1]
        largest, smallest = max(largest, costs.max()), min(smallest or costs.min(), costs.min())
        colour, errors = CYCLE[k % len(CYCLE)], _errors(number)
        panel.plot(
            np.repeat(costs, errors.shape[1]), errors.ravel(), color=colour,
            marker=MARKERS[k % len(MARKERS)], linestyle="none", markersize=3.0, alpha=0.55,
            markeredgewidth=0.0,
        )  # fmt: skip
        if np.all(np.isfinite(number.verdict.promised)):
            panel.plot(costs, number.verdict.promised, color=colour)
        if number.tolerance is not None and k == 0:
            panel.axhline(number.tolerance, color=GREY, linewidth=0.8)
    panel.set(
        xscale="log" if largest > _WIDE * smallest else "linear", yscale="log",
        xlabel="processor time of one run (s)",
    )  # fmt: skip


def _plot_distances(comparisons: tuple[PartingComparison, ...]) -> "Axes":
    """Draw the distance between the particles of two runs against time."""
    figure, panel = new_figure(figsize=(6.0, 3.9))
    for each in comparisons:
        shown = np.where(each.distances > 0.0, each.distances, np.nan)
        panel.plot(each.times, shown, label=each.what)
    panel.axhline(PARTED, color=GREY, linewidth=0.8, label="parted")
    panel.set(yscale="log", xlabel="time", ylabel="distance / distance of neighbours")
    figure.legend(*panel.get_legend_handles_labels(), loc="outside upper left", ncols=2, fontsize=8)
    return panel
