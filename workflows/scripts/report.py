"""A study of a script: as text, as JSON, and in files."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from chaincor.analysis.atomic_write import folder_aside
from chaincor.workflows.json_output import stamped
from chaincor.workflows.scripts.advice import runs_wanted
from chaincor.workflows.scripts.ladder_runs import SEED, NumberLadder, ScriptLadder
from chaincor.workflows.scripts.page import JSON, write_script_page
from chaincor.workflows.scripts.parting import PARTED, Comparison
from chaincor.workflows.scripts.script_run import format_command
from chaincor.workflows.scripts.study import ScriptStudy

_KINDS = {
    "same": "not a digit differs",
    "together": "roundings stay invisible: the runs do not part",
    "chaos": "roundings grow until the runs have parted: no bug, and only means can be compared",
    "at once": "the runs differ from the beginning, by more than roundings: a bug, other random "
    "numbers, or another set-up",
}


def describe_script_study(study: ScriptStudy) -> str:
    """Describe a study for people: verdict, table and advice of each ladder."""
    lines = [f"{study.script.name}: {', '.join(study.asked.names)}"]
    if study.ladder is not None:
        own = "" if study.own_step is None else f", {study.own_step:g} in the script"
        lines.append(
            f"{study.ladder.name} from {study.ladder.coarse:g} to {study.ladder.fine:g}{own}, "
            + (f"{len(study.seeds)} seeds" if study.seeds else f"{study.phases} nearby values")
            + f" a rung, {sum(len(each.runs) for each in study.ladders)} runs, "
            f"{study.seconds:.3g} s"
        )
    for each in study.ladders:
        lines += ["", *_describe_ladder(study, each)]
    for other in study.comparisons:
        lines += ["", *_describe_comparison(other)]
    lines += ["", *notes(study)] if notes(study) else []
    return "\n".join(lines)


def _describe_ladder(study: ScriptStudy, each: ScriptLadder) -> list[str]:
    assert study.ladder is not None
    lines = [f"at {name} = {value}" for name, value in each.fixed.items()]
    if len(each.numbers) > 1:
        return [*lines, *_table(study, each)]
    for number in each.numbers:
        *said, advice = [f"{name:<12} {text}" for name, text in told(study, each, number)]
        lines += said
        lines.append(
            f"{study.ladder.name:>12} {'mean':>16} {'scatter':>10} {'promises':>10} {'time':>9}"
        )
        for k, value in enumerate(each.values):
            keeps = number.promised[k]
            lines.append(
                f"{study.ladder.text(float(value)):>12} {number.results[k].mean():>16.10g} "
                f"{number.verdict.scatter[k]:>10.1e} "
                f"{f'{keeps:.1e}' if np.isfinite(keeps) else '-':>10} {each.seconds[k]:>7.2g} s"
            )
        lines.append(advice)
    return lines


def _table(study: ScriptStudy, each: ScriptLadder) -> list[str]:
    """Return a line for each number: what it is, what to run, and what that keeps."""
    assert study.ladder is not None
    lines = [f"{'number':<20} {'value':>26} {'verdict':>11} {'advised':>10} {'keeps':>9}  within"]
    for number in each.numbers:
        verdict, advice = number.verdict, number.advice
        value = "-"
        if verdict.value is not None and verdict.value_error is not None:
            value = with_bar(verdict.value, verdict.value_error)
        advised = "none" if advice is None else study.ladder.text(advice.value)
        keeps = number.promised[-1] if advice is None else advice.promised_error
        lines.append(
            f"{number.name:<20} {value:>26} {verdict.kind:>11} {advised:>10} "
            f"{f'{keeps:.1e}' if keeps is not None and np.isfinite(keeps) else '-':>9}  "
            f"{'-' if number.tolerance is None else f'{number.tolerance:.2g}'}"
        )
    name = study.ladder.name
    return [
        *lines,
        *(f"failed at {name} = {study.ladder.text(given)}: {run.failure}"
          for given, run in zip(each.given, each.runs, strict=True) if run.failure),
    ]  # fmt: skip


def _describe_comparison(each: Comparison) -> list[str]:
    lines = [each.what, f"{'verdict':<12} {each.kind}: {_KINDS[each.kind]}"]
    if each.parted is not None:
        lines.append(
            f"{'parted':<12} after a time of {each.parted:.6g}: by then {PARTED:g} of the distance "
            "of neighbours"
        )
    if each.growth is not None:
        lines.append(f"{'growth':<12} {each.growth:.3g} by time: e-fold in {1 / each.growth:.3g}")
    for name, (value, difference, error) in each.numbers.items():
        agrees = {True: "agrees", False: "differs", None: "not a mean"}[each.agrees(name)]
        bar = f" +- {error:.1e}" if math.isfinite(error) else ""
        lines.append(f"{name:<20} {value:.10g}, difference {difference:.2g}{bar}: {agrees}")
    return lines


def notes(study: ScriptStudy) -> list[str]:
    """Return what a ladder of this script gets wrong, and what else must be known."""
    said = []
    for each in study.ladders:
        if each.ends_apart and each.ends is not None:
            said.append(
                f"note: your runs end at {each.ends[0]:.6g} to {each.ends[1]:.6g}: they answer "
                "different questions; let the script's runs take one time, a step that divides it, "
                "or leave the step to `chaincor timestep` without --vary"
            )
        short = [
            number.name
            for number in each.numbers
            if number.name in map(str, study.asked.quantities)
            and number.name.endswith(":mean")
            and number.standard_error is None
        ]
        if short:
            said.append(
                f"note: one run is too short against its correlations to tell the error of its "
                f"{', '.join(short)}; run longer"
            )
        if not each.repeatable:
            said.append("note: the same command gave different digits twice")
    scaled = study.scale_periods
    for count in study.counts:
        if not (scaled and count.periods):
            said.append(
                f"{'caution' if count.moves else 'note'}: {count}"
                + ("; --scale-periods holds that in time" if count.periods and count.moves else "")
            )
    if study.kept is not None:
        said.append(f"failed runs are kept in {study.kept}")
    return said


def told(study: ScriptStudy, each: ScriptLadder, number: NumberLadder) -> list[tuple[str, str]]:
    """Say what a ladder told of a number, the advice last."""
    assert study.ladder is not None
    verdict = number.verdict
    said = [("verdict", f"{verdict.kind}: {verdict.reason}")]
    if verdict.order is not None and verdict.order_error is not None:
        what = "of the scatter" if verdict.kind == "irregular" else "of the error"
        said.append(("order", f"{with_bar(verdict.order, verdict.order_error)} {what}"))
    if verdict.value is not None and verdict.value_error is not None:
        source = {"regular": "extrapolated", "noise": "mean of all runs", "bounded": "from means"}
        told_by = source.get(verdict.kind, "mean of the finest runs")
        said.append(("value", f"{with_bar(verdict.value, verdict.value_error)}, {told_by}"))
    if number.standard_error is not None:
        said.append(("one run", f"+- {number.standard_error:.1e}, by its own samples"))
    name = study.ladder.name
    said += [
        ("failed", f"{name} = {study.ladder.text(given)}: {run.failure}")
        for given, run in zip(each.given, each.runs, strict=True)
        if run.failure
    ]
    return [*said, ("advice", advise(study, each, number))]


def advise(study: ScriptStudy, each: ScriptLadder, number: NumberLadder) -> str:
    """Say in one line what to run."""
    assert study.ladder is not None
    name, tolerance, advice = study.ladder.name, number.tolerance, number.advice
    if number.verdict.kind == "cannot tell":
        return "none, since the error cannot be told"
    if tolerance is None:
        return "give --tolerance for the cheapest value that keeps it"
    if advice is None:
        runs = runs_wanted(number.verdict, tolerance, study.phases)
        tell = "--seeds" if study.seeds else "--phases"
        return f"{tolerance:.3g} is beyond what was measured; " + (
            f"about {runs} runs a rung ({tell} {min(runs, 100)}) would tell"
            if runs
            else "give --seeds to have means of runs advised"
            if number.verdict.kind == "noise" and not study.seeds
            else "measure finer values or more runs"
        )
    text = study.ladder.text(advice.value)
    if not advice.tried:
        return (
            f"{tolerance:.3g} is beyond this ladder, whose finest rung keeps "
            f"{number.promised[-1]:.1e}; by the order, {name} = {text} may do: measure with "
            f"--vary {name}={study.ladder.text(float(each.values[-1]))}:{text}:6"
        )
    costs = f"{tolerance:.3g} costs {advice.seconds:.2g} s: "
    if study.own_step is not None:
        many = "" if advice.runs == 1 else f", the mean of {advice.runs} runs or of one as long"
        return f"{costs}timestep {text}{many}"
    command = format_command("lmp", {name: text, **each.fixed}, study.script.name)
    many = "" if advice.runs == 1 else f"the mean of {advice.runs} seeds of "
    each_seed = "" if advice.runs == 1 else f", with -var {SEED} 1 to {advice.runs}"
    return f"{costs}{many}{command}{each_seed}"


def with_bar(value: float, error: float) -> str:
    """Format a value with as many digits as its error bar leaves."""
    if not error > 0.0:
        return f"{value:.12g} +- {error:.1e}"
    digits = min(max(1 - math.floor(math.log10(error)), 0), 16)
    return f"{value:.{digits}f} +- {error:.1e}"


def script_study_to_dict(study: ScriptStudy) -> dict[str, Any]:
    """Return a study as plain values; what is told at the top is the first ladder's."""
    ladder = study.ladder
    ladders = [_ladder_dict(study, each) for each in study.ladders]
    observables = ladders[0]["observables"] if ladders else _compared(study.comparisons)
    first = observables[0]
    plain: dict[str, Any] = {
        "script": str(study.script),
        "vary": None
        if ladder is None
        else {
            "name": ladder.name,
            "from": ladder.coarse,
            "to": ladder.fine,
            "count": ladder.rungs,
        },
        "own_step": study.own_step,
        "phases": study.phases,
        "seeds": list(study.seeds),
        "tolerance": study.tolerance,
        "observables": observables,
        **{name: first[name] for name in ("verdict", "order", "order_error", "value")},
        "value_error": first["value_error"],
        "ladders": ladders,
        "parting": [_parting(each) for each in study.comparisons],
        "notes": notes(study),
        "lmp": study.lmp,
        "kept": None if study.kept is None else str(study.kept),
        "seconds_total": study.seconds,
    }
    return dict(_finite(plain))


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
        "reason": verdict.reason,
        "order": verdict.order,
        "order_error": verdict.order_error,
        "value": verdict.value,
        "value_error": verdict.value_error,
        "standard_error": number.standard_error,
        "resolution": number.resolution,
        "tolerance": number.tolerance,
        "advice": None if advice is None else advice.value,
        "bound": float(number.promised[-1]) if advice is None else advice.promised_error,
        "advised_runs": None if advice is None else advice.runs,
        "advised_seconds": None if advice is None else advice.seconds,
        "tried": None if advice is None else advice.tried,
        "text": advise(study, each, number),
        "rungs": [
            {
                "value": float(value),
                "mean": float(number.results[k].mean()),
                "scatter": float(verdict.scatter[k]),
                "bias": float(verdict.bias[k]),
                "promised_error": float(number.promised[k]),
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
            "reason": _KINDS[each.kind],
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


def _finite(value: Any) -> Any:
    """Return plain values with None for numbers that are not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    return [_finite(inner) for inner in value] if isinstance(value, list) else value


def write_script_study(study: ScriptStudy, folder: Path) -> None:
    """Write a study: a page and its JSON, ``runs.csv``, the figure as PNG and SVG."""
    plain = stamped(script_study_to_dict(study))
    with folder_aside(folder) as aside:
        text = json.dumps(plain, indent=2, allow_nan=False)
        (aside / JSON).write_text(text + "\n", encoding="utf-8")
        rows = [
            {**each.fixed, "value": run["value"], **run["results"]}
            | {key: run[key] for key in ("seed", "seconds", "failure")}
            for each, ladder in zip(study.ladders, plain["ladders"], strict=True)
            for run in ladder["runs"]
        ]
        columns = list(dict.fromkeys(key for row in rows for key in row))
        with (aside / "runs.csv").open("w", newline="", encoding="utf-8") as stream:
            writer = csv.DictWriter(stream, columns)
            writer.writeheader()
            writer.writerows(rows)
        if study.ladders:
            _draw(study, aside)
        pairs = [
            [(number.name, told(study, each, number)) for number in each.numbers]
            for each in study.ladders
        ]
        write_script_page(study, pairs, plain, aside)


def _draw(study: ScriptStudy, folder: Path) -> None:
    from matplotlib.figure import Figure

    from chaincor.analysis.figures.script_ladder import LadderCurve, plot_script_ladders

    assert study.ladder is not None
    curves = []
    for each in study.ladders:
        fixed = ", ".join(f"{name} {value}" for name, value in each.fixed.items())
        for number in each.numbers:
            verdict = number.verdict
            best = verdict.value if verdict.value is not None else float(number.results[-1].mean())
            law = None
            if verdict.fit is not None:
                steps = np.vectorize(study.ladder.step)(each.inputs)
                law = np.abs(verdict.fit.bias(np.median(steps / steps.max(), axis=1)))
            named = ", ".join(filter(None, [fixed, number.name if len(each.numbers) > 1 else ""]))
            curves.append(
                LadderCurve(
                    label=named or verdict.kind,
                    inputs=each.inputs,
                    errors=np.abs(number.results - best),
                    seconds=each.seconds,
                    promised=number.promised,
                    law=law,
                )
            )
    axes = plot_script_ladders(curves, variable=study.ladder.name, tolerance=study.tolerance)
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    for ending in ("png", "svg"):
        figure.savefig(folder / f"work_precision.{ending}")
