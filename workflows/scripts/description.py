"""Study of a script as text: verdict, table and advice of each ladder, bottom line last."""

import math
from typing import TYPE_CHECKING

import numpy as np

from chaincor.workflows.scripts.ladder_runs import NumberLadder, ScriptLadder
from chaincor.workflows.scripts.parting import PARTED, Comparison
from chaincor.workflows.scripts.step_settings import how_to_run
from chaincor.workflows.scripts.varied import SEED

if TYPE_CHECKING:
    from chaincor.workflows.scripts.study import ScriptStudy

_HEADS = ("quantity", "value", "verdict", "advised", "runs", "keeps", "tolerance")
# Number of independent samples that a run should have.
_ENOUGH_SAMPLES = 30

KINDS = {
    "same": "not a digit differs",
    "together": "roundings stay invisible: the runs do not part",
    "chaos": "roundings grow until the runs have parted: no bug, and only means can be compared",
    "at once": "the runs differ from the beginning, by more than roundings",
}


def describe_script_study(study: "ScriptStudy") -> str:
    """Describe a study for people: verdict, table and advice of each ladder, and the summary."""
    lines = [f"{study.script.name}: {', '.join(study.asked.names)}"]
    if study.ladder is not None:
        own = "" if study.own_step is None else f", {study.own_step:g} in the script"
        lines.append(
            f"{study.ladder.name} from {study.ladder.coarse:g} to {study.ladder.fine:g}{own}, "
            + _columns(study)
            + f" a rung, {sum(len(each.runs) for each in study.ladders)} runs, "
            f"{study.seconds:.3g} s"
        )
    for each in study.ladders:
        lines += ["", *_describe_ladder(study, each)]
    for other in study.comparisons:
        lines += ["", *_describe_comparison(other)]
    said = notes(study)
    return "\n".join([*lines, "", *said, *([""] if said else []), study.summary])


def study_to_html(study: "ScriptStudy") -> str:
    """Return a study as an HTML table for notebooks, the bottom line below it."""
    from html import escape

    heads: tuple[str, ...] = _HEADS
    rows = [_cells(each, number) for each in study.ladders for number in each.numbers]
    if study.comparisons:
        heads = ("runs", "verdict", "quantity", "difference", "agrees")
        rows = [
            (each.what, each.kind, name, _difference(each, name), _agreement(each, name))
            for each in study.comparisons
            for name in each.numbers
        ]
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    head = "".join(f"<th>{escape(word)}</th>" for word in heads)
    return (
        f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        f"<p>{escape(study.summary)}</p>"
    )


def _columns(study: "ScriptStudy") -> str:
    varied = study.varied
    return f"{len(varied.seeds)} seeds" if varied.seeds else f"{varied.columns} nearby values"


def _describe_ladder(study: "ScriptStudy", each: ScriptLadder) -> list[str]:
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
                f"{f'{number.verdict.scatter[k]:.1e}' if np.ptp(number.results) else '-':>10} "
                f"{f'{keeps:.1e}' if np.isfinite(keeps) else '-':>10} {each.seconds[k]:>7.2g} s"
            )
        lines.append(advice)
    return lines


def _table(each: ScriptLadder) -> list[str]:
    """Return one row per number: its value, the advised run, the error, the tolerance."""
    widths = (20, -26, -11, -10, -5, -9, -9)
    rows = [_HEADS, *(_cells(each, number) for number in each.numbers)]
    lines = [
        " ".join(
            f"{cell:<{width}}" if width > 0 else f"{cell:>{-width}}"
            for cell, width in zip(row, widths, strict=True)
        )
        for row in rows
    ]
    return [*lines, *_reasons(each)]


def _cells(each: ScriptLadder, number: NumberLadder) -> tuple[str, ...]:
    verdict, advice = number.verdict, number.advice
    value = "-"
    if verdict.value is not None and verdict.value_error is not None:
        value = with_bar(verdict.value, verdict.value_error)
    advised = "none" if advice is None else each.ladder.text(advice.value)
    keeps = verdict.promised[-1] if advice is None else advice.promised_error
    return (
        number.name,
        value,
        verdict.kind,
        advised,
        "-" if advice is None else str(advice.runs),
        f"{keeps:.1e}" if keeps is not None and np.isfinite(keeps) else "-",
        "-" if number.tolerance is None else f"{number.tolerance:.2g}",
    )


def _reasons(each: ScriptLadder) -> list[str]:
    """Return the reasons of the tolerances, one line per reason."""
    reasons: dict[str, list[str]] = {}
    for number in each.numbers:
        if number.tolerance_reason:
            reasons.setdefault(number.tolerance_reason, []).append(number.name)
    return [f"tolerance of {', '.join(names)}: {reason}" for reason, names in reasons.items()]


def _describe_comparison(each: Comparison) -> list[str]:
    lines = [each.what, f"{'verdict':<12} {each.kind}: {KINDS[each.kind]}"]
    if each.renumbered:
        lines.append(
            f"{'numbering':<12} LAMMPS numbered the particles differently; they are matched by "
            "position at the start"
        )
    lines += [f"{'cause':<12} {text}" for text in each.causes]
    if each.parted is not None:
        lines.append(
            f"{'parted':<12} after a time of {each.parted:.6g}: by then {PARTED:g} of the distance "
            "of neighbours"
        )
    if each.growth is not None:
        lines.append(f"{'growth':<12} {each.growth:.3g} by time: e-fold in {1 / each.growth:.3g}")
    for name, number in each.numbers.items():
        lines.append(
            f"{name:<20} {number.value:.10g}, difference {_difference(each, name)}: "
            f"{_agreement(each, name)}"
        )
    return lines


def _difference(each: Comparison, name: str) -> str:
    number = each.numbers[name]
    bar = f" +- {number.error:.1e}" if math.isfinite(number.error) else ""
    return f"{number.difference:.2g}{bar}"


def _agreement(each: Comparison, name: str) -> str:
    number = each.numbers[name]
    if number.is_rounding:
        return "agrees up to roundings"
    if number.agrees is not None:
        return "agrees" if number.agrees else "differs"
    return (
        "not a mean"
        if math.isnan(number.error)
        else f"too few samples for a bar{_longer(number.independent)}"
    )


def _longer(independent: float) -> str:
    """Return the factor by which a run must be longer for an error bar."""
    if not math.isfinite(independent):
        return ""
    factor = math.ceil(_ENOUGH_SAMPLES / max(independent, 1.0))
    return f" ({independent:.0f} correlation times: run {max(factor, 2)} times longer)"


def notes(study: "ScriptStudy") -> list[str]:
    """Return notes on crashed runs, causes of energy changes, and faults of a ladder."""
    said = [f"note: {crash}" for crash in study.crashes]
    said += [f"note: {change}" for change in study.changes]
    said += _windows(study)
    for each in study.ladders:
        if each.ends_apart and each.ends is not None:
            said.append(
                f"note: your runs end at {each.ends[0]:.6g} to {each.ends[1]:.6g}: they answer "
                "different questions; let the script's runs take one time, a step that divides it, "
                "or leave the step to `chaincor timestep` without --vary"
            )
        short = {
            number.name: number.independent
            for number in each.numbers
            if number.independent is not None and number.standard_error is None
        }
        if short:
            said.append(
                f"note: one run has too few samples for an error bar of {', '.join(short)}"
                f"{_longer(min(short.values()))}"
            )
        if not each.repeatable:
            said.append("note: the same command gave different digits twice")
    scaled = study.varied.scale_periods
    for count in study.counts:
        if not (scaled and count.periods):
            said.append(
                f"{'caution' if count.moves else 'note'}: {count}"
                + ("; --scale-periods holds that in time" if count.periods and count.moves else "")
            )
    if study.kept is not None:
        said.append(f"failed runs are kept in {study.kept}")
    return said


def _windows(study: "ScriptStudy") -> list[str]:
    """Return the time windows of means, drifts and fluctuations."""
    samples = [run.samples for each in study.ladders for run in each.runs if run.samples]
    kinds: dict[tuple[float, float], list[str]] = {}
    for kind in dict.fromkeys(each.kind for each in study.asked.quantities):
        if samples and kind != "last":
            kinds.setdefault(samples[-1].window(kind), []).append(kind)
    parts = [
        f"{' and '.join(names)} over times {low:.6g} to {high:.6g}"
        for (low, high), names in kinds.items()
    ]
    return [f"note: {', '.join(parts)}"] if parts else []


def told(study: "ScriptStudy", each: ScriptLadder, number: NumberLadder) -> list[tuple[str, str]]:
    """Return the results of one number as pairs of heading and text, the advice last."""
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
    elif number.independent is not None:
        said.append(("one run", f"too few samples for a bar{_longer(number.independent)}"))
    if number.tolerance is not None and number.tolerance_reason:
        said.append(("tolerance", f"{number.tolerance:.2g}: {number.tolerance_reason}"))
    return [*said, ("advice", advise(study, each, number))]


def advise(study: "ScriptStudy", each: ScriptLadder, number: NumberLadder) -> str:
    """Return the advice in one line."""
    name, tolerance, advice = each.ladder.name, number.tolerance, number.advice
    if number.verdict.kind == "cannot tell":
        return "none: the number is the same in all runs"
    if tolerance is None:
        return "none: the ladder has no bound on the error; see the last line"
    if advice is None:
        return f"none: {tolerance:.3g} is beyond this ladder; see the last line"
    text = each.ladder.text(advice.value)
    if not advice.tried:
        return (
            f"{tolerance:.3g} is beyond this ladder, whose finest rung keeps "
            f"{number.verdict.promised[-1]:.1e}; by the order, {name} = {text} may do: measure "
            f"with --vary {name}={each.ladder.text(float(each.values[-1]))}:{text}:6"
        )
    said = f"{tolerance:.3g} costs {advice.seconds:.2g} s: "
    said += how_to_run(study, name, text, each.fixed)
    if advice.runs > 1:
        seeds = f" with -var {SEED} 1 to {advice.runs}" if study.varied.own_seed else ""
        said += f", the mean of {advice.runs} runs{seeds}, or of one as long"
    return said


def with_bar(value: float, error: float) -> str:
    """Format a value with as many digits as its error bar leaves."""
    if not error > 0.0:
        return f"{value:.12g} +- {error:.1e}"
    digits = min(max(1 - math.floor(math.log10(error)), 0), 16)
    return f"{value:.{digits}f} +- {error:.1e}"
