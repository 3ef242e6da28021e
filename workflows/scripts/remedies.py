"""Write which quantities could not be judged, and a command that would judge them."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from chaincor.workflows.scripts.answers import LadderAnswer, NumberAnswer, needs_finer
from chaincor.workflows.scripts.change import draws_forces
from chaincor.workflows.scripts.ladder import STEP
from chaincor.workflows.scripts.ladder_runs import NumberLadder, ScriptLadder
from chaincor.workflows.scripts.number_names import listed, name_in, name_of
from chaincor.workflows.scripts.step_counts import StepCount, periods_in_steps

if TYPE_CHECKING:
    from chaincor.workflows.scripts.study import ScriptStudy

# A proposed command has at most _MOST_PHASES runs per rung, and _RUNGS rungs. Its fine end is finer
# by the factor _FINER if no convergence order predicts the necessary factor.
_MOST_PHASES, _FINER, _RUNGS = 100, 8.0, 6
# If the step does not change a quantity, the proposed ladder begins at this multiple of the present
# coarse end.
_COARSER = 8.0
_TWICE = 2.0
# A proposed fine end is finer by at most the factor _FINEST, and a proposed run is longer by at
# most the factor _MOST_LONGER.
_FINEST, _MOST_LONGER = 1e4, 100.0
# Extrapolations with the convergence order aim at this fraction of the tolerance.
_AIM = 0.5


class Remedy(NamedTuple):
    """Proposal for a study that would judge the remaining quantities."""

    text: str  #: A sentence that ends with a command.
    longer: float = 1.0  #: Factor by which the proposal makes the runs longer.


def unanswered(study: "ScriptStudy", each: ScriptLadder, answer: LadderAnswer) -> list[str]:
    """Write which quantities could not be judged, and commands that would judge them."""
    beyond, hidden = answer.in_state("beyond"), answer.in_state("not judged")
    said = [_no_value(each, beyond)] if beyond else []
    said += [_not_judged(each, hidden)] if hidden else []
    if beyond or hidden or (answer.in_state("too large") and unscaled_period(study) is not None):
        said.append(_remedy(study, each, [*beyond, *hidden]).text)
    if constant := [a.number for a in answer.in_state("constant")]:
        said.append(_of_constants(study, each, constant, alone=answer.all_constant))
    return said


def unscaled_period(study: "ScriptStudy") -> StepCount | None:
    """Return the first command whose period in steps affects the motion, unless it is scaled."""
    return None if study.varied.scale_periods else next(periods_in_steps(study.counts), None)


def times_longer(study: "ScriptStudy", each: ScriptLadder, answer: LadderAnswer) -> float:
    """Return the factor by which the proposed runs are longer, which may be 1."""
    left = [*answer.in_state("beyond"), *answer.in_state("not judged")]
    return _remedy(study, each, left).longer if left else 1.0


def no_change(each: ScriptLadder) -> str:
    """Write that the study tested nothing, because no quantity differs between the runs."""
    time = "" if each.ends is None else f" in this time of {each.ends[1]:.4g}"
    return f"No quantity changes{time}, so the {each.ladder.name} cannot be judged."


def _not_judged(each: ScriptLadder, hidden: list[NumberAnswer]) -> str:
    """Write for which quantities scatter hides the error."""
    one, ladder = len(hidden) == 1, each.ladder
    text = f"{listed(hidden)} {'is' if one else 'are'} not judged: the scatter between runs hides "
    text += f"any effect of the {ladder.name}."
    number = hidden[0].number
    best = float(number.verdict.promised[-1])
    if one and math.isfinite(best) and number.tolerance is not None:
        finest = ladder.text(float(each.values[-1]))
        text += f" At {finest}, the finest tried, {name_in(hidden[0])} of one run may "
        text += f"still be off by {best:.2g}."
    return text


def _no_value(each: ScriptLadder, beyond: list[NumberAnswer]) -> str:
    """Write which quantities are not accurate enough even at the finest value."""
    ladder, finest = each.ladder, float(each.values[-1])
    worst = max((a.number for a in beyond), key=_left)
    best = float(worst.verdict.promised[-1])
    small = "small enough" if ladder.fine < ladder.coarse else "fine enough"
    text = f"No {ladder.name} from {ladder.text(float(each.values[0]))} to {ladder.text(finest)} "
    text += f"is {small} for {', '.join(map(name_in, beyond))}"
    if math.isfinite(best):
        text += f": at {ladder.text(finest)} the error of {name_of(worst)} is up to {best:.2g}, "
        text += f"{worst.tolerance:.2g} allowed"
    return f"{text}."


def _remedy(study: "ScriptStudy", each: ScriptLadder, answers: list[NumberAnswer]) -> Remedy:
    """Propose a command that would judge the quantities in `answers`."""
    numbers = [a.number for a in answers]
    varied = study.varied
    if unscaled_period(study) is not None:
        # If a period is counted in steps, its length changes with the step. This change may affect
        # the result more than the step itself.
        command = study.command.again("--scale-periods")
        return Remedy(f"To keep periods that are counted in steps, run: {command}")
    noisy = [number for number in numbers if not needs_finer(number)]
    if not noisy:
        command = study.command.again(ladder=_extended(study, each, numbers))
        return Remedy(f"To look for a sufficient {each.ladder.name}, run: {command}")
    # The uncertainty is inversely proportional to the square root of the number or the length of
    # the runs.
    ratios = [float(np.min(n.verdict.bias)) / (n.tolerance or 1e-300) for n in noisy]
    more = max(_TWICE, *((_TWICE * ratio) ** 2 for ratio in ratios))
    if not all(number.repeats for number in noisy):
        if not _is_random(study):
            # Without random numbers, results scatter only because runs use different nearby steps.
            # The remedy is therefore more runs at nearby steps.
            ladder = _extended(study, each, noisy)
            return _more_runs(study, each, ("--phases", 2 * varied.columns), ladder)
        return _more_runs(study, each, ("--seeds", max(2 * varied.columns, 8)))
    if more * varied.columns <= _MOST_PHASES:
        option = "--seeds" if varied.seeds else "--phases"
        return _more_runs(study, each, (option, math.ceil(more * varied.columns)))
    factor = "100 times longer or more" if more > _MOST_LONGER else f"{rounded(more)} times longer"
    text = f"To judge, make the script's runs {factor}, then run: {study.command.again()}"
    return Remedy(text, min(more, _MOST_LONGER))


def _more_runs(
    study: "ScriptStudy", each: ScriptLadder, runs: tuple[str, int], ladder: str | None = None
) -> Remedy:
    """Propose a command with more runs at each value."""
    option, count = runs
    kind = "seeds" if option == "--seeds" else "runs"
    said = f"To judge with {count} {kind} at each {each.ladder.name}, run"
    return Remedy(f"{said}: {study.command.again(ladder=ladder, runs=runs)}")


def _is_random(study: "ScriptStudy") -> bool:
    """Return whether the script draws random numbers."""
    words = [command.words for command in study.varied.script.commands]
    return study.varied.own_seed or any(
        draws_forces(each) or (each[0] == "velocity" and "create" in each) for each in words
    )


def _left(number: NumberLadder) -> float:
    """Return the error at the finest value in units of the tolerance."""
    return float(number.verdict.promised[-1]) / (number.tolerance or 1e-300)


def rounded(factor: float) -> str:
    """Return a factor as text with one digit."""
    return f"{float(f'{factor:.1g}'):g}"


def _extended(study: "ScriptStudy", each: ScriptLadder, numbers: Sequence[NumberLadder]) -> str:
    """Return the option for a ladder whose fine end is expected to meet the tolerances."""
    factors = [_TWICE]
    for number in numbers:
        order = number.verdict.order or (1.0 if number.verdict.kind == "irregular" else None)
        left = _left(number) / _AIM
        known = order is not None and math.isfinite(left)
        factors.append(min(left ** (1.0 / order), _FINEST) if known and order else _FINER)
    return _finer(study, each, max(factors))


def _finer(study: "ScriptStudy", each: ScriptLadder, factor: float) -> str:
    """Return the option for a ladder that continues towards finer values."""
    ladder, finest = each.ladder, float(each.values[-1])
    fine = finest / factor if ladder.fine < ladder.coarse else finest * factor
    value = float(round(fine)) if ladder.counts else float(f"{fine:.2g}")
    own, failed = study.own_step, [crash.value for crash in study.crashes]
    begin = finest if own is None or own >= min(failed, default=math.inf) else max(own, finest)
    return f"{ladder.name}={ladder.text(begin)}:{ladder.text(value)}:{_RUNGS}"


def _of_constants(
    study: "ScriptStudy", each: ScriptLadder, numbers: list[NumberLadder], *, alone: bool
) -> str:
    """Write which quantities do not differ between the runs; if none differs, propose a command."""
    ladder, coarsest = each.ladder, float(each.values[0])
    found = {float(number.results.flat[0]) for number in numbers}
    value = f"{found.pop():g}" if len(found) == 1 else "the same"
    verb = "is" if len(numbers) == 1 else "are"
    ends = f"from {ladder.text(coarsest)} to {ladder.text(float(each.values[-1]))}"
    text = f"{', '.join(map(name_of, numbers))} {verb} {value} in all runs, {ends}."
    if not alone:
        return text
    if ladder.name == STEP and each.ends is not None:
        said = "Make the runs longer, or start particles that move, then run"
        return f"{text} {said}: {study.command.again()}"
    coarse = coarsest * _COARSER if ladder.fine < ladder.coarse else coarsest / _COARSER
    if ladder.counts:
        coarse = float(max(round(coarse), 1))
    wider = f"{ladder.name}={ladder.text(coarse)}:{ladder.text(coarsest)}:4"
    return f"{text} To try coarser values, run: {study.command.again(ladder=wider)}"
