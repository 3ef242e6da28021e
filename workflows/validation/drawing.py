"""Drawing a validation."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from chaincor.analysis.atomic_write import written_aside
from chaincor.analysis.figures.agreement import plot_agreement
from chaincor.analysis.figures.style import new_figure
from chaincor.lammps_inputs.scene_parts.given_bodies import given_bodies
from chaincor.workflows.validation.comparison import Validation


def save_validation_plot(results: Sequence[Validation], path: Path) -> None:
    """Draw differences in units of their error bars; the file's suffix tells the format."""
    judged: dict[str, list[float]] = {}
    for k, result in enumerate(results):
        for comparison in result.comparisons:
            # A count has no error bar to be measured by; the verdict has it.
            if not comparison.allowed:
                continue
            row = judged.setdefault(comparison.quantity, [np.nan] * len(results))
            row[k] = comparison.difference / comparison.allowed
    labels = [_label(result) for result in results]
    figure, ax = new_figure(figsize=(7.0, 1.6 + 0.32 * len(results)))
    plot_agreement(labels, judged, ax)
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
