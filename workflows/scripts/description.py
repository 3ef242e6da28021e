"""Write a study of a script as text: tables, notes, and the bottom line."""

import math
from typing import TYPE_CHECKING

from chaincor.workflows.scripts.bottom_line import answer_of
from chaincor.workflows.scripts.ladder import STEP
from chaincor.workflows.scripts.ladder_runs import ScriptLadder
from chaincor.workflows.scripts.number_text import (
    cells,
    correlation_times,
    factor_for_bar,
    heads_of,
    number_table,
    one_number,
    run_longer,
)
from chaincor.workflows.scripts.parting import PARTED, PartingComparison
from chaincor.workflows.scripts.remedies import rounded, times_longer

if TYPE_CHECKING:
    from chaincor.workflows.scripts.study import ScriptStudy

KINDS = {
    "same": "all digits agree",
    "together": "the roundings do not grow, so the runs do not part",
    "chaos": "roundings grow until the runs part; this is no bug, but only means can be compared",
    "at once": "the runs differ by more than roundings from the beginning",
}


def describe_script_study(study: "ScriptStudy") -> str:
    """Describe a study in words: verdict, table and advice of each ladder, then the bottom line."""
    lines = [f"{study.script.name}: {', '.join(study.asked.names)}"]
    if study.ladder is not None:
        own = "" if study.own_step is None else f" (yours: {study.own_step:g})"
        lines.append(
            f"{study.ladder.name} from {study.ladder.coarse:g} to {study.ladder.fine:g}{own}: "
            f"{_runs_said(study)}, {study.seconds:.3g} s"
        )
    for each in study.ladders:
        lines += ["", *_describe_ladder(study, each)]
    for other in study.comparisons:
        lines += ["", *_describe_comparison(other)]
    said = notes(study)
    return "\n".join([*lines, "", *said, *([""] if said else []), study.summary])


def study_to_html(study: "ScriptStudy") -> str:
    """Return a study as an HTML table for notebooks, with the bottom line below."""
    from html import escape

    answers = [(each, answer_of(study, each)) for each in study.ladders]
    rows = [cells(each, row) for each, answer in answers for row in answer.numbers]
    heads = heads_of(answers[0][1], answers[0][0]) if answers else ()
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


def _runs_said(study: "ScriptStudy") -> str:
    """Return the number of runs, and the differences between the runs at one value."""
    varied = study.varied
    count = sum(len(each.runs) for each in study.ladders)
    name = "timestep" if study.ladder is not None and study.ladder.name == STEP else "value"
    each = f"{len(varied.seeds)} seeds at" if varied.seeds else f"{varied.columns} near"
    return f"{count} runs, {each} each {name}"


def _describe_ladder(study: "ScriptStudy", each: ScriptLadder) -> list[str]:
    lines = [f"at {name} = {value}" for name, value in each.fixed.items()]
    if len(each.numbers) > 1:
        return [*lines, *number_table(study, each)]
    return [*lines, *one_number(study, each, each.numbers[0])]


def _describe_comparison(each: PartingComparison) -> list[str]:
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


def _difference(each: PartingComparison, name: str) -> str:
    number = each.numbers[name]
    bar = f" +- {number.error:.1e}" if math.isfinite(number.error) else ""
    return f"{number.difference:.2g}{bar}"


def _agreement(each: PartingComparison, name: str) -> str:
    number = each.numbers[name]
    if number.is_rounding:
        return "agrees up to roundings"
    if number.agrees is not None:
        return "agrees" if number.agrees else "differs"
    return (
        "not a mean"
        if math.isnan(number.error)
        else f"too few samples for a bar{run_longer(number.independent)}"
    )


def notes(study: "ScriptStudy") -> list[str]:
    """Return notes on crashed runs, on causes of energy drifts, and on faults of a ladder."""
    said = [f"note: {crash}" for crash in study.crashes]
    said += [f"note: {change}" for change in study.changes]
    if len(steps := study.varied.own_steps) > 1:
        said.append(
            f"note: the script runs at timesteps {', '.join(f'{step:g}' for step in steps)}. The "
            "study scales them by one factor, and names the last of them"
        )
    said += _windows(study)
    for each in study.ladders:
        if each.ends_apart and each.ends is not None:
            said.append(_ends(study, each.ends))
        short = {
            number.name: number.independent
            for number in each.numbers
            if number.independent is not None and number.standard_error is None
        }
        if short:
            said.append(_short_means(study, each, short))
        if not each.repeatable:
            said.append("note: the same command gave different digits twice")
    scaled = study.varied.scale_periods
    for count in study.counts:
        if not (scaled and count.periods):
            said.append(
                f"{'caution' if count.moves else 'note'}: {count}"
                + (
                    "; with --scale-periods, this period keeps its length in time"
                    if count.periods and count.moves
                    else ""
                )
            )
    if study.kept is not None:
        said.append(f"failed runs are kept in {study.kept}")
    return said


def _ends(study: "ScriptStudy", ends: tuple[float, float]) -> str:
    """Write why the runs end at different times, and how to avoid it."""
    low, high = ends
    if study.varied.kind == "step":
        # The end times may differ because the script has 'reset_timestep'. The runs still cover
        # equal simulated times.
        reset = next(
            (c for c in study.varied.script.commands if c.words[0] == "reset_timestep"), None
        )
        why = "" if reset is None else f" ({reset}, 'reset_timestep', sets the clock back)"
        text = f"the samples end at different times, from {low:.6g} to {high:.6g}{why}"
        return f"note: {text}. The errors above include the scatter that this causes."
    text = f"the runs end at different times, from {low:.6g} to {high:.6g}, because the run length "
    text += "is not a multiple of each step. Choose a length that is a multiple of every step."
    return f"note: {text}"


def _short_means(study: "ScriptStudy", each: ScriptLadder, short: dict[str, float]) -> str:
    """Write that one run is too short for error bars of means, and how long it would have to be."""
    least = min(short.values())
    names = ", ".join(name.removesuffix(":mean") for name in short)
    one = len(short) == 1
    what = f"the mean{'' if one else 's'} of {names}"
    if not math.isfinite(least):
        return f"note: {what} {'has' if one else 'have'} no error bar from one run."
    factor = factor_for_bar(least)
    text = (
        f"{what} cover{'s' if one else ''} only {correlation_times(least)}. This does not affect "
    )
    text += f"the choice of the {each.ladder.name}. "
    bar = f"an error bar of {'this mean' if one else 'these means'} from one run"
    longer = times_longer(study, each, answer_of(study, each))
    if longer >= factor:
        proposed = f"The runs proposed at the end, {rounded(longer)} times longer,"
        return f"note: {text}{proposed} also give {bar}."
    return f"note: {text}For {bar}, make the run {factor} times longer."


def _windows(study: "ScriptStudy") -> list[str]:
    """Return the time windows over which means, drifts and fluctuations are taken."""
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
