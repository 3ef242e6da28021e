"""A study of a script in files: JSON, each run as CSV, the figure, a page."""

from pathlib import Path
from typing import Any

from chaincor.workflows.json_output import finite, stamped
from chaincor.workflows.pages.page import StudyReport, listed_file
from chaincor.workflows.scripts.description import KINDS, advise, notes, told
from chaincor.workflows.scripts.ladder_runs import NumberLadder, ScriptLadder
from chaincor.workflows.scripts.parting import Comparison
from chaincor.workflows.scripts.study import ScriptStudy
from chaincor.workflows.scripts.varied import SEED
from chaincor.workflows.showing.terms import OF_SCRIPTS

REPORT = StudyReport(
    name="timestep",
    package="chaincor.workflows.scripts",
    tables={"runs.csv": "each run: the variable, the numbers found, its time"},
    figures={
        "work_precision": (
            "Error against step and time",
            "Each mark is a run: how far its number is from the best value, against the variable "
            "and against processor time. Lines are the error that a run on the rung keeps and, "
            "where the error is regular, its law.",
        ),
    },
)
# What JSON has of each part of a study; where it has another name, key and name.
_VERDICT = ("reason", "order", "order_error", "value", "value_error")
_NUMBER = ("standard_error", "resolution", "tolerance")
_VARY = {"name": "name", "from": "coarse", "to": "fine", "count": "rungs"}
_ADVICE = {
    "advice": "value",
    "advised_runs": "runs",
    "advised_seconds": "seconds",
    "tried": "tried",
}


def script_study_to_dict(study: ScriptStudy) -> dict[str, Any]:
    """Return a study as plain values; what is told at the top is the first ladder's."""
    ladder = study.ladder
    ladders = [_ladder_dict(study, each) for each in study.ladders]
    observables = ladders[0]["observables"] if ladders else _compared(study.comparisons)
    first = observables[0]
    plain: dict[str, Any] = {
        "script": str(study.script),
        "vary": ladder and {key: getattr(ladder, name) for key, name in _VARY.items()},
        "own_step": study.own_step,
        "phases": study.phases,
        "seeds": list(study.seeds),
        "tolerance": study.tolerance,
        "observables": observables,
        **{name: first[name] for name in ("verdict", *_VERDICT[1:])},
        "ladders": ladders,
        "parting": [_parting(each) for each in study.comparisons],
        "notes": notes(study),
        "lmp": study.lmp,
        "kept": None if study.kept is None else str(study.kept),
        "seconds_total": study.seconds,
    }
    return dict(finite(plain))


def _ladder_dict(study: ScriptStudy, each: ScriptLadder) -> dict[str, Any]:
    return {
        "fixed": each.fixed,
        "ends": None if each.ends is None else list(each.ends),
        "repeatable": each.repeatable,
        "observables": [_number_dict(study, each, number) for number in each.numbers],
        "runs": [
            {
                "value": given,
                "seed": int(run.variables[SEED]) if SEED in run.variables and study.seeds else None,
                "results": {name: found.value for name, found in run.numbers.items()},
                "seconds": run.seconds,
                "failure": run.failure,
            }
            for given, run in zip(each.given, each.runs, strict=True)
        ],
    }


def _number_dict(study: ScriptStudy, each: ScriptLadder, number: NumberLadder) -> dict[str, Any]:
    verdict, advice = number.verdict, number.advice
    return {
        "name": number.name,
        "verdict": verdict.kind,
        **{name: getattr(verdict, name) for name in _VERDICT},
        **{name: getattr(number, name) for name in _NUMBER},
        "bound": float(verdict.promised[-1]) if advice is None else advice.promised_error,
        **{key: advice and getattr(advice, name) for key, name in _ADVICE.items()},
        "text": advise(study, each, number),
        "rungs": [
            {
                "value": float(value),
                "mean": float(number.results[k].mean()),
                "scatter": float(verdict.scatter[k]),
                "bias": float(verdict.bias[k]),
                "promised_error": float(verdict.promised[k]),
                "seconds": float(each.seconds[k]),
            }
            for k, value in enumerate(each.values)
        ],
    }


def _compared(comparisons: tuple[Comparison, ...]) -> list[dict[str, Any]]:
    """Return numbers of runs that were compared, with the keys of those on a ladder."""
    words = {True: "agrees", False: "differs", None: "cannot tell"}
    return [
        {
            "name": f"{name}, {each.what}",
            "verdict": words[each.agrees(name)],
            "reason": KINDS[each.kind],
            "order": None,
            "order_error": None,
            "value": value,
            "value_error": error,
            "advice": None,
            "bound": abs(difference),
        }
        for each in comparisons
        for name, (value, difference, error) in each.numbers.items()
    ]


def _parting(each: Comparison) -> dict[str, Any]:
    return {
        "what": each.what,
        "verdict": each.kind,
        "parted": each.parted,
        "growth": each.growth,
        "times": each.times.tolist(),
        "distances": each.distances.tolist(),
    }


def write_script_study(study: ScriptStudy, folder: Path) -> None:
    """Write a study: a page and its JSON, ``runs.csv``, the figure as PNG and SVG."""
    from chaincor.workflows.scripts.figure import plot_script_ladders

    plain = stamped(script_study_to_dict(study))
    rows = [
        {**each.fixed, "value": run["value"], **run["results"]}
        | {key: run[key] for key in ("seed", "seconds", "failure")}
        for each, ladder in zip(study.ladders, plain["ladders"], strict=True)
        for run in ladder["runs"]
    ]
    drawn = {"work_precision": plot_script_ladders(study)} if study.ladders else {}
    REPORT.write(folder, plain, {"runs.csv": rows}, drawn, _page(study, plain))


def _page(study: ScriptStudy, plain: dict[str, Any]) -> dict[str, Any]:
    """Return what the page says besides what every study's page does."""
    vary = study.ladder
    words = [
        [(number.name, told(study, each, number)) for number in each.numbers]
        for each in study.ladders
    ]
    return {
        "shown": study.script.name,
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
        "read": [listed_file(study.script, "the script")],
    }
