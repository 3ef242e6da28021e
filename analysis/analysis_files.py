"""Write the results of an analysis as JSON, CSV and NPZ."""

import csv
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from chaincor.analysis.atomic_write import folder_aside, publish, write_arrays
from chaincor.analysis.collision_figures import draw_figures, energy_series, mode_theory
from chaincor.analysis.observables import OF_DUMPS
from chaincor.analysis.results import CollisionAnalysis

_COLUMNS = {
    "contacts.csv": ("contact", "time", "interval", "incoming_speed"),
    "modes.csv": ("mode", "frequency", "energy", "share", "basile_dumont_energy"),
    "history.csv": ("time", "momentum", "translation", "vibration", "bond_min", "bond_max"),
}


def to_json_object(analysis: CollisionAnalysis) -> dict[str, Any]:
    """Return the results as plain numbers and lists; an unknown number is None."""
    two_bodies = analysis.target is not None or analysis.soft
    return {
        each.name: _plain(each.dump(analysis))
        for each in OF_DUMPS
        if each.dump is not None and (two_bodies or not each.only_two_bodies)
    }


def _plain(value: Any) -> Any:
    """Convert a value to a type that JSON supports."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return list(value) if isinstance(value, tuple) else value


def write_analysis(
    analysis: CollisionAnalysis,
    folder: Path | str,
    figures: bool = True,
    finish: Callable[[Path], None] | None = None,
) -> Path:
    """
    Write ``analysis.json``, ``arrays.npz``, three CSV files and, if wanted, the figures.

    The data files are written first and are kept if a figure fails. Other files of the folder are
    unchanged. `finish` receives the temporary folder and may add files to it.
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
        }
        for owner, body in analysis.bodies.items():
            motion = body.history.mirrored if owner else body.history
            for name in ("masses", "mode_frequencies", "mode_energies", "mode_energies_start"):
                arrays[f"{owner}{name}"] = getattr(body, name)
            for name in ("displacements", "velocities"):
                arrays[f"{owner}{name}"] = getattr(motion, name)
        write_arrays(aside / "arrays.npz", arrays)
        _write_table(aside / "contacts.csv", _contact_rows(analysis))
        _write_table(aside / "modes.csv", _mode_rows(analysis))
        columns = (history.series_times, history.momentum, *energy_series(analysis))
        _write_table(aside / "history.csv", np.column_stack(columns).tolist())
        publish(aside, folder)
        if figures:
            draw_figures(analysis, aside)
        if finish is not None:
            finish(aside)
    return folder


def _contact_rows(analysis: CollisionAnalysis) -> Iterable[tuple]:
    intervals: list = ["", *np.diff(analysis.contact_times).tolist()][: len(analysis.contact_times)]
    times, speeds = analysis.contact_times.tolist(), analysis.contact_speeds.tolist()
    return zip(range(1, len(times) + 1), times, intervals, speeds, strict=True)


def _mode_rows(analysis: CollisionAnalysis) -> Iterable[tuple]:
    energies = analysis.mode_energies
    theory = mode_theory(analysis) if analysis.particles > 1 else None
    predicted = [""] * energies.size if theory is None else ["", *theory.tolist()]
    columns = analysis.mode_frequencies, energies, energies / analysis.energy_at_impact
    lists = (column.tolist() for column in columns)
    return zip(range(energies.size), *lists, predicted, strict=True)


def _write_table(path: Path, rows: Iterable) -> None:
    with path.open("w", newline="", encoding="ascii") as file:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS[path.name])
        writer.writerows(rows)
