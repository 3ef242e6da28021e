"""A study of a script as one page: verdict, ladder, advice, figure."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from chaincor.workflows.pages.page import drawn_figures, files_written, listed_file, write_page
from chaincor.workflows.showing.terms import OF_SCRIPTS
from chaincor.workflows.tradeoff.scripts.study import ScriptTradeoff

PAGE = "tradeoff.html"

FIGURES = {
    "work_precision": (
        "Error against step and time",
        "Each mark is a run: how far its number is from the best value, against the variable and "
        "against processor time. Lines are the error that a run on the rung keeps and, where the "
        "error is regular, its law.",
    ),
}

_HOLDS = {
    "tradeoff.json": "all numbers of the study",
    "runs.csv": "each run: the variable, the number printed, its time",
    "*.png": "figure",
    "*.svg": "figure",
}


def write_script_page(
    study: ScriptTradeoff, told: list[list[tuple[str, str]]], plain: Mapping[str, Any], folder: Path
) -> None:
    """
    Write ``tradeoff.html`` about the files of a study that lie in a folder.

    `told` are the verdict, order, value, notes and advice of each ladder in words, `plain` is what
    JSON has of the study.
    """
    vary = study.ladder
    contents = {
        "script": study.script.name,
        "observable": study.observable,
        "vary": f"{vary.name} from {vary.coarse:g} to {vary.fine:g}",
        "variable": vary.name,
        "ladders": list(zip(plain["ladders"], told, strict=True)),
        "terms": OF_SCRIPTS,
        "settings": {
            "observable": study.observable,
            "vary": f"{vary.name}={vary.coarse:g}:{vary.fine:g}:{vary.rungs}",
            "runs a rung": f"{len(study.seeds)} seeds"
            if study.seeds
            else f"{study.phases} nearby values",
            "tolerance": "none given" if study.tolerance is None else f"{study.tolerance:g}",
            "LAMMPS": study.lmp,
            "runs": f"{sum(len(each.runs) for each in study.ladders)}, in {study.seconds:.3g} s",
            "processor": plain["processor"],
        },
        "versions": plain["versions"],
        "figures": drawn_figures(folder, FIGURES, study.script.name),
        "read": [listed_file(study.script, "the script")],
        "written": files_written(folder, _HOLDS),
    }
    write_page(folder / PAGE, "chaincor.workflows.tradeoff.scripts", contents)
