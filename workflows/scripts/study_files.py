"""Write the files of a script study: results as JSON, runs as CSV, a figure and a page."""

from pathlib import Path
from typing import Any

from chaincor.workflows.json_output import finite, stamped
from chaincor.workflows.pages.page import StudyReport, listed_file
from chaincor.workflows.scripts.answers import NumberAnswer
from chaincor.workflows.scripts.bottom_line import answer_of
from chaincor.workflows.scripts.description import KINDS, notes
from chaincor.workflows.scripts.energy_changes import EnergyChange
from chaincor.workflows.scripts.ladder_runs import ScriptLadder
from chaincor.workflows.scripts.number_text import advise, number_rows
from chaincor.workflows.scripts.parting import PartingComparison
from chaincor.workflows.scripts.study import ScriptStudy
from chaincor.workflows.scripts.varied import SEED
from chaincor.workflows.showing.terms import OF_SCRIPTS

_ERRORS, _DISTANCES = "work_precision", "distances"
REPORT = StudyReport(
    name="timestep",
    package="chaincor.workflows.scripts",
    tables={"runs.csv": "each run: value of the varied quantity, numbers, time"},
    figures={
        _ERRORS: (
            "Error along the ladder",
            "Each mark shows how far the number of one run is from the best value. "
            "Lines show the largest error of one run and, if the error is regular, "
            "the fitted power. Crosses mark values at which a run failed.",
        ),
        _DISTANCES: (
            "Distance of the runs",
            "The curve shows the root-mean-square distance of the particles of two "
            "runs against time, in distances of neighbours. Above the grey line "
            "the runs have parted.",
        ),
    },
)
# These fields of each part of a study are written to JSON. A pair gives the key in JSON and the
# name of the field.
_VERDICT = ("reason", "order", "order_error", "value", "value_error")
_NUMBER = ("standard_error", "resolution", "tolerance", "tolerance_reason")
_VARY = {"name": "name", "from": "coarse", "to": "fine", "count": "rungs"}
_ADVICE = {
    "advice": "value",
    "advice_runs": "runs",
    "advised_runs": "runs",
    "advised_seconds": "seconds",
    "tried": "tried",
}


def script_study_to_dict(study: ScriptStudy) -> dict[str, Any]:
    """
    Convert a study to plain values for JSON.

    The top level also contains the results of the first ladder.
    """
    ladder = study.ladder
    ladders = [_ladder_dict(study, each) for each in study.ladders]
    observables = ladders[0]["observables"] if ladders else _compared(study.comparisons)
    first = observables[0]
    plain: dict[str, Any] = {
        "script": str(study.script),
        "vary": ladder and {key: getattr(ladder, name) for key, name in _VARY.items()},
        "own_step": study.own_step,
        "phases": study.varied.columns,
        "seeds": list(study.varied.seeds),
        "tolerance": study.tolerance,
        "observables": observables,
        **{name: first[name] for name in ("verdict", *_VERDICT[1:])},
        "ladders": ladders,
        "parting": [_parting(each) for each in study.comparisons],
        "crashed": [
            {key: getattr(each, key) for key in ("timestep", "step", "message", "value")}
            for each in study.crashes
        ],
        "use": _use(study),
        "energy_changes": [_energy_change(each) for each in study.changes],
        "notes": notes(study),
        "summary": study.summary,
        "lmp": study.lmp,
        "kept": None if study.kept is None else str(study.kept),
        "seconds_total": study.seconds,
    }
    return dict(finite(plain))


def _use(study: ScriptStudy) -> dict[str, Any] | None:
    """Return the advised value and number of runs of the first ladder."""
    use = answer_of(study, study.ladders[0]).use if study.ladders else None
    return None if use is None else {"value": use.value, "runs": use.runs}


def _ladder_dict(study: ScriptStudy, each: ScriptLadder) -> dict[str, Any]:
    answers = answer_of(study, each).numbers
    return {
        "fixed": each.fixed,
        "ends": None if each.ends is None else list(each.ends),
        "repeatable": each.repeatable,
        "observables": [_number_dict(study, each, answer) for answer in answers],
        "runs": [
            {
                "value": given,
                "seed": int(run.variables[SEED])
                if SEED in run.variables and study.varied.seeds
                else None,
                "results": {name: found.value for name, found in run.numbers.items()},
                "seconds": run.seconds,
                "failure": run.failure,
                "stopped_at": run.crash and run.crash.step,
            }
            for given, run in zip(each.given, each.runs, strict=True)
        ],
    }


def _number_dict(study: ScriptStudy, each: ScriptLadder, answer: NumberAnswer) -> dict[str, Any]:
    number = answer.number
    verdict, advice = number.verdict, number.advice
    return {
        "name": number.name,
        "verdict": verdict.kind,
        **{name: getattr(verdict, name) for name in _VERDICT},
        **{name: getattr(number, name) for name in _NUMBER},
        "bound": float(verdict.promised[-1]) if advice is None else advice.promised_error,
        **{key: advice and getattr(advice, name) for key, name in _ADVICE.items()},
        "state": answer.state,
        "error": answer.error,
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


def _compared(comparisons: tuple[PartingComparison, ...]) -> list[dict[str, Any]]:
    """Return a dictionary for each compared quantity, with the keys of a ladder's quantity."""
    words = {True: "agrees", False: "differs", None: "cannot tell"}
    return [
        {
            "name": f"{name}, {each.what}",
            "verdict": words[number.agrees],
            "reason": KINDS[each.kind],
            "order": None,
            "order_error": None,
            "value": number.value,
            "value_error": number.error,
            "advice": None,
            "advice_runs": None,
            "bound": abs(number.difference),
        }
        for each in comparisons
        for name, number in each.numbers.items()
    ]


def _energy_change(each: EnergyChange) -> dict[str, Any]:
    return {
        "name": each.name,
        "drift": each.drift,
        "error": each.error,
        "causes": [cause.text for cause in each.causes],
        "tested": each.tested and each.tested.text,
        "confirmed": each.confirmed,
        "text": str(each),
    }


def _parting(each: PartingComparison) -> dict[str, Any]:
    return {
        "what": each.what,
        "verdict": each.kind,
        "renumbered": each.renumbered,
        "causes": list(each.causes),
        "parted": each.parted,
        "growth": each.growth,
        "times": each.times.tolist(),
        "distances": each.distances.tolist(),
    }


def write_script_study(study: ScriptStudy, folder: Path) -> None:
    """Write a study: a page, JSON, ``runs.csv``, and the figure as PNG and SVG."""
    from chaincor.workflows.scripts.figure import has_figure, plot_script_study

    plain = stamped(script_study_to_dict(study))
    rows = [
        {**each.fixed, "value": run["value"], **run["results"]}
        | {key: run[key] for key in ("seed", "seconds", "failure", "stopped_at")}
        for each, ladder in zip(study.ladders, plain["ladders"], strict=True)
        for run in ladder["runs"]
    ]
    name = _DISTANCES if study.comparisons else _ERRORS
    drawn = {name: plot_script_study(study)} if has_figure(study) else {}
    REPORT.write(folder, plain, {"runs.csv": rows}, drawn, _page(study, plain))


def _page(study: ScriptStudy, plain: dict[str, Any]) -> dict[str, Any]:
    """Return the parts of the page that pages of other studies do not have."""
    vary = study.ladder
    words = [
        [(number.name, number_rows(study, each, number)) for number in each.numbers]
        for each in study.ladders
    ]
    return {
        "shown": study.script.name,
        "numbers": study.asked.names,
        "variable": "" if vary is None else vary.name,
        "ladders": list(zip(plain["ladders"], words, strict=True)),
        "comparisons": study.comparisons,
        "notes": plain["notes"],
        "summary": plain["summary"],
        "terms": OF_SCRIPTS,
        "settings": {
            "numbers": ", ".join(study.asked.names),
            "vary": "nothing"
            if vary is None
            else f"{vary.name}={vary.coarse:g}:{vary.fine:g}:{vary.rungs}",
            "runs a rung": f"{len(study.varied.seeds)} seeds"
            if study.varied.seeds
            else f"{study.varied.columns} nearby values",
            "tolerance": "none given" if study.tolerance is None else f"{study.tolerance:g}",
            "LAMMPS": study.lmp,
            "runs": f"{sum(len(each.runs) for each in study.ladders)}, in {study.seconds:.3g} s",
            "processor": plain["processor"],
        },
        "read": [listed_file(study.script, "the script")],
    }
