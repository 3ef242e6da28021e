"""Bottom line of a study: the value to use, how many runs, how sure, and why."""

import math
import re
import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from chaincor.workflows.scripts.answers import (
    Choice,
    LadderAnswer,
    NumberAnswer,
    answer_ladder,
    needs_finer,
)
from chaincor.workflows.scripts.change import draws_forces
from chaincor.workflows.scripts.ladder_runs import NumberLadder, ScriptLadder
from chaincor.workflows.scripts.step_settings import where_to_set

if TYPE_CHECKING:
    from chaincor.workflows.scripts.study import ScriptStudy

_PLAIN = re.compile(r"[\w:\[\]]+")
# Most runs per rung, ratio to a finer end, and number of rungs in proposed commands.
_MOST_PHASES, _FINER, _RUNGS = 100, 8.0, 6
# Ratio to coarser ends, in the command for a number that the step does not change.
_COARSER = 8.0
_TWICE = 2.0
# Largest ratio to a finer end, and longest proposed run over the script's.
_FINEST, _MOST_LONGER = 1e4, 100.0
# Extrapolations by the order aim at this part of the tolerance.
_AIM = 0.5
# Largest number of quantities that a sentence lists with their errors.
_MOST_LISTED = 3


def bottom_line(study: "ScriptStudy") -> str:
    """Return the advice for all numbers of a study as text."""
    said = [_of_comparison(study)] if study.comparisons else []
    for each in study.ladders:
        fixed = ", ".join(f"{name} = {value}" for name, value in each.fixed.items())
        text = _answered(study, each)
        said.append(f"At {fixed}: {text}" if fixed else text)
    said += [change.short for change in study.changes]
    if study.ladders:
        said.append(_of_crashes(study))
    # Commands come last, so that each can be copied to the end of the line.
    for each in study.ladders:
        fixed = ", ".join(f"{name} = {value}" for name, value in each.fixed.items())
        left = _unanswered(study, each)
        said += [f"At {fixed}: {text}" if fixed else text for text in left]
    return " ".join(filter(None, said))


def answer_of(study: "ScriptStudy", each: ScriptLadder) -> LadderAnswer:
    """Return the answer of one ladder of a study."""
    return answer_ladder(each, study.own_step, [crash.value for crash in study.crashes])


def name_of(number: NumberLadder) -> str:
    """Return the name of a number; a pattern is quoted."""
    return number.name if _PLAIN.fullmatch(number.name) else f"'{number.name}'"


def _answered(study: "ScriptStudy", each: ScriptLadder) -> str:
    """Return the value to use, the number of runs, how sure, and why."""
    answer = answer_of(study, each)
    parts = [_own_value(study, each, answer)]
    if answer.use is not None:
        parts.append(_use(study, each, answer))
        parts.append(_how_sure(each, answer))
        if answer.coarser is not None and answer.keeps_own:
            value = each.ladder.text(answer.coarser.value)
            parts.append(f"A {each.ladder.name} of {value} would do as well.")
    return " ".join(filter(None, parts))


def _unanswered(study: "ScriptStudy", each: ScriptLadder) -> list[str]:
    """Return sentences on numbers without an answer, each with a command that would give one."""
    answer = answer_of(study, each)
    beyond, hidden = answer.in_state("beyond"), answer.in_state("not judged")
    said = [_no_value(each, beyond)] if beyond else []
    said += [_not_judged(each, hidden)] if hidden else []
    if beyond or hidden:
        said.append(_remedy(study, each, [*beyond, *hidden]))
    if constant := [a.number for a in answer.in_state("constant")]:
        said.append(_of_constants(study, each, constant, alone=len(constant) == len(each.numbers)))
    return said


def _own_value(study: "ScriptStudy", each: ScriptLadder, answer: LadderAnswer) -> str:
    """Say whether the script's own value is small enough; empty if it is unknown."""
    if answer.own is None:
        return ""
    yours = f"Your {each.ladder.name} {answer.own:g}"
    if answer.own_fails:
        own = next((crash for crash in study.crashes if crash.value == answer.own), None)
        return f"{yours} is too large: " + ("runs fail near it." if own is None else f"{own.said}.")
    too_large = answer.in_state("too large")
    if too_large and all(math.isinf(a.error) for a in too_large):
        return f"{yours} is coarser than the values tried, so it was not judged."
    too_large += answer.in_state("beyond")
    if too_large:
        return f"{yours} is too large for {_listed(too_large)}."
    if len(answer.in_state("constant")) == len(answer.numbers):
        return f"{yours} is small enough."
    if not answer.judged:
        return (
            f"{yours} is not judged: no error is seen, but the runs are too few or too short to "
            "be sure. Keep it for now."
        )
    noisy = answer.in_state("too noisy")
    text = f"{yours} is small enough for {_all_of(answer.judged)}"
    return f"{text}, but one run is too noisy for {_listed(noisy)}." if noisy else f"{text}."


def _use(study: "ScriptStudy", each: ScriptLadder, answer: LadderAnswer) -> str:
    """Return the value to use and the number of runs."""
    ladder, use = each.ladder, answer.use
    assert use is not None
    if answer.keeps_own:
        now = " for now" if answer.in_state("not judged") else ""
        if use.runs == 1:
            return f"Keep it{now}; one run is enough."
        text = f"Keep it{now} and {_average(use)}"
        if answer.single is not None:
            text += f", or use {ladder.name} {ladder.text(answer.single.value)} and one run"
        return f"{text}."
    parts = []
    if answer.single is not None:
        parts.append(f"{ladder.text(answer.single.value)} and one run")
    several = answer.several
    if several is not None and (
        answer.single is None or ladder.step(several.value) > ladder.step(answer.single.value)
    ):
        parts.append(f"{ladder.text(several.value)} and {_average(several)}")
    where = where_to_set(study, ladder.name)
    return f"Use {ladder.name} {', or '.join(parts)}{where}."


def _average(choice: Choice) -> str:
    return f"average {choice.runs} runs (or run {choice.runs} times as long)"


def _how_sure(each: ScriptLadder, answer: LadderAnswer) -> str:
    """State the probability, its subject, and the quantity nearest to its tolerance."""
    assert answer.use is not None
    judged = answer.judged
    limit = "very small timesteps" if each.ladder.name == "timestep" else "the fine end"
    one = len(judged) == 1
    what = _name(judged[0]) if one else f"each of these {len(judged)} quantities"
    by = f"{judged[0].number.tolerance:.2g}" if one else "its tolerance"
    text = f"With 95 % probability, {what} then differs by less than {by} from its value at {limit}"
    if one or not answer.keeps_own or answer.use.runs > 1:
        return f"{text}."
    worst = max(judged, key=lambda a: a.error / (a.number.tolerance or 1e-300))
    return f"{text}; nearest to its tolerance is {_listed([worst])}."


def _not_judged(each: ScriptLadder, hidden: list[NumberAnswer]) -> str:
    """Name the numbers whose errors are not known well enough."""
    one = len(hidden) == 1
    text = f"{_listed(hidden)} {'is' if one else 'are'} not judged: the runs show no effect of the "
    text += f"{each.ladder.name} on {'it' if one else 'them'}, but scatter too much to be sure."
    return text


def _no_value(each: ScriptLadder, beyond: list[NumberAnswer]) -> str:
    """Name the numbers for which no value of the ladder is small enough."""
    ladder, finest = each.ladder, float(each.values[-1])
    worst = max((a.number for a in beyond), key=_left)
    best = float(worst.verdict.promised[-1])
    small = "small enough" if ladder.fine < ladder.coarse else "fine enough"
    text = f"No {ladder.name} from {ladder.text(float(each.values[0]))} to {ladder.text(finest)} "
    text += f"is {small} for {', '.join(map(_name, beyond))}"
    if math.isfinite(best):
        text += f": at {ladder.text(finest)} the error of {name_of(worst)} is up to {best:.2g}, "
        text += f"{worst.tolerance:.2g} allowed"
    return f"{text}."


def _remedy(study: "ScriptStudy", each: ScriptLadder, answers: list[NumberAnswer]) -> str:
    """Return what would judge some numbers, as a command at the end."""
    numbers = [a.number for a in answers]
    varied = study.varied
    moved = [count for count in study.counts if count.moves and count.periods]
    if moved and not varied.scale_periods:
        # Its effect on the result may be larger than that of the step.
        command = [*study.command, *_given(study), "--scale-periods"]
        said = f"{moved[0].command} counts steps: to keep its period in time, run"
        said = said[0].upper() + said[1:]
        return f"{said}: {shlex.join(command)}"
    noisy = [number for number in numbers if not needs_finer(number)]
    if not noisy:
        return (
            f"To find one, run: {shlex.join([*study.command, '--vary', _extended(each, numbers)])}"
        )
    command = [*study.command, *_given(study)]
    # The bias falls with the root of the number or the length of the runs.
    ratios = [float(np.min(n.verdict.bias)) / (n.tolerance or 1e-300) for n in noisy]
    more = max(_TWICE, *((_TWICE * ratio) ** 2 for ratio in ratios))
    if not all(number.repeats for number in noisy):
        if not _is_random(study):
            # Nearby steps then scatter because of the step.
            ladder = ["--vary", _extended(each, noisy), "--phases", str(2 * varied.columns)]
            return f"To judge, run: {shlex.join([*study.command, *ladder])}"
        return (
            f"To judge, run: {shlex.join([*command, '--seeds', str(max(2 * varied.columns, 8))])}"
        )
    if more * varied.columns <= _MOST_PHASES:
        option = "--seeds" if varied.seeds else "--phases"
        command += [option, str(math.ceil(more * varied.columns))]
        return f"To judge, run: {shlex.join(command)}"
    factor = "100 times longer or more" if more > _MOST_LONGER else f"{_rounded(more)} times longer"
    return f"To judge, make the runs {factor}, then run: {shlex.join(command)}"


def _is_random(study: "ScriptStudy") -> bool:
    """Return whether the script draws random numbers that seeds change."""
    words = [command.words for command in study.varied.script.commands]
    return study.varied.own_seed or any(
        draws_forces(each) or (each[0] == "velocity" and "create" in each) for each in words
    )


def _left(number: NumberLadder) -> float:
    """Return the error at the finest value over the tolerance."""
    return float(number.verdict.promised[-1]) / (number.tolerance or 1e-300)


def _rounded(factor: float) -> str:
    return f"{float(f'{factor:.1g}'):g}"


def _extended(each: ScriptLadder, numbers: Sequence[NumberLadder]) -> str:
    """Return a ladder that would reach the tolerances, by the orders where they are known."""
    factors = [_TWICE]
    for number in numbers:
        order = number.verdict.order or (1.0 if number.verdict.kind == "irregular" else None)
        left = _left(number) / _AIM
        known = order is not None and math.isfinite(left)
        factors.append(min(left ** (1.0 / order), _FINEST) if known and order else _FINER)
    return _finer(each, max(factors))


def _given(study: "ScriptStudy") -> list[str]:
    """Return the ladder of a study as options; empty for the script's own step."""
    if study.own_step is not None:
        return []
    given = study.varied.ladder
    return [
        "--vary",
        f"{given.name}={given.text(given.coarse)}:{given.text(given.fine)}:{given.rungs}",
    ]


def _finer(each: ScriptLadder, factor: float) -> str:
    """Return a ladder that begins where this one ends."""
    ladder, finest = each.ladder, float(each.values[-1])
    fine = finest / factor if ladder.fine < ladder.coarse else finest * factor
    value = float(round(fine)) if ladder.counts else float(f"{fine:.2g}")
    return f"{ladder.name}={ladder.text(finest)}:{ladder.text(value)}:{_RUNGS}"


def _of_constants(
    study: "ScriptStudy", each: ScriptLadder, numbers: list[NumberLadder], *, alone: bool
) -> str:
    value = float(numbers[0].results.flat[0])
    ladder, coarsest = each.ladder, float(each.values[0])
    names = ", ".join(map(name_of, numbers))
    said = f"is {value:g} in all runs" if len(numbers) == 1 else "do not change from run to run"
    ends = f"from {ladder.text(coarsest)} to {ladder.text(float(each.values[-1]))}"
    text = f"{names} {said}, {ends}"
    if not alone:
        return f"{text}."
    coarse = coarsest * _COARSER if ladder.fine < ladder.coarse else coarsest / _COARSER
    if ladder.counts:
        coarse = float(max(round(coarse), 1))
    wider = f"{ladder.name}={ladder.text(coarse)}:{ladder.text(coarsest)}:4"
    time = "" if each.ends is None else f" in this time of {each.ends[1]:.4g}"
    return (
        f"{text}: the {ladder.name} makes no difference. If nothing happens{time}, make the runs "
        f"longer. To try coarser values, run: {shlex.join([*study.command, '--vary', wider])}"
    )


def _of_crashes(study: "ScriptStudy") -> str:
    """Name the finest value at which a run stopped, and the coarser ones."""
    if not study.crashes:
        return "No run stopped early."
    *coarser, finest = study.crashes
    others = ", ".join(f"{crash.value:g}" for crash in coarser)
    # The first sentence has named a crash at the script's own step.
    text = f"{finest} " if finest.value != study.own_step else ""
    text += f"Runs at {others} stop as well. " if coarser else ""
    return f"{text}No other run stopped early."


def _listed(answers: list[NumberAnswer]) -> str:
    """Return the names and errors of numbers, the largest error over tolerance first."""
    ranked = sorted(answers, key=lambda a: -a.error / (a.number.tolerance or 1e-300))
    said = [f"{_name(a)} ({_error(a)})" for a in ranked[:_MOST_LISTED]]
    left = len(ranked) - len(said)
    return ", ".join(said) + (f" and {left} more" if left else "")


def _name(answer: NumberAnswer) -> str:
    return name_of(answer.number)


def _error(answer: NumberAnswer) -> str:
    """Return the error of one run and its tolerance."""
    known = f"error up to {answer.error:.2g}" if math.isfinite(answer.error) else "no bound"
    return (
        known
        if answer.number.tolerance is None
        else (f"{known}, {answer.number.tolerance:.2g} allowed")
    )


def _all_of(answers: list[NumberAnswer]) -> str:
    if len(answers) <= _MOST_LISTED:
        return ", ".join(map(_name, answers))
    return f"{len(answers)} quantities"


def _of_comparison(study: "ScriptStudy") -> str:
    said = []
    for each in study.comparisons:
        known = {name: number.agrees for name, number in each.numbers.items()}
        differ = [name.removesuffix(":mean") for name, agrees in known.items() if agrees is False]
        agree = [name.removesuffix(":mean") for name, agrees in known.items() if agrees]
        text = {
            "same": "not a digit differs",
            "together": "the runs differ by roundings alone: no bug",
            "chaos": "the runs part by chaos, which is no bug: compare means, not frames",
            "at once": "the runs differ from the beginning: " + "; ".join(each.causes[:1]),
        }[each.kind]
        if each.renumbered and each.kind != "at once":
            text += ". LAMMPS numbered the particles differently; they were matched by position"
        if each.kind in ("chaos", "at once"):
            if differ:
                text += f". Means differ: {', '.join(differ)}"
            elif agree:
                text += f". Means agree: {', '.join(agree)}"
            else:
                text += ". The run is too short to compare means"
        said.append(f"{each.what[0].upper()}{each.what[1:]}: {text}.")
    return " ".join(said)
