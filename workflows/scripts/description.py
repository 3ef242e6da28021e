"""A study of a script in words: verdict, table and advice of each ladder."""

import math

import numpy as np

from chaincor.workflows.scripts.advice import runs_wanted
from chaincor.workflows.scripts.ladder_runs import NumberLadder, ScriptLadder
from chaincor.workflows.scripts.parting import PARTED, Comparison
from chaincor.workflows.scripts.script_run import format_command
from chaincor.workflows.scripts.study import ScriptStudy
from chaincor.workflows.scripts.varied import SEED

KINDS = {
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
    said = notes(study)
    return "\n".join([*lines, "", *said] if said else lines)


def _describe_ladder(study: ScriptStudy, each: ScriptLadder) -> list[str]:
    lines = [f"at {name} = {value}" for name, value in each.fixed.items()]
    if len(each.numbers) > 1:
        return [*lines, *_table(each)]
    for number in each.numbers:
        *said, advice = [f"{name:<12} {text}" for name, text in told(study, each, number)]
        lines += said
        lines.append(
            f"{each.ladder.name:>12} {'mean':>16} {'scatter':>10} {'promises':>10} {'time':>9}"
        )
        for k, value in enumerate(each.values):
            keeps = number.verdict.promised[k]
            lines.append(
                f"{each.ladder.text(float(value)):>12} {number.results[k].mean():>16.10g} "
                f"{number.verdict.scatter[k]:>10.1e} "
                f"{f'{keeps:.1e}' if np.isfinite(keeps) else '-':>10} {each.seconds[k]:>7.2g} s"
            )
        lines.append(advice)
    return lines


def _table(each: ScriptLadder) -> list[str]:
    """Return a line for each number: what it is, what to run, and what that keeps."""
    lines = [f"{'number':<20} {'value':>26} {'verdict':>11} {'advised':>10} {'keeps':>9}  within"]
    for number in each.numbers:
        verdict, advice = number.verdict, number.advice
        value = "-"
        if verdict.value is not None and verdict.value_error is not None:
            value = with_bar(verdict.value, verdict.value_error)
        advised = "none" if advice is None else each.ladder.text(advice.value)
        keeps = number.verdict.promised[-1] if advice is None else advice.promised_error
        lines.append(
            f"{number.name:<20} {value:>26} {verdict.kind:>11} {advised:>10} "
            f"{f'{keeps:.1e}' if keeps is not None and np.isfinite(keeps) else '-':>9}  "
            f"{'-' if number.tolerance is None else f'{number.tolerance:.2g}'}"
        )
    return [*lines, *(f"failed at {text}" for text in each.failures)]


def _describe_comparison(each: Comparison) -> list[str]:
    lines = [each.what, f"{'verdict':<12} {each.kind}: {KINDS[each.kind]}"]
    if each.parted is not None:
        lines.append(
            f"{'parted':<12} after a time of {each.parted:.6g}: by then {PARTED:g} of the distance "
            "of neighbours"
        )
    if each.growth is not None:
        lines.append(f"{'growth':<12} {each.growth:.3g} by time: e-fold in {1 / each.growth:.3g}")
    for name, (value, difference, error) in each.numbers.items():
        untold = "not a mean" if math.isnan(error) else "cannot tell: the run is too short"
        agrees = {True: "agrees", False: "differs", None: untold}[each.agrees(name)]
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
    said += [("failed", text) for text in each.failures]
    return [*said, ("advice", advise(study, each, number))]


def advise(study: ScriptStudy, each: ScriptLadder, number: NumberLadder) -> str:
    """Say in one line what to run."""
    name, tolerance, advice = each.ladder.name, number.tolerance, number.advice
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
    text = each.ladder.text(advice.value)
    if not advice.tried:
        return (
            f"{tolerance:.3g} is beyond this ladder, whose finest rung keeps "
            f"{number.verdict.promised[-1]:.1e}; by the order, {name} = {text} may do: measure "
            f"with --vary {name}={each.ladder.text(float(each.values[-1]))}:{text}:6"
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
