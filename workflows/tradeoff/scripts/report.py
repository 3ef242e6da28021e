"""A study of a script: as text, as JSON, and in files."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from chaincor.analysis.atomic_write import folder_aside
from chaincor.workflows.json_output import stamped
from chaincor.workflows.result import finite
from chaincor.workflows.tradeoff.scripts.ladder_runs import SEED, ScriptLadder
from chaincor.workflows.tradeoff.scripts.page import write_script_page
from chaincor.workflows.tradeoff.scripts.script_run import format_command
from chaincor.workflows.tradeoff.scripts.study import ScriptTradeoff


def describe_script_study(study: ScriptTradeoff) -> str:
    """Describe a study for people: verdict, table and advice of each ladder."""
    lines = [
        f"{study.script.name}: {study.observable}",
        f"{study.ladder.name} from {study.ladder.coarse:g} to {study.ladder.fine:g}, "
        + (f"{len(study.seeds)} seeds" if study.seeds else f"{study.phases} nearby values")
        + f" a rung, {sum(len(each.runs) for each in study.ladders)} runs, {study.seconds:.3g} s",
    ]
    for each in study.ladders:
        lines += ["", *_describe_ladder(study, each)]
    if study.kept is not None:
        lines += ["", f"failed runs are kept in {study.kept}"]
    return "\n".join(lines)


def _describe_ladder(study: ScriptTradeoff, each: ScriptLadder) -> list[str]:
    lines = [f"at {name} = {value}" for name, value in each.fixed.items()]
    *told, advice = [f"{name:<12} {text}" for name, text in _told(study, each)]
    lines += told
    lines.append(
        f"{study.ladder.name:>12} {'mean':>16} {'scatter':>10} {'promises':>10} {'time':>9}"
    )
    for k, value in enumerate(each.values):
        promised = f"{each.promised[k]:.1e}" if np.isfinite(each.promised[k]) else "-"
        lines.append(
            f"{study.ladder.text(float(value)):>12} {each.results[k].mean():>16.10g} "
            f"{each.verdict.scatter[k]:>10.1e} {promised:>10} {each.seconds[k]:>7.2g} s"
        )
    return [*lines, advice]


def _told(study: ScriptTradeoff, each: ScriptLadder) -> list[tuple[str, str]]:
    """Say what a ladder told, the advice last."""
    verdict = each.verdict
    told = [("verdict", f"{verdict.kind}: {verdict.reason}")]
    if verdict.order is not None and verdict.order_error is not None:
        what = "of the scatter" if verdict.kind == "irregular" else "of the error"
        told.append(("order", f"{with_bar(verdict.order, verdict.order_error)} {what}"))
    if verdict.value is not None and verdict.value_error is not None:
        source = {"regular": "extrapolated", "noise": "mean of all runs"}.get(
            verdict.kind, "mean of the finest runs"
        )
        told.append(("value", f"{with_bar(verdict.value, verdict.value_error)}, {source}"))
    if not each.repeatable:
        told.append(("note", "the same command printed different digits twice"))
    name = study.ladder.name
    told += [
        ("failed", f"{name} = {run.variables[name]}: {run.failure}")
        for run in each.runs
        if run.failure
    ]
    return [*told, ("advice", advise(study, each))]


def advise(study: ScriptTradeoff, each: ScriptLadder) -> str:
    """Say in one line what to run."""
    name, tolerance = study.ladder.name, study.tolerance
    if each.verdict.kind == "cannot tell":
        return "none, since the error cannot be told"
    if tolerance is None:
        return "give --tolerance for the cheapest value that keeps it"
    advice = each.advice
    if advice is None:
        return f"{tolerance:g} is beyond what was measured; " + (
            "give --seeds to have means of runs advised"
            if each.verdict.kind == "noise" and not study.seeds
            else "measure finer values or more runs"
        )
    text = study.ladder.text(advice.value)
    if not advice.tried:
        return (
            f"{tolerance:g} is beyond this ladder, whose finest rung keeps "
            f"{each.promised[-1]:.1e}; by the order, {name} = {text} may do: measure with "
            f"--vary {name}={study.ladder.text(float(each.values[-1]))}:{text}:6"
        )
    command = format_command("lmp", {name: text, **each.fixed}, study.script.name)
    many = "" if advice.runs == 1 else f"the mean of {advice.runs} seeds of "
    each_seed = "" if advice.runs == 1 else f", with -var {SEED} 1 to {advice.runs}"
    return f"{tolerance:g} costs {advice.seconds:.2g} s: {many}{command}{each_seed}"


def with_bar(value: float, error: float) -> str:
    """Format a value with as many digits as its error bar leaves."""
    if not error > 0.0:
        return f"{value:.12g} +- {error:.1e}"
    digits = min(max(1 - math.floor(math.log10(error)), 0), 16)
    return f"{value:.{digits}f} +- {error:.1e}"


def script_study_to_dict(study: ScriptTradeoff) -> dict[str, Any]:
    """Return a study as plain values; what is told at the top is the first ladder's."""
    ladders = [_ladder_dict(study, each) for each in study.ladders]
    shared = ("verdict", "reason", "order", "order_error", "value", "value_error")
    plain: dict[str, Any] = {
        "script": str(study.script),
        "observable": study.observable,
        "vary": {
            "name": study.ladder.name,
            "from": study.ladder.coarse,
            "to": study.ladder.fine,
            "count": study.ladder.rungs,
        },
        "phases": study.phases,
        "seeds": list(study.seeds),
        "tolerance": study.tolerance,
        **{name: ladders[0][name] for name in shared},
        "extrapolated": ladders[0]["extrapolated"],
        "extrapolated_error": ladders[0]["extrapolated_error"],
        "advice": ladders[0]["advice"],
        "ladders": ladders,
        "lmp": study.lmp,
        "kept": None if study.kept is None else str(study.kept),
        "seconds_total": study.seconds,
    }
    return {key: finite(value) for key, value in plain.items()}


def _ladder_dict(study: ScriptTradeoff, each: ScriptLadder) -> dict[str, Any]:
    verdict, advice, name = each.verdict, each.advice, study.ladder.name
    regular = verdict.kind == "regular"
    return {
        "fixed": each.fixed,
        "verdict": verdict.kind,
        "reason": verdict.reason,
        "order": verdict.order,
        "order_error": verdict.order_error,
        "value": verdict.value,
        "value_error": verdict.value_error,
        "extrapolated": verdict.value if regular else None,
        "extrapolated_error": verdict.value_error if regular else None,
        "resolution": each.resolution,
        "repeatable": each.repeatable,
        "advice": {
            "text": advise(study, each),
            "value": None if advice is None else advice.value,
            "runs": None if advice is None else advice.runs,
            "promised_error": None if advice is None else advice.promised_error,
            "seconds": None if advice is None else advice.seconds,
            "tried": None if advice is None else advice.tried,
        },
        "rungs": [
            {
                "value": float(value),
                "mean": float(each.results[k].mean()),
                "scatter": float(verdict.scatter[k]),
                "promised_error": float(each.promised[k]),
                "seconds": float(each.seconds[k]),
            }
            for k, value in enumerate(each.values)
        ],
        "runs": [
            {
                "value": float(run.variables[name]),
                "seed": int(run.variables[SEED]) if SEED in run.variables and study.seeds else None,
                "result": None if run.observed is None else run.observed.value,
                "seconds": run.seconds,
                "failure": run.failure,
            }
            for run in each.runs
        ],
    }


def write_script_study(study: ScriptTradeoff, folder: Path) -> None:
    """Write a study: ``tradeoff.html`` and ``.json``, ``runs.csv``, the figure as PNG and SVG."""
    plain = stamped(script_study_to_dict(study))
    with folder_aside(folder) as aside:
        text = json.dumps(plain, indent=2, allow_nan=False)
        (aside / "tradeoff.json").write_text(text + "\n", encoding="utf-8")
        with (aside / "runs.csv").open("w", newline="", encoding="utf-8") as stream:
            rows = [
                {**each.fixed, study.ladder.name: run["value"]}
                | {key: run[key] for key in ("seed", "result", "seconds", "failure")}
                for each, ladder in zip(study.ladders, plain["ladders"], strict=True)
                for run in ladder["runs"]
            ]
            writer = csv.DictWriter(stream, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
        _draw(study, aside)
        write_script_page(study, [_told(study, each) for each in study.ladders], plain, aside)


def _draw(study: ScriptTradeoff, folder: Path) -> None:
    from matplotlib.figure import Figure

    from chaincor.analysis.figures.script_ladder import LadderCurve, plot_script_ladders

    curves = []
    for each in study.ladders:
        verdict = each.verdict
        best = verdict.value if verdict.value is not None else float(each.results[-1].mean())
        law = None
        if verdict.fit is not None:
            steps = np.vectorize(study.ladder.step)(each.inputs)
            law = np.abs(verdict.fit.bias(np.median(steps / steps.max(), axis=1)))
        fixed = ", ".join(f"{name} {value}" for name, value in each.fixed.items())
        curves.append(
            LadderCurve(
                label=fixed or verdict.kind,
                inputs=each.inputs,
                errors=np.abs(each.results - best),
                seconds=each.seconds,
                promised=each.promised,
                law=law,
            )
        )
    axes = plot_script_ladders(curves, variable=study.ladder.name, tolerance=study.tolerance)
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    for ending in ("png", "svg"):
        figure.savefig(folder / f"work_precision.{ending}")
