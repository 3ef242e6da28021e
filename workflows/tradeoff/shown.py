"""Write a trade-off study as text, page, JSON, CSV and figures."""

import platform
from dataclasses import asdict
from pathlib import Path
from typing import Any

from chaincor.analysis.observables import TERMS
from chaincor.analysis.showing.numbers import known_digits
from chaincor.workflows.json_output import finite, stamped
from chaincor.workflows.pages.page import StudyReport
from chaincor.workflows.showing.terms import OF_STUDIES
from chaincor.workflows.tradeoff.budget import CAUSES
from chaincor.workflows.tradeoff.front import (
    CheapestRow,
    describe_setting,
    format_seconds,
    pareto_front,
    promised_errors,
)
from chaincor.workflows.tradeoff.settings import Measurement, time_unit
from chaincor.workflows.tradeoff.study import Tradeoff
from chaincor.workflows.versions import processor, versions

REPORT = StudyReport(
    name="tradeoff",
    package="chaincor.workflows.tradeoff",
    tables={
        "work_precision.csv": "each setting: errors, times, steps, table",
        "error_budget.csv": "errors by cause",
        "tables.csv": "errors by bond table",
    },
    figures={
        "work_precision": (
            "Error against time",
            "Each mark shows the root-mean-square error of eta of one setting "
            "against the processor time of the integration. Error bars reach from "
            "the smallest to the largest error of its runs. Settings further down "
            "and to the left are better. The grey line is the front that no "
            "setting of LAMMPS beats.",
        ),
        "error_budget": (
            "Error by cause",
            "The bars show the effect of each single cause on eta, measured by a "
            "run without it. The total is the error of the setting.",
        ),
        "tables": (
            "Tabulated bonds",
            "The curves show the error of eta that a linear or spline bond table "
            "causes, against its number of rows. The table covers the bond lengths "
            "of this scene or a wide range.",
        ),
    },
)
_SETTING = ("engine", "wall", "scheme", "table")
_ERRORS = ("median_error", "rms_error", "worst_error", "contact_time_error", "mode_energy_error")
# JSON contains these additional fields of the reference run and of the budgets, in this order.
_REFERENCE = (
    *("restitution", "restitution_error", "last_contact_time", "last_contact_time_error"),
    *("mode_energies_error", "contacts", "source"),
)
_BUDGET = ("name", "scheme", "timestep", "total", "output_exact", *CAUSES)


def describe_study(study: Tradeoff) -> str:
    """Describe a study in words: the cheapest settings, the error budgets and the advice."""
    reference, scene = study.reference, study.scene
    lines = [
        f"{scene.particles} particles, {scene.label} bonds, v0 = {scene.impact_velocity:.6g}",
        f"eta = {reference.restitution:.14g} +- {reference.restitution_error:.0e} "
        f"({reference.source})",
        "",
        "cheapest settings: promised error of eta, with a safety factor; measured errors",
        "of eta, of the last contact's time, of mode energies; time of the integration",
        f"    {'kept':>5}  {'eta':>7}  {'contact':>7}  {'modes':>7}  {'time':>8}  setting",
    ]
    for engine, rows in study.cheapest.items():
        lines.append(f"  {'LAMMPS' if engine == 'lammps' else 'reference engine'}")
        lines += [
            f"    {row.error:.0e}  {row.measured_error:7.1e}  {row.contact_time_error:7.1e}  "
            f"{row.mode_energy_error:7.1e}  {format_seconds(row.seconds):>8}  "
            f"{describe_setting(row.setting)}"
            for row in rows
        ]
        if not rows:
            lines.append("    no setting reached 1e-2")
    lines += ["", "error of eta by cause:"]
    lines.append("    " + "".join(f"{name:>12}" for name in ("", *CAUSES, "total")))
    for budget in study.budgets:
        values = (*budget.parts().values(), budget.total)
        cells = ("-" if value is None else f"{value:.1e}" for value in values)
        lines.append("    " + "".join(f"{cell:>12}" for cell in (budget.name, *cells)))
    lines.append(
        "    (output: error of eta from a default dump with six digits; "
        f"{study.budgets[0].output_exact:.0e} with 17 digits)"
        if study.budgets
        else "    none"
    )
    if study.own_tables:
        lines += ["", "error of eta due to linear tables over the bond lengths of this scene:"]
        cells = (f"{p.rows} rows {p.restitution_error:.0e}" for p in study.own_tables)
        lines.append("    " + ", ".join(cells))
    if study.stock:
        lines += ["", "the stock reflecting wall (median, rms, worst over phases):"]
        lines += [
            f"    H {m.setting.timestep:<8.4g} {m.median_error:.1e}  {m.rms_error:.1e}  "
            f"{m.worst_error:.1e}  {format_seconds(m.time):>8}"
            for m in study.stock
        ]
    if study.failed:
        lines += ["", f"{len(study.failed)} settings did not run, because their step is too large"]
    lines += ["", f"advice: {study.advice}", f"({study.seconds:.0f} s)"]
    return "\n".join(lines)


def measurement_row(
    study: Tradeoff, measurement: Measurement, on_front: bool, promised: float | None
) -> dict[str, Any]:
    """Return the results of one setting as a row; `promised` is the error that it promises."""
    setting, done = measurement.setting, bool(measurement.seconds) and not measurement.failure
    setups = sorted(measurement.setup_seconds)
    return {
        **{name: getattr(setting, name) for name in _SETTING},
        "table_points": measurement.table_points,
        "timestep": setting.timestep,
        "scaled_timestep": setting.timestep / time_unit(study.scene, setting.wall),
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
    plain = asdict(row)
    return finite({"error": row.error, **plain.pop("setting"), **plain})


def to_dict(study: Tradeoff) -> dict[str, Any]:
    """Return a study as plain values."""
    reference, scene = study.reference, study.scene
    front = {id(m) for m in pareto_front(study.measurements)}
    promises = promised_errors(study.measurements)
    return {
        "potential": scene.label,
        "particles": scene.particles,
        "velocity": scene.impact_velocity,
        "truth": {name: finite(getattr(reference, name)) for name in _REFERENCE},
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
    """Write a study: ``tradeoff.html``, JSON, three CSV files, and figures as PNG and SVG."""
    from chaincor.workflows.tradeoff.figures import (
        plot_error_budget,
        plot_table_errors,
        plot_work_precision,
    )

    plain = to_dict(study)
    rows = (plain["settings"], plain["budgets"], plain["tables"])
    tables = {name: each for name, each in zip(REPORT.tables, rows, strict=True) if each}
    floor = study.reference.restitution_error
    drawn = {"work_precision": plot_work_precision(study.measurements, floor)}
    if study.budgets:
        drawn["error_budget"] = plot_error_budget(study.budgets)
    if study.tables:
        drawn["tables"] = plot_table_errors(study.tables)
    REPORT.write(folder, stamped(plain, study.scene), tables, drawn, _page(study))


def _page(study: Tradeoff) -> dict[str, Any]:
    """Return the parts of the page that pages of other studies do not have."""
    reference, scene = study.reference, study.scene
    shown = f"{scene.particles} particles, {scene.label} bonds"
    return {
        "shown": shown,
        "heading": f"{shown}, v0 = {scene.impact_velocity:.6g}",
        "eta": known_digits(reference.restitution, reference.restitution_error),
        "eta_error": f"{reference.restitution_error:.0e}",
        "source": reference.source,
        "contacts": reference.contacts,
        "advice": study.advice,
        "cheapest": {
            "LAMMPS" if engine == "lammps" else "reference engine": [
                (row, describe_setting(row.setting), format_seconds(row.seconds)) for row in rows
            ]
            for engine, rows in study.cheapest.items()
        },
        "causes": CAUSES,
        "budgets": study.budgets,
        "tables": study.own_tables,
        "stock": [(m, format_seconds(m.time)) for m in study.stock],
        "failed": [(describe_setting(m.setting), m.failure) for m in study.failed],
        "terms": {
            **{name: TERMS[name] for name in ("restitution (energy)", "contacts", "run by")},
            **OF_STUDIES,
        },
        "settings": {
            **{f"scene: {key}": str(value) for key, value in scene.canonical_fields.items()},
            "scene: SHA-256": scene.sha256,
            "settings measured": f"{len(study.measurements)}, in {study.seconds:.0f} s",
            "processor": processor(),
        },
    }
