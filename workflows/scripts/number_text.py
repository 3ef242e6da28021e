"""Write the results of a ladder: a table of all quantities, or the results of a single one."""

import math
from typing import TYPE_CHECKING

import numpy as np

from chaincor.workflows.scripts.answers import LadderAnswer, NumberAnswer
from chaincor.workflows.scripts.bottom_line import answer_of
from chaincor.workflows.scripts.ladder_runs import NumberLadder, ScriptLadder
from chaincor.workflows.scripts.step_settings import how_to_run
from chaincor.workflows.scripts.varied import SEED

if TYPE_CHECKING:
    from chaincor.workflows.scripts.study import ScriptStudy

_WIDTHS = (20, -24, -12, -10, 0, -13)
# For an error bar of its mean, a quantity needs this many independent samples in a run.
_ENOUGH_SAMPLES = 30


def heads_of(answer: LadderAnswer, each: ScriptLadder) -> tuple[str, ...]:
    """Return the column headings for the table of all quantities."""
    finest = float(each.values[-1])
    place = f"{finest if answer.own is None else answer.own:g}"
    whose = f"{each.ladder.name} {place}" if answer.own is None else f"your {place}"
    return ("quantity", "value", "error", "tolerance", whose, "one run up to")


def number_table(study: "ScriptStudy", each: ScriptLadder) -> list[str]:
    """Return a table with one row per quantity, and explain its columns below it."""
    answer = answer_of(study, each)
    rows = [heads_of(answer, each), *(cells(each, row) for row in answer.numbers)]
    state = max(len(row[4]) for row in rows)
    widths = [width or state for width in _WIDTHS]
    lines = [
        "  ".join(
            f"{cell:<{width}}" if width > 0 else f"{cell:>{-width}}"
            for cell, width in zip(row, widths, strict=True)
        ).rstrip()
        for row in rows
    ]
    return [*lines, *_meanings(study, each, answer)]


def cells(each: ScriptLadder, answer: NumberAnswer) -> tuple[str, ...]:
    """Return one quantity's row of the table."""
    number, verdict = answer.number, answer.number.verdict
    value = "-"
    if verdict.value is not None and verdict.value_error is not None:
        value = with_bar(verdict.value, verdict.value_error)
    elif answer.state == "constant":
        value = f"{float(number.results.flat[0]):.10g}"
    said = {"beyond": "too large", "too noisy": f"mean of {answer.runs} runs"}
    return (
        number.name,
        value,
        f"{answer.error:.1e}" if math.isfinite(answer.error) else "-",
        "-" if number.tolerance is None else f"{number.tolerance:.2g}",
        said.get(answer.state, answer.state),
        "-" if answer.largest is None else each.ladder.text(answer.largest),
    )


def _meanings(study: "ScriptStudy", each: ScriptLadder, answer: LadderAnswer) -> list[str]:
    """Explain each column and the tolerances."""
    name = each.ladder.name
    limit = f"very small {name}s" if name == "timestep" else f"the fine end of {name}"
    at = f"the finest {name}" if answer.own is None else f"your {name}"
    lines = [
        f"value: the result at {limit}, with its 95 % error",
        f"error: largest difference of one run at {at} from that value, with 95 % probability",
        f"one run up to: coarsest {name} at which the error of one run is within the tolerance",
    ]
    reasons: dict[str, list[str]] = {}
    for number in each.numbers:
        if number.tolerance_reason:
            reasons.setdefault(number.tolerance_reason, []).append(number.name)
    said = [f"{', '.join(names)}: {reason}" for reason, names in reasons.items()]
    if said:
        lines.append("tolerance: by default, of " + "; of ".join(said))
    elif study.tolerance is not None:
        lines.append(f"tolerance: {study.tolerance:g} for each quantity, as given by --tolerance")
    return lines


def number_rows(
    study: "ScriptStudy", each: ScriptLadder, number: NumberLadder
) -> list[tuple[str, str]]:
    """Return the results of one quantity, and the advice, as pairs of heading and text."""
    verdict = number.verdict
    said = [("verdict", f"{verdict.kind}: {verdict.reason}")]
    if verdict.order is not None and verdict.order_error is not None:
        what = "of the scatter" if verdict.kind == "irregular" else "of the error"
        said.append(("order", f"{with_bar(verdict.order, verdict.order_error)} {what}"))
    if verdict.value is not None and verdict.value_error is not None:
        source = {
            "regular": "extrapolated",
            "noise": "mean of all runs",
            "bounded": "by the means of the runs",
        }
        method = source.get(verdict.kind, "mean of the finest runs")
        said.append(("value", f"{with_bar(verdict.value, verdict.value_error)}, {method}"))
    if number.standard_error is not None:
        said.append(("one run", f"+- {number.standard_error:.1e}, by its own samples"))
    elif number.independent is not None:
        said.append(("one run", f"too few samples for a bar{run_longer(number.independent)}"))
    if number.tolerance is not None:
        reason = number.tolerance_reason or "as given by --tolerance"
        said.append(("tolerance", f"{number.tolerance:.2g}: {reason}"))
    return [*said, ("advice", advise(study, each, number))]


def one_number(study: "ScriptStudy", each: ScriptLadder, number: NumberLadder) -> list[str]:
    """Return the results of a single quantity with one row per rung, and the advice."""
    *said, advice = [f"{name:<12} {text}" for name, text in number_rows(study, each, number)]
    lines = [*said, ""]
    name = each.ladder.name
    lines.append(f"{name:>12} {'mean':>16} {'scatter':>10} {'error':>10} {'time':>9}")
    for k, value in enumerate(each.values):
        keeps = number.verdict.promised[k]
        lines.append(
            f"{each.ladder.text(float(value)):>12} {number.results[k].mean():>16.10g} "
            f"{f'{number.verdict.scatter[k]:.1e}' if np.ptp(number.results) else '-':>10} "
            f"{f'{keeps:.1e}' if np.isfinite(keeps) else '-':>10} {each.seconds[k]:>7.2g} s"
        )
    lines.append("error: largest difference of one run from the value, with 95 % probability")
    return [*lines, advice]


def advise(study: "ScriptStudy", each: ScriptLadder, number: NumberLadder) -> str:
    """Return one line with the cheapest way to meet the tolerance."""
    name, tolerance, advice = each.ladder.name, number.tolerance, number.advice
    if number.verdict.kind == "cannot tell":
        return "none: the number is the same in all runs"
    if tolerance is None:
        return "none: the ladder has no bound on the error; see the last line"
    if advice is None:
        finest, best = each.ladder.text(float(each.values[-1])), number.verdict.promised[-1]
        return (
            f"none: the allowed error is {tolerance:.2g}, but one run at {name} {finest} may be "
            f"off by {best:.2g}; see the last line"
        )
    text = each.ladder.text(advice.value)
    if not advice.tried:
        return (
            f"the allowed error is {tolerance:.2g}, but the finest {name} tried keeps "
            f"{number.verdict.promised[-1]:.1e}; by the order, {name} = {text} may do: measure "
            f"with --vary {name}={each.ladder.text(float(each.values[-1]))}:{text}:6"
        )
    said = f"cheapest for {tolerance:.3g}, {advice.seconds:.2g} s: "
    said += how_to_run(study, name, text, each.fixed)
    if advice.runs > 1:
        seeds = f" with -var {SEED} 1 to {advice.runs}" if study.varied.own_seed else ""
        said += f", the mean of {advice.runs} runs{seeds}, or one run of their total length"
    return said


def run_longer(independent: float) -> str:
    """Return by which factor a run must be longer before its mean has an error bar."""
    if not math.isfinite(independent):
        return ""
    factor = factor_for_bar(independent)
    return f" ({correlation_times(independent)}: run {factor} times longer)"


def factor_for_bar(independent: float) -> int:
    """Return by which factor a run must be longer for the error bar of its mean."""
    return max(math.ceil(_ENOUGH_SAMPLES / max(independent, 1.0)), 2)


def correlation_times(independent: float) -> str:
    """Return a number of correlation times in words."""
    return f"{independent:.0f} correlation time{'' if f'{independent:.0f}' == '1' else 's'}"


def with_bar(value: float, error: float) -> str:
    """Format a value with its significant digits according to its error bar."""
    if not error > 0.0:
        return f"{value:.12g} +- {error:.1e}"
    digits = min(max(1 - math.floor(math.log10(error)), 0), 16)
    return f"{value:.{digits}f} +- {error:.1e}"
