"""A study in files: a page, JSON, CSV and figures."""

import csv
import json
import platform
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from chaincor.analysis.atomic_write import folder_aside
from chaincor.workflows.json_output import finite, stamped
from chaincor.workflows.tradeoff.budget import CAUSES, ErrorBudget
from chaincor.workflows.tradeoff.front import (
    CheapestRow,
    find_series,
    pareto_front,
    promised_errors,
)
from chaincor.workflows.tradeoff.measurement import Measurement
from chaincor.workflows.tradeoff.page import write_study_page
from chaincor.workflows.tradeoff.settings import time_unit
from chaincor.workflows.tradeoff.study import Tradeoff
from chaincor.workflows.versions import versions

_STOCK_REFLECTING = "stock wall"
_ERRORS = ("median_error", "rms_error", "worst_error", "contact_time_error", "mode_energy_error")
# Of the truth and of budgets, in this order, beside their other numbers.
_TRUTH = (
    *("restitution", "restitution_error", "last_contact_time", "last_contact_time_error"),
    *("mode_energies_error", "contacts", "source"),
)
_BUDGET = ("name", "scheme", "timestep", "total", "output_exact", *CAUSES)


def measurement_row(
    study: Tradeoff, measurement: Measurement, on_front: bool, promised: float | None
) -> dict[str, Any]:
    """Return one setting's results, flat; `promised` is the error it can be trusted to keep."""
    setting, done = measurement.setting, bool(measurement.seconds) and not measurement.failure
    setups = sorted(measurement.setup_seconds)
    return {
        **asdict(setting.series),
        "table_points": measurement.table_points,
        "timestep": setting.timestep,
        "scaled_timestep": setting.timestep / time_unit(study.scene, setting.series.wall),
        "phases": len(measurement.seconds),
        "failure": measurement.failure,
        "on_front": on_front,
        **{name: finite(getattr(measurement, name)) if done else None for name in _ERRORS},
        "promised_error": promised,
        "seconds": measurement.time if done else None,
        "setup_seconds": setups[len(setups) // 2] if done else None,
        "force_evaluations": measurement.force_evaluations,
    }


def _cheapest_row(row: CheapestRow) -> dict[str, Any]:
    setting = row.setting
    head = {"error": row.error, **asdict(setting.series), "timestep": setting.timestep}
    return head | {f.name: finite(getattr(row, f.name)) for f in fields(row)[2:]}


def to_dict(study: Tradeoff) -> dict[str, Any]:
    """Return a study as plain values."""
    truth, scene = study.truth, study.scene
    front = {id(m) for m in pareto_front(study.measurements)}
    promises = promised_errors(study.measurements)
    return {
        "potential": scene.label,
        "particles": scene.particles,
        "velocity": scene.impact_velocity,
        "truth": {name: finite(getattr(truth, name)) for name in _TRUTH},
        "settings": [
            measurement_row(study, m, id(m) in front, promises.get(m.setting))
            for m in study.measurements
        ],
        "cheapest": {
            engine: [_cheapest_row(row) for row in rows] for engine, rows in study.cheapest.items()
        },
        "budgets": [{name: getattr(b, name) for name in _BUDGET} for b in study.budgets],
        "tables": [vars(point) for point in study.tables],
        "tolerance": study.tolerance,
        "advice": study.advice,
        "seconds_total": study.seconds,
        "machine": f"{platform.machine()} {platform.system()}",
        "versions": versions(),
    }


def write_study(study: Tradeoff, folder: Path) -> None:
    """Write a study: ``tradeoff.html``, its JSON, three CSV files, and figures as PNG and SVG."""
    plain = to_dict(study)
    with folder_aside(folder) as aside:
        (aside / "tradeoff.json").write_text(
            json.dumps(stamped(plain, study.scene), indent=2, allow_nan=False) + "\n"
        )
        _write_csv(aside / "work_precision.csv", plain["settings"])
        _write_csv(aside / "error_budget.csv", plain["budgets"])
        _write_csv(aside / "tables.csv", plain["tables"])
        _draw(study, aside)
        write_study_page(study, plain, aside)


def _write_csv(path: Path, rows: list[dict[str, Any]]) -> None:
    if not rows:
        return
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _bars_name(budget: ErrorBudget) -> str:
    return f"{budget.name}\n{budget.scheme}, H {budget.timestep:.3g}"


def _draw(study: Tradeoff, folder: Path) -> None:
    from matplotlib.figure import Figure

    from chaincor.analysis.figures.work_precision import (
        TableCurve,
        WorkPrecisionCurve,
        plot_error_budget,
        plot_table_errors,
        plot_work_precision,
    )

    curves = []
    done = [m for m in study.measurements if not m.failure and m.seconds]
    for series in find_series(done):
        own = [m for m in done if m.setting.series == series]
        curves.append(
            WorkPrecisionCurve(
                label=series.label,
                group=_STOCK_REFLECTING if series.wall == "reflect" else series.engine,
                scheme=series.scheme,
                dashed=series.table == "linear",
                seconds=[m.time for m in own],
                errors=[m.rms_error for m in own],
                lowest=[float(m.errors.min()) for m in own],
                highest=[m.worst_error for m in own],
            )
        )
    front = pareto_front(m for m in done if m.setting.series.engine == "lammps")
    figures = {
        "work_precision": plot_work_precision(
            curves,
            front=([m.time for m in front], [m.rms_error for m in front]),
            floor=study.truth.restitution_error,
        )
    }
    if study.budgets:
        figures["error_budget"] = plot_error_budget(
            {_bars_name(budget): budget.parts() for budget in study.budgets},
            {_bars_name(budget): budget.total for budget in study.budgets},
        )
    if study.tables:
        kinds = dict.fromkeys((p.style, p.bond_range) for p in study.tables)
        figures["tables"] = plot_table_errors(
            [
                TableCurve(
                    style=style,
                    bond_range=name,
                    rows=[p.rows for p in study.tables if (p.style, p.bond_range) == (style, name)],
                    errors=[
                        p.restitution_error
                        for p in study.tables
                        if (p.style, p.bond_range) == (style, name)
                    ],
                )
                for style, name in kinds
            ]
        )
    for name, axes in figures.items():
        figure = axes.get_figure()
        assert isinstance(figure, Figure)
        for ending in ("png", "svg"):
            figure.savefig(folder / f"{name}.{ending}")
