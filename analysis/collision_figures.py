"""The figures of one analysed collision."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.modes import are_equal, mode_energies
from chaincor.analysis.results import BodyAnalysis, CollisionAnalysis
from chaincor.analysis.shown_series import (
    along_the_line,
    describe,
    energy_at_impact,
    energy_series,
    mode_theory,
)
from chaincor.lammps_inputs.bonds.potential import stiffness_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_figures(analysis: CollisionAnalysis, folder: Path) -> None:
    """Draw every figure of one collision as PNG."""
    from chaincor.analysis.figures.course import (
        plot_bond_lengths,
        plot_contact_intervals,
        plot_contact_speeds,
        plot_energy_partition,
    )
    from chaincor.analysis.figures.modes import plot_mode_heat_map, plot_spectrum
    from chaincor.analysis.figures.style import new_figure
    from chaincor.analysis.figures.trajectories import plot_trajectories

    history = analysis.history
    stiffness = stiffness_of(analysis.bond)
    # Waves long against the period of unequal masses see the mean mass.
    light = stiffness / float(np.mean(analysis.masses))
    energy = energy_at_impact(analysis)
    last = analysis.contact_statistics.last_time
    targets = 0 if analysis.target is None else analysis.target.masses.size
    translation, vibration, shortest, longest = energy_series(analysis)

    figure, ax = new_figure()
    plot_trajectories(
        history.times,
        along_the_line(analysis)[0],
        targets=targets,
        contact_times=analysis.contact_times,
        sound_speed=light**0.5,
        ax=ax,
    )
    _save(figure, folder / "trajectories.png", analysis)

    if not analysis.soft:
        figure, (upper, lower) = new_figure(2, 1, figsize=(6.0, 5.2), sharex=True)
        # What two particles do that meet a wall.
        alike = are_equal(analysis.masses) and not targets
        plot_contact_intervals(analysis.contact_times, stiffness=light if alike else None, ax=upper)
        plot_contact_speeds(analysis.contact_speeds, analysis.velocity, pair_line=alike, ax=lower)
        upper.set_xlabel("")
        _save(figure, folder / "contacts.png", analysis)

    figure, ax = new_figure()
    plot_energy_partition(
        history.series_times,
        translation,
        vibration,
        energy,
        last_contact=last,
        ax=ax,
    )
    _save(figure, folder / "energy.png", analysis)

    if max(analysis.particles, targets) > 1:
        figure, ax = new_figure()
        plot_bond_lengths(history.series_times, shortest, longest, ax=ax)
        _save(figure, folder / "bonds.png", analysis)

    bodies: dict[str, BodyAnalysis] = {"": analysis}
    if analysis.target is not None:
        bodies["target_"] = analysis.target
    for name, body in bodies.items():
        if body.masses.size == 1:
            continue
        theory = mode_theory(analysis) if not name else None
        figure, ax = new_figure()
        plot_spectrum(body.mode_energies, energy, theory=theory, ax=ax)
        _save(figure, folder / f"{name}spectrum.png", analysis)

        figure, ax = new_figure()
        motion = body.history
        over_time = mode_energies(motion.displacements, motion.velocities, stiffness, body.masses)
        plot_mode_heat_map(motion.times, over_time, energy, last_contact=last, ax=ax)
        _save(figure, folder / f"{name}mode_heat_map.png", analysis)


def _save(figure: "Figure", path: Path, analysis: CollisionAnalysis) -> None:
    caption = describe(analysis)
    if analysis.contradictions:
        caption += " (CONTRADICTED, see analysis.json)"
    figure.suptitle(
        caption + rf", $\eta$ = {analysis.restitution:.5g}", x=0.01, ha="left", fontsize=9
    )
    plain = caption.replace("$", "").replace("_", "")
    metadata = {"Title": path.stem, "Description": f"{plain}, eta = {analysis.restitution:.12g}"}
    figure.savefig(path, dpi=200, metadata=metadata)
