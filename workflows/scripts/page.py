"""A study of a script as one page: verdict, ladder, advice, figure."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from chaincor.workflows.pages.page import drawn_figures, files_written, listed_file, write_page
from chaincor.workflows.scripts.description import told
from chaincor.workflows.scripts.study import ScriptStudy
from chaincor.workflows.showing.terms import OF_SCRIPTS

PAGE, JSON = "timestep.html", "timestep.json"

FIGURES = {
    "work_precision": (
        "Error against step and time",
        "Each mark is a run: how far its number is from the best value, against the variable and "
        "against processor time. Lines are the error that a run on the rung keeps and, where the "
        "error is regular, its law.",
    ),
}

_HOLDS = {
    JSON: "all numbers of the study",
    "runs.csv": "each run: the variable, the numbers found, its time",
    "*.png": "figure",
    "*.svg": "figure",
}


def write_script_page(study: ScriptStudy, plain: Mapping[str, Any], folder: Path) -> None:
    """Write the page about the study whose files lie in a folder; `plain` is what goes to JSON."""
    vary = study.ladder
    words = [
        [(number.name, told(study, each, number)) for number in each.numbers]
        for each in study.ladders
    ]
    contents = {
        "script": study.script.name,
        "numbers": study.asked.names,
        "variable": "" if vary is None else vary.name,
        "ladders": list(zip(plain["ladders"], words, strict=True)),
        "comparisons": study.comparisons,
        "notes": plain["notes"],
        "terms": OF_SCRIPTS,
        "settings": {
            "numbers": ", ".join(study.asked.names),
            "vary": "nothing"
            if vary is None
            else f"{vary.name}={vary.coarse:g}:{vary.fine:g}:{vary.rungs}",
            "runs a rung": f"{len(study.seeds)} seeds"
            if study.seeds
            else f"{study.phases} nearby values",
            "tolerance": "none given" if study.tolerance is None else f"{study.tolerance:g}",
            "LAMMPS": study.lmp,
            "runs": f"{sum(len(each.runs) for each in study.ladders)}, in {study.seconds:.3g} s",
            "processor": plain["processor"],
        },
        "versions": plain["versions"],
        "figures": drawn_figures(folder, FIGURES, study.script.name) if study.ladders else [],
        "read": [listed_file(study.script, "the script")],
        "written": files_written(folder, _HOLDS),
    }
    write_page(folder / PAGE, "chaincor.workflows.scripts", contents)
