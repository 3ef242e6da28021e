"""Results of an analysis as JSON, CSV, NPZ and pictures."""

import csv
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.atomic_write import folder_aside, write_arrays
from chaincor.analysis.modes import mode_energies
from chaincor.analysis.results import CollisionAnalysis, TargetAnalysis
from chaincor.analysis.theory import measured_contacts_energies

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLUMNS = {
    "contacts.csv": ("contact", "time", "interval", "incoming_speed"),
    "modes.csv": ("mode", "frequency", "energy", "share", "basile_dumont_energy"),
    "history.csv": ("time", "momentum", "translation", "vibration", "bond_min", "bond_max"),
}


def to_json_object(analysis: CollisionAnalysis) -> dict[str, Any]:
    """Return the results as plain numbers and lists; numbers that are not known are None."""
    start, end = _energy_of_all(analysis, "energy_start"), _energy_of_all(analysis, "energy_end")
    bond, target = analysis.bond, analysis.target
    of_bodies: dict[str, Any] = {}
    if target is not None or analysis.soft:
        of_bodies = {
            "target_particles": 0 if target is None else target.masses.size,
            "target_masses": [] if target is None else target.masses.tolist(),
            "target_velocity_after": None if target is None else target.velocity_after,
            "target_mode_energies": [] if target is None else target.mode_energies.tolist(),
            "target_mode_energies_start": []
            if target is None
            else target.mode_energies_start.tolist(),
        }
        ends = {"": analysis.energy_end, "target_": None if target is None else target.energy_end}
        for name, energy in ends.items():
            parts = (None, None) if energy is None else (energy.translation, energy.vibration)
            for part, value in zip(("translational", "vibrational"), parts, strict=True):
                of_bodies[f"{name}{part}_energy"] = None if value is None else float(value)
    v_star = None if bond is None else bond.natural_speed
    return {
        "restitution": analysis.restitution,
        "restitution_error": analysis.restitution_error,
        "data_error": analysis.data_error,
        "kinematic_restitution": analysis.kinematic_restitution,
        "contacts": analysis.contacts,
        "last_contact_time": analysis.contact_statistics.last_time,
        "contact_statistics": analysis.contact_statistics.to_dict(),
        "contact_detection": analysis.detection.method,
        "particles": analysis.particles,
        "masses": analysis.masses.tolist(),
        "potential": None if bond is None else bond.name,
        "velocity": analysis.velocity,
        "v_star": v_star,
        "speed": None if v_star is None else analysis.velocity / v_star,
        "bond_min": _finite(analysis.bond_min),
        "bond_max": _finite(analysis.bond_max),
        "energy_start": start,
        "energy_end": end,
        "energy_drift": analysis.energy_drift,
        "translation_end": float(analysis.mode_energies[0]),
        "vibration_end": None
        if analysis.energy_end is None
        else float(analysis.energy_end.vibration),
        "anharmonic_remainder": analysis.anharmonic_remainder,
        "momentum_residual": analysis.momentum_residual,
        "velocity_after": analysis.velocity_after,
        "ending": analysis.ending,
        "finished": analysis.finished,
        "frames": analysis.frames,
        "time_start": analysis.time_start,
        "time_end": analysis.time_end,
        "contact_times": analysis.contact_times.tolist(),
        "contact_speeds": analysis.contact_speeds.tolist(),
        "mode_energies": analysis.mode_energies.tolist(),
        "mode_energies_start": analysis.mode_energies_start.tolist(),
        "contradictions": list(analysis.contradictions),
        "caveats": list(analysis.caveats),
    } | of_bodies


def _energy_of_all(analysis: CollisionAnalysis, name: str) -> float | None:
    """Return the energy of all bodies; None where the bond is not known."""
    bodies = [analysis] if analysis.target is None else [analysis, analysis.target]
    parts = [getattr(body, name) for body in bodies]
    return None if None in parts else sum(float(part.total) for part in parts)


def describe(analysis: CollisionAnalysis) -> str:
    """Return the scene in a few words, such as ``lj, n = 100, v0 = 0.4 v*``."""
    bond = analysis.bond
    if bond is None or bond.natural_speed is None:
        speed = f"$v_0$ = {analysis.velocity:.4g}"
    else:
        speed = f"$v_0$ = {analysis.velocity / bond.natural_speed:.4g} $v^*$"
    name = "bond not known" if bond is None else bond.name
    unequal = "" if _has_equal_masses(analysis) else ", unequal masses"
    return f"{name}, $n$ = {analysis.particles}{unequal}{analysis.against}, {speed}"


def write_report(
    analysis: CollisionAnalysis,
    folder: Path | str,
    figures: bool = True,
    finish: Callable[[Path], None] | None = None,
) -> Path:
    """
    Write ``analysis.json``, ``arrays.npz``, three CSV files and, if wanted, the figures.

    Files appear together when all are written; others in the folder stay. `finish` is called with
    the folder they are in until then, and may add to them.
    """
    folder = Path(folder)
    with folder_aside(folder) as aside:
        text = json.dumps(to_json_object(analysis), indent=1, allow_nan=False)
        (aside / "analysis.json").write_text(text + "\n", encoding="utf-8")
        history = analysis.history
        arrays = {
            "masses": analysis.masses,
            "contact_times": analysis.contact_times,
            "contact_speeds": analysis.contact_speeds,
            "mode_frequencies": analysis.mode_frequencies,
            "mode_energies": analysis.mode_energies,
            "mode_energies_start": analysis.mode_energies_start,
            "times": history.times,
            "displacements": history.displacements,
            "velocities": history.velocities,
        }
        if analysis.target is not None:
            target = analysis.target
            arrays |= {
                "target_masses": target.masses,
                "target_mode_frequencies": target.mode_frequencies,
                "target_mode_energies": target.mode_energies,
                "target_mode_energies_start": target.mode_energies_start,
                "target_displacements": -target.history.displacements,
                "target_velocities": -target.history.velocities,
            }
        write_arrays(aside / "arrays.npz", arrays)
        _write_table(aside / "contacts.csv", _contact_rows(analysis))
        _write_table(aside / "modes.csv", _mode_rows(analysis))
        columns = (history.series_times, history.momentum, *energy_series(analysis))
        _write_table(aside / "history.csv", np.column_stack(columns).tolist())
        if figures:
            draw_figures(analysis, aside)
        if finish is not None:
            finish(aside)
    return folder


def energy_series(analysis: CollisionAnalysis) -> tuple[NDArray[np.float64], ...]:
    """
    Return translation, vibration, shortest and longest bond of all frames, of both bodies.

    Translation is that of the bodies against each other; what both do as one body stays.
    """
    history = analysis.history
    own = history.translation, history.vibration, history.bond_min, history.bond_max
    if analysis.target is None:
        return own
    other = analysis.target.history
    total, others = float(np.sum(analysis.masses)), float(np.sum(analysis.target.masses))
    # The mirrored target's momentum counts the other way.
    relative = history.momentum / total + other.momentum / others
    return (
        0.5 * relative**2 / (1.0 / total + 1.0 / others),
        history.vibration + other.vibration,
        np.fmin(history.bond_min, other.bond_min),
        np.fmax(history.bond_max, other.bond_max),
    )


def along_the_line(analysis: CollisionAnalysis) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return displacements and velocities along x of all frames, a target's before the chain's."""
    history = analysis.history
    if analysis.target is None:
        return history.displacements, history.velocities
    other = analysis.target.history
    pairs = (
        (other.displacements, history.displacements),
        (other.velocities, history.velocities),
    )
    found = [np.concatenate((-far[:, ::-1], near), axis=1) for far, near in pairs]
    return found[0], found[1]


def draw_figures(analysis: CollisionAnalysis, folder: Path) -> None:
    """Draw every figure of one collision as PNG."""
    from chaincor.analysis.figures.bond_lengths import plot_bond_lengths
    from chaincor.analysis.figures.contact_intervals import (
        plot_contact_intervals,
        plot_contact_speeds,
    )
    from chaincor.analysis.figures.energy_partition import plot_energy_partition
    from chaincor.analysis.figures.mode_heat_map import plot_mode_heat_map
    from chaincor.analysis.figures.spectrum import plot_spectrum
    from chaincor.analysis.figures.style import new_figure
    from chaincor.analysis.figures.trajectories import plot_trajectories

    history = analysis.history
    stiffness = 1.0 if analysis.bond is None else analysis.bond.stiffness
    # Waves long against the period of unequal masses see the mean mass.
    light = stiffness / float(np.mean(analysis.masses))
    energy = _energy_at_impact(analysis)
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
        alike = _has_equal_masses(analysis) and not targets
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

    bodies: dict[str, CollisionAnalysis | TargetAnalysis] = {"": analysis}
    if analysis.target is not None:
        bodies["target_"] = analysis.target
    for name, body in bodies.items():
        if body.masses.size == 1:
            continue
        theory = _theory(analysis) if not name else None
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


def _theory(analysis: CollisionAnalysis) -> NDArray[np.float64] | None:
    """Return the Basile-Dumont energies with this collision's count, mean interval and speed."""
    statistics = analysis.contact_statistics
    if statistics.mean_interval is None or statistics.mean_speed is None:
        return None
    # The formula has the modes of equal masses, and a wall.
    if not _has_equal_masses(analysis) or analysis.target is not None:
        return None
    return measured_contacts_energies(
        analysis.particles,
        statistics.count,
        statistics.mean_interval,
        statistics.mean_speed * analysis.velocity,
        stiffness=1.0 if analysis.bond is None else analysis.bond.stiffness,
        mass=float(analysis.masses[0]),
    )


def _energy_at_impact(analysis: CollisionAnalysis) -> float:
    """Return the translational energy before, and for a chain that came vibrating, all energy."""
    bound = analysis.restitution_bound or 1.0
    mass = float(np.sum(analysis.masses))
    if analysis.target is not None:
        mass /= 1.0 + mass / float(np.sum(analysis.target.masses))
    return 0.5 * mass * analysis.velocity**2 * bound


def _has_equal_masses(analysis: CollisionAnalysis) -> bool:
    return bool(np.all(analysis.masses == analysis.masses[0]))


def _contact_rows(analysis: CollisionAnalysis) -> Iterable[tuple]:
    intervals: list = ["", *np.diff(analysis.contact_times).tolist()][: len(analysis.contact_times)]
    times, speeds = analysis.contact_times.tolist(), analysis.contact_speeds.tolist()
    return zip(range(1, len(times) + 1), times, intervals, speeds, strict=True)


def _mode_rows(analysis: CollisionAnalysis) -> Iterable[tuple]:
    energies = analysis.mode_energies
    theory = _theory(analysis) if analysis.particles > 1 else None
    predicted = [""] * energies.size if theory is None else ["", *theory.tolist()]
    total = _energy_at_impact(analysis)
    shares = (energies / total).tolist()
    frequencies = analysis.mode_frequencies.tolist()
    return zip(range(energies.size), frequencies, energies.tolist(), shares, predicted, strict=True)


def _write_table(path: Path, rows: Iterable) -> None:
    with path.open("w", newline="", encoding="ascii") as file:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS[path.name])
        writer.writerows(rows)


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
