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
from chaincor.analysis.results import CollisionAnalysis
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
    start, end = analysis.energy_start, analysis.energy_end
    bond = analysis.bond
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
        "energy_start": None if start is None else float(start.total),
        "energy_end": None if end is None else float(end.total),
        "energy_drift": analysis.energy_drift,
        "translation_end": float(analysis.mode_energies[0]),
        "vibration_end": None if end is None else float(end.vibration),
        "anharmonic_remainder": analysis.anharmonic_remainder,
        "momentum_residual": analysis.momentum_residual,
        "ending": analysis.ending,
        "frames": analysis.frames,
        "time_start": analysis.time_start,
        "time_end": analysis.time_end,
        "contact_times": analysis.contact_times.tolist(),
        "contact_speeds": analysis.contact_speeds.tolist(),
        "mode_energies": analysis.mode_energies.tolist(),
        "mode_energies_start": analysis.mode_energies_start.tolist(),
        "contradictions": list(analysis.contradictions),
        "caveats": list(analysis.caveats),
    }


def describe(analysis: CollisionAnalysis) -> str:
    """Return the scene in a few words, such as ``lj, n = 100, v0 = 0.4 v*``."""
    bond = analysis.bond
    if bond is None or bond.natural_speed is None:
        speed = f"$v_0$ = {analysis.velocity:.4g}"
    else:
        speed = f"$v_0$ = {analysis.velocity / bond.natural_speed:.4g} $v^*$"
    name = "bond not known" if bond is None else bond.name
    unequal = "" if _has_equal_masses(analysis) else ", unequal masses"
    return f"{name}, $n$ = {analysis.particles}{unequal}, {speed}"


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
        write_arrays(aside / "arrays.npz", arrays)
        _write_table(aside / "contacts.csv", _contact_rows(analysis))
        _write_table(aside / "modes.csv", _mode_rows(analysis))
        columns = (
            history.series_times,
            history.momentum,
            history.translation,
            history.vibration,
            history.bond_min,
            history.bond_max,
        )
        _write_table(aside / "history.csv", np.column_stack(columns).tolist())
        if figures:
            draw_figures(analysis, aside)
        if finish is not None:
            finish(aside)
    return folder


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

    figure, ax = new_figure()
    plot_trajectories(
        history.times,
        history.displacements,
        contact_times=analysis.contact_times,
        sound_speed=light**0.5,
        ax=ax,
    )
    _save(figure, folder / "trajectories.png", analysis)

    figure, (upper, lower) = new_figure(2, 1, figsize=(6.0, 5.2), sharex=True)
    alike = _has_equal_masses(analysis)
    plot_contact_intervals(analysis.contact_times, stiffness=light if alike else None, ax=upper)
    plot_contact_speeds(analysis.contact_speeds, analysis.velocity, pair_line=alike, ax=lower)
    upper.set_xlabel("")
    _save(figure, folder / "contacts.png", analysis)

    figure, ax = new_figure()
    plot_energy_partition(
        history.series_times,
        history.translation,
        history.vibration,
        energy,
        last_contact=last,
        ax=ax,
    )
    _save(figure, folder / "energy.png", analysis)

    if analysis.particles > 1:
        figure, ax = new_figure()
        plot_bond_lengths(history.series_times, history.bond_min, history.bond_max, ax=ax)
        _save(figure, folder / "bonds.png", analysis)

        figure, ax = new_figure()
        plot_spectrum(analysis.mode_energies, energy, theory=_theory(analysis), ax=ax)
        _save(figure, folder / "spectrum.png", analysis)

        figure, ax = new_figure()
        over_time = mode_energies(
            history.displacements, history.velocities, stiffness, analysis.masses
        )
        plot_mode_heat_map(history.times, over_time, energy, last_contact=last, ax=ax)
        _save(figure, folder / "mode_heat_map.png", analysis)


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
    if not _has_equal_masses(analysis):  # the formula has the modes of equal masses
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
    return 0.5 * float(np.sum(analysis.masses)) * analysis.velocity**2 * bound


def _has_equal_masses(analysis: CollisionAnalysis) -> bool:
    return bool(np.all(analysis.masses == analysis.masses[0]))


def _contact_rows(analysis: CollisionAnalysis) -> Iterable[tuple]:
    intervals = ["", *np.diff(analysis.contact_times).tolist()]
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
