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
from chaincor.analysis.results import BodyAnalysis, CollisionAnalysis
from chaincor.analysis.theory import measured_contacts_energies

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLUMNS = {
    "contacts.csv": ("contact", "time", "interval", "incoming_speed"),
    "modes.csv": ("mode", "frequency", "energy", "share", "basile_dumont_energy"),
    "history.csv": ("time", "momentum", "translation", "vibration", "bond_min", "bond_max"),
}


# What is told as it is, before and after what follows from the bond.
_TOLD_FIRST = (
    *("restitution", "restitution_error", "data_error", "kinematic_restitution", "contacts"),
    *("particles", "masses", "velocity", "bond_min", "bond_max", "energy_drift"),
)
_TOLD = (
    *("anharmonic_remainder", "momentum_residual", "velocity_after", "ending", "finished"),
    *("frames", "time_start", "time_end", "contact_times", "contact_speeds"),
    *("mode_energies", "mode_energies_start", "contradictions", "caveats"),
)


def to_json_object(analysis: CollisionAnalysis) -> dict[str, Any]:
    """Return the results as plain numbers and lists; numbers that are not known are None."""
    bond, target = analysis.bond, analysis.target
    v_star = None if bond is None else bond.natural_speed
    end = analysis.energy_end
    told = {name: _plain(getattr(analysis, name)) for name in _TOLD_FIRST}
    told |= {
        "last_contact_time": analysis.contact_statistics.last_time,
        "contact_statistics": analysis.contact_statistics.to_dict(),
        "contact_detection": analysis.detection.method,
        "potential": None if bond is None else bond.name,
        "v_star": v_star,
        "speed": None if v_star is None else analysis.velocity / v_star,
        "energy_start": _energy_of_all(analysis, "energy_start"),
        "energy_end": _energy_of_all(analysis, "energy_end"),
        "translation_end": float(analysis.mode_energies[0]),
        "vibration_end": None if end is None else float(end.vibration),
    }
    told |= {name: _plain(getattr(analysis, name)) for name in _TOLD}
    if target is None and not analysis.soft:
        return told
    told |= {
        "target_particles": 0 if target is None else target.masses.size,
        "target_velocity_after": None if target is None else target.velocity_after,
    }
    for name in ("masses", "mode_energies", "mode_energies_start"):
        told[f"target_{name}"] = [] if target is None else _plain(getattr(target, name))
    for owner, body in (("", analysis), ("target_", target)):
        energy = None if body is None else body.energy_end
        for part in ("translation", "vibration"):
            value = None if energy is None else float(getattr(energy, part))
            told[f"{owner}{part}al_energy"] = value
    return told


def _plain(value: Any) -> Any:
    """Return a value as JSON knows it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return list(value) if isinstance(value, tuple) else value


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
            "contact_times": analysis.contact_times,
            "contact_speeds": analysis.contact_speeds,
            "times": history.times,
            **_arrays_of(analysis, ""),
        }
        if analysis.target is not None:
            arrays |= _arrays_of(analysis.target, "target_", along=-1.0)
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


def _arrays_of(body: BodyAnalysis, owner: str, along: float = 1.0) -> dict[str, Any]:
    """Return the arrays of a body by name; `along` is -1 for a target, which is mirrored."""
    names = ("masses", "mode_frequencies", "mode_energies", "mode_energies_start")
    motion = {name: along * getattr(body.history, name) for name in ("displacements", "velocities")}
    found = {name: getattr(body, name) for name in names} | motion
    return {f"{owner}{name}": array for name, array in found.items()}


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

    bodies: dict[str, BodyAnalysis] = {"": analysis}
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
    # The formula has the modes of equal masses, and a wall.
    if not _has_equal_masses(analysis) or analysis.target is not None:
        return None
    return measured_contacts_energies(
        analysis.particles,
        analysis.contact_statistics,
        analysis.velocity,
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
