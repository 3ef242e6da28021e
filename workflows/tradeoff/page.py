"""A study as one page: the advice, the cheapest settings, errors by cause, figures."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from chaincor.analysis.showing.numbers import known_digits
from chaincor.workflows.pages.page import drawn_figures, files_written, write_page
from chaincor.workflows.showing.terms import OF_STUDIES, TERMS
from chaincor.workflows.tradeoff.budget import CAUSES
from chaincor.workflows.tradeoff.front import describe, format_seconds
from chaincor.workflows.tradeoff.study import Tradeoff
from chaincor.workflows.versions import processor

PAGE = "tradeoff.html"

FIGURES = {
    "work_precision": (
        "Error against time",
        "Each mark is a setting: root mean square of the error of eta against the processor time "
        "of the integration; bars reach from the least to the worst of its runs. What is lower "
        "and further left is better; the grey line is the front that no setting of LAMMPS beats.",
    ),
    "error_budget": (
        "Error by cause",
        "What each cause alone does to eta, by the run that lacks it; total is the error of the "
        "setting.",
    ),
    "tables": (
        "Tabulated bonds",
        "The error of eta that a bond table of so many rows makes, linear or spline, over the bond "
        "lengths of this scene or a wide range.",
    ),
}

_HOLDS = {
    "tradeoff.json": "all numbers of the study",
    "work_precision.csv": "each setting: errors, times, steps, table",
    "error_budget.csv": "errors by cause",
    "tables.csv": "errors by bond table",
    "*.png": "figure",
    "*.svg": "figure",
}


def write_study_page(study: Tradeoff, plain: Mapping[str, Any], folder: Path) -> None:
    """Write ``tradeoff.html`` about the study whose files lie in a folder; `plain` goes to JSON."""
    truth, scene = study.truth, study.scene
    stock = [m for m in study.measurements if m.setting.series.wall == "reflect" and m.seconds]
    alt = f"{scene.particles} particles, {scene.label} bonds"
    contents = {
        "heading": f"{alt}, v0 = {scene.impact_velocity:.6g}",
        "eta": known_digits(truth.restitution, truth.restitution_error),
        "eta_error": f"{truth.restitution_error:.0e}",
        "source": truth.source,
        "contacts": truth.contacts,
        "advice": study.advice,
        "cheapest": {
            "LAMMPS" if engine == "lammps" else "in-house engine": [
                (row, describe(row.setting), format_seconds(row.seconds)) for row in rows
            ]
            for engine, rows in study.cheapest.items()
        },
        "causes": CAUSES,
        "budgets": study.budgets,
        "tables": [p for p in study.tables if p.style == "linear" and p.bond_range == "scene"],
        "stock": [(m, format_seconds(m.time)) for m in stock],
        "failed": [(describe(m.setting), m.failure) for m in study.measurements if m.failure],
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
        "versions": plain["versions"],
        "figures": drawn_figures(folder, FIGURES, alt),
        "written": files_written(folder, _HOLDS),
    }
    write_page(folder / PAGE, "chaincor.workflows.tradeoff", contents)
