"""Draw the differences in validations in units of the error bars."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from chaincor.analysis.atomic_write import written_aside
from chaincor.analysis.figures.style import CYCLE, GREY, MARKERS, legend_above, new_figure
from chaincor.lammps_inputs.scene_parts.given_bodies import given_bodies
from chaincor.workflows.validation.comparison import Validation


def save_validation_plot(results: Sequence[Validation], path: Path) -> None:
    """Draw ``|difference| / (sum of error bars)`` for each scene; the suffix sets the format."""
    ratios: dict[str, list[float]] = {}
    for k, result in enumerate(results):
        for comparison in result.comparisons:
            # The number of contacts is not drawn, because it has no error bar. The verdict takes it
            # into account.
            if not comparison.allowed:
                continue
            row = ratios.setdefault(comparison.quantity, [np.nan] * len(results))
            row[k] = comparison.difference / comparison.allowed
    figure, ax = new_figure(figsize=(7.0, 1.6 + 0.32 * len(results)))
    rows = np.arange(len(results))
    for k, (quantity, values) in enumerate(ratios.items()):
        ax.plot(
            np.clip(values, 1e-6, 1e6),
            rows + 0.12 * (k - 0.5 * (len(ratios) - 1)),
            MARKERS[k % len(MARKERS)],
            color=CYCLE[k % len(CYCLE)],
            linestyle="none",
            label=quantity.replace("_", " "),
        )
    ax.axvline(1.0, color=GREY, linewidth=1.0)
    ax.set_yticks(rows, [_label(result) for result in results])
    ax.set(xscale="log", ylim=(len(results) - 0.5, -0.5))
    ax.set_xlabel("difference / sum of error bars (agreement is left of 1)")
    legend_above(ax)
    with written_aside(path) as aside:
        figure.savefig(aside, format=path.suffix.lstrip(".") or "png")


def _label(result: Validation) -> str:
    scene = result.scene
    v_star = scene.bond.natural_speed
    speed = f"{scene.impact_velocity:.3g}"
    if v_star is not None:
        speed = f"{scene.impact_velocity / v_star:.3g} v*"
    kinds = "".join(f", {key.replace('_', ' ')}" for key in given_bodies(scene))
    return f"{scene.label}, n = {scene.particles}, {speed}{kinds}"
