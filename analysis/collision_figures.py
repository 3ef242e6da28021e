"""Draw the figures of one analysed collision, for both bodies together."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.modes import are_equal, mode_energies
from chaincor.analysis.results import CollisionAnalysis
from chaincor.analysis.theory import measured_contacts_energies
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import stiffness_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def caption_of(analysis: CollisionAnalysis) -> str:
    """Return the scene in a few words, such as ``lj, n = 100, v0 = 0.4 v*``."""
    bond = analysis.bond
    if bond is None or bond.natural_speed is None:
        speed = f"$v_0$ = {analysis.velocity:.4g}"
    else:
        speed = f"$v_0$ = {analysis.velocity / bond.natural_speed:.4g} $v^*$"
    name = "bond not known" if bond is None else bond.name
    unequal = "" if are_equal(analysis.masses) else ", unequal masses"
    return f"{name}, $n$ = {analysis.particles}{unequal}{analysis.against}, {speed}"


def energy_series(analysis: CollisionAnalysis) -> tuple[Array, ...]:
    """
    Return translation, vibration, and shortest and longest bond of both bodies in each frame.

    Translation is the motion of the bodies relative to each other, without their common motion.
    """
    history = analysis.history
    own = history.translation, history.vibration, history.bond_min, history.bond_max
    if analysis.target is None:
        return own
    other = analysis.target.history
    total, others = float(np.sum(analysis.masses)), float(np.sum(analysis.target.masses))
    # The target is mirrored, and its momentum has the opposite sign.
    relative = history.momentum / total + other.momentum / others
    return (
        0.5 * relative**2 / (1.0 / total + 1.0 / others),
        history.vibration + other.vibration,
        np.fmin(history.bond_min, other.bond_min),
        np.fmax(history.bond_max, other.bond_max),
    )


def along_the_line(analysis: CollisionAnalysis) -> tuple[Array, Array]:
    """Return displacements and velocities along x in each frame, those of a target first."""
    target = analysis.target
    return analysis.history.along_the_line(None if target is None else target.history.mirrored)


def mode_theory(analysis: CollisionAnalysis) -> Array | None:
    """Return the mode energies of Basile and Dumont for the contacts of this collision."""
    # The formula holds only for equal masses that hit a wall.
    if not are_equal(analysis.masses) or analysis.target is not None:
        return None
    return measured_contacts_energies(
        analysis.particles,
        analysis.contact_statistics,
        analysis.velocity,
        stiffness=stiffness_of(analysis.bond),
        mass=float(analysis.masses[0]),
    )


def draw_figures(analysis: CollisionAnalysis, folder: Path) -> None:
    """Draw every figure of one collision as PNG."""
    from chaincor.analysis.figures.modes import plot_mode_heat_map, plot_spectrum
    from chaincor.analysis.figures.style import new_figure
    from chaincor.analysis.figures.time_series import (
        plot_bond_lengths,
        plot_contact_intervals,
        plot_contact_speeds,
        plot_energy_partition,
    )
    from chaincor.analysis.figures.trajectories import plot_trajectories

    history = analysis.history
    stiffness = stiffness_of(analysis.bond)
    # Waves that are much longer than the repeating pattern of masses depend only on the mean mass.
    light = stiffness / float(np.mean(analysis.masses))
    energy = analysis.energy_at_impact
    last = analysis.contact_statistics.last_time
    targets = analysis.target_particles
    translation, vibration, shortest, longest = energy_series(analysis)

    drawn = partial(_drawn, analysis, folder)
    with drawn("trajectories.png") as ax:
        plot_trajectories(
            history.times,
            along_the_line(analysis)[0],
            targets=targets,
            contact_times=analysis.contact_times,
            sound_speed=light**0.5,
            ax=ax,
        )
    if not analysis.soft:
        figure, (upper, lower) = new_figure(2, 1, figsize=(6.0, 5.2), sharex=True)
        # The dashed line shows the theory for two particles that hit a wall.
        alike = are_equal(analysis.masses) and not targets
        plot_contact_intervals(analysis.contact_times, stiffness=light if alike else None, ax=upper)
        plot_contact_speeds(analysis.contact_speeds, analysis.velocity, pair_line=alike, ax=lower)
        upper.set_xlabel("")
        _save(figure, folder / "contacts.png", analysis)
    times = history.series_times
    with drawn("energy.png") as ax:
        plot_energy_partition(times, translation, vibration, energy, last_contact=last, ax=ax)
    if max(analysis.particles, targets) > 1:
        with drawn("bonds.png") as ax:
            plot_bond_lengths(times, shortest, longest, ax=ax)
    for name, body in analysis.bodies.items():
        if body.masses.size == 1:
            continue
        theory = mode_theory(analysis) if not name else None
        with drawn(f"{name}spectrum.png") as ax:
            plot_spectrum(body.mode_energies, energy, theory=theory, ax=ax)
        motion = body.history
        over_time = mode_energies(motion.displacements, motion.velocities, stiffness, body.masses)
        with drawn(f"{name}mode_heat_map.png") as ax:
            plot_mode_heat_map(motion.times, over_time, energy, last_contact=last, ax=ax)


def animate(analysis: CollisionAnalysis, path: Path) -> None:
    """Write an animation of one collision."""
    from chaincor.analysis.figures.animation import animate_collision

    times = analysis.history.times
    # After the last contact the chain only flies away. The animation therefore ends soon
    # afterwards.
    shown = times <= 1.25 * (analysis.contact_statistics.last_time or times[-1])
    displacements, velocities = along_the_line(analysis)
    animate_collision(
        times[shown],
        displacements[shown],
        velocities[shown],
        path,
        targets=analysis.target_particles,
        impact_velocity=analysis.velocity,
        title=caption_of(analysis),
    )


@contextmanager
def _drawn(analysis: CollisionAnalysis, folder: Path, name: str) -> Iterator["Axes"]:
    """Yield the axes of a figure, and save the figure after the block."""
    from chaincor.analysis.figures.style import new_figure

    figure, ax = new_figure()
    yield ax
    _save(figure, folder / name, analysis)


def _save(figure: "Figure", path: Path, analysis: CollisionAnalysis) -> None:
    caption = caption_of(analysis)
    if analysis.contradictions:
        caption += " (CONTRADICTED, see analysis.json)"
    figure.suptitle(
        caption + rf", $\eta$ = {analysis.restitution:.5g}", x=0.01, ha="left", fontsize=9
    )
    plain = caption.replace("$", "").replace("_", "")
    metadata = {"Title": path.stem, "Description": f"{plain}, eta = {analysis.restitution:.12g}"}
    figure.savefig(path, dpi=200, metadata=metadata)
