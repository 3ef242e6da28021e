"""Bottom line of a study: one step for all numbers, or a command that would find one."""

import math
import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chaincor.workflows.scripts.advice import MOST_RUNS, largest_value, runs_to_average
from chaincor.workflows.scripts.ladder_runs import NumberLadder, ScriptLadder
from chaincor.workflows.scripts.step_settings import where_to_set

if TYPE_CHECKING:
    from chaincor.workflows.scripts.study import ScriptStudy

# Most runs per rung, ratio to a finer end, and number of rungs in proposed commands.
_MOST_PHASES, _FINER, _RUNGS = 100, 8.0, 6
# Extrapolations by the order aim at this part of the tolerance.
_AIM = 0.5
# Smallest ratio at which a coarser step is mentioned.
_COARSER = 1.1


@dataclass(frozen=True)
class Choice:
    """A value of the variable that keeps all tolerances."""

    value: float
    runs: int  #: Number of runs to average.
    decides: NumberLadder  #: Number that needs the finest value.


def bottom_line(study: "ScriptStudy") -> str:
    """Return the advice for all numbers of a study as text."""
    said = [_of_comparison(study)] if study.comparisons else []
    for each in study.ladders:
        fixed = ", ".join(f"{name} = {value}" for name, value in each.fixed.items())
        text = _of_ladder(study, each)
        said.append(f"At {fixed}: {text}" if fixed else text)
    if study.crashes:
        *coarser, finest = study.crashes
        others = ", ".join(f"{crash.value:g}" for crash in coarser)
        said.append(str(finest) + (f" The run fails at {others} as well." if coarser else ""))
    return " ".join(said)


def common_choices(each: ScriptLadder) -> tuple[Choice | None, Choice | None]:
    """Return the coarsest value of one run and the cheapest mean that keep all tolerances."""
    numbers = [number for number in each.numbers if number.tolerance is not None]
    step = each.ladder.step
    singles: list[Choice] = []
    for number in numbers:
        value = largest_value(each.ladder, each.values, number.verdict, number.tolerance or 0.0)
        if value is None:
            singles = []
            break
        singles.append(Choice(value, 1, number))
    single = min(singles, key=lambda choice: step(choice.value)) if singles else None
    costs = np.minimum.accumulate(each.seconds[::-1])[::-1]
    means: list[tuple[float, Choice]] = []
    wanted = [
        [n if number.repeats or n == 1 else None
         for n in runs_to_average(number.verdict, number.tolerance or 0.0)]
        for number in numbers
    ]  # fmt: skip
    for k, value in enumerate(each.values):
        runs = [row[k] for row in wanted]
        if numbers and all(n is not None for n in runs):
            most = max(range(len(runs)), key=lambda j: runs[j] or 0)
            choice = Choice(float(value), runs[most] or 1, numbers[most])
            means.append((choice.runs * float(costs[k]), choice))
    several = min(means, key=lambda pair: pair[0])[1] if means else None
    return single, None if several is None or several.runs == 1 else several


def promised_at(each: ScriptLadder, number: NumberLadder, value: float) -> float:
    """Return the largest error of one run at a value; inf for values coarser than the ladder."""
    steps = np.array([each.ladder.step(x) for x in each.values])
    promised = number.verdict.promised
    at = each.ladder.step(value)
    if at > steps[0] * (1.0 + 1e-9) or not np.all(np.isfinite(promised)):
        return math.inf
    logs = np.interp(math.log(at), np.log(steps[::-1]), np.log(promised[::-1]))
    return float(math.exp(logs))


def short_name(number: NumberLadder) -> str:
    """Return the short name of a number: the quantity alone for a mean."""
    return number.name.removesuffix(":mean")


def _of_ladder(study: "ScriptStudy", each: ScriptLadder) -> str:
    known = [number for number in each.numbers if number.tolerance is not None]
    constant = [number for number in each.numbers if number.verdict.kind == "cannot tell"]
    if not known:
        return _of_constants(study, each, constant or list(each.numbers))
    single, several = common_choices(each)
    own = study.own_step
    crashed = own is not None and any(own == crash.value for crash in study.crashes)
    worst = max(known, key=lambda n: _excess(each, n, own if own is not None else None))
    names = _all_of(known)
    if own is not None and not crashed:
        error = promised_at(each, worst, own)
        if error <= (worst.tolerance or 0.0):
            text = f"Your step {own:g} is small enough for {names}: "
            text += f"the error of {short_name(worst)} is at most {error:.1e}"
            text += f", of {_tolerance(study, worst)}"
            coarser = single is not None and single.value > _COARSER * own
            if coarser and single is not None:
                text += f". A step of {each.ladder.text(single.value)} would do as well"
            return f"{text} (95 % sure)."
        head = f"Your step {own:g} is too large for {short_name(worst)}"
        if several is not None and several.value >= own and single is None:
            head = f"At your step {own:g} one run is too noisy for {short_name(worst)}"
        head += f" (error {error:.1e}, {_tolerance(study, worst)})."
        if math.isinf(error):
            head = f"Your step {own:g} is too large: runs at steps near it fail."
    elif own is not None:
        head = f"Your step {own:g} is too large: the run fails."
    else:
        head = f"The error of {short_name(worst)} decides ({_tolerance(study, worst)})."
    return f"{head} {_use(study, each, single, several)}"


def _use(
    study: "ScriptStudy", each: ScriptLadder, single: Choice | None, several: Choice | None
) -> str:
    """Return the value to use, or a command that would find one."""
    text = each.ladder.text
    if single is None and several is None:
        return _what_would_tell(study, each)
    parts = []
    if single is not None:
        parts.append(f"{text(single.value)}")
    coarser = several is not None and (
        single is None or each.ladder.step(several.value) > each.ladder.step(single.value)
    )
    if several is not None and coarser:
        mean = f"the mean of {several.runs} runs"
        parts.append(f"{text(several.value)} with {mean}, or one run {several.runs} times as long")
    where = where_to_set(study, each.ladder.name)
    return f"Use {each.ladder.name} {', or '.join(parts)} (95 % sure){where}."


def _what_would_tell(study: "ScriptStudy", each: ScriptLadder) -> str:
    """Return the best result of the ladder, and a command that would extend it."""
    known = [number for number in each.numbers if number.tolerance is not None]
    worst = max(known, key=lambda n: float(n.verdict.promised[-1]) / (n.tolerance or 1.0))
    verdict, tolerance = worst.verdict, worst.tolerance or 0.0
    ladder, finest = each.ladder, float(each.values[-1])
    best = float(verdict.promised[-1])
    text = ladder.text
    said = f"No {ladder.name} from {text(float(each.values[0]))} to {text(finest)} is enough: "
    if math.isfinite(best):
        said += f"at {text(finest)} one run keeps {best:.1e}. "
    options = []
    columns = study.varied.columns
    more = columns * (2.0 * float(np.min(verdict.bias)) / tolerance) ** 2
    smooth = verdict.kind == "regular" and verdict.order is not None
    if smooth or verdict.kind == "irregular":
        order = verdict.order or 1.0
        factor = min(max((best / (_AIM * tolerance)) ** (1.0 / order), 2.0), 1e4)
        options = ["--vary", _finer(each, factor)]
    elif columns < more <= MOST_RUNS:
        runs = min(math.ceil(more), _MOST_PHASES)
        options = ["--seeds" if study.varied.seeds else "--phases", str(runs)]
        if more > _MOST_PHASES:
            said += f"Runs {math.ceil(more / _MOST_PHASES)} times longer would narrow it. "
    elif not worst.repeats and verdict.kind == "noise":
        options = ["--seeds", str(max(2 * columns, 8))]
    else:
        options = ["--vary", _finer(each, _FINER)]
    given = study.varied.ladder
    if "--vary" not in options and study.own_step is None:
        ends = f"{given.name}={given.text(given.coarse)}:{given.text(given.fine)}:{given.rungs}"
        options = ["--vary", ends, *options]
    return f"{said}To find one, run: {shlex.join([*study.command, *options])}"


def _finer(each: ScriptLadder, factor: float) -> str:
    """Return a ladder that begins where this one ends."""
    ladder, finest = each.ladder, float(each.values[-1])
    fine = finest / factor if ladder.fine < ladder.coarse else finest * factor
    value = float(round(fine)) if ladder.counts else float(f"{fine:.2g}")
    return f"{ladder.name}={ladder.text(finest)}:{ladder.text(value)}:{_RUNGS}"


def _of_constants(study: "ScriptStudy", each: ScriptLadder, numbers: list[NumberLadder]) -> str:
    value = float(numbers[0].results.flat[0])
    names = ", ".join(short_name(number) for number in numbers)
    ends = (
        f"{each.ladder.text(float(each.values[0]))} to {each.ladder.text(float(each.values[-1]))}"
    )
    same = f"{names} is {value:g}" if len(numbers) == 1 else f"{names} are the same"
    time = "" if each.ends is None else f" in this time of {each.ends[1]:.4g}"
    return (
        f"The {each.ladder.name} makes no difference: {same} in all runs, from {ends}. Either any "
        f"of these values will do, or nothing happens{time}: then run the script longer."
    )


def _excess(each: ScriptLadder, number: NumberLadder, own: float | None) -> float:
    """Return the error of a number over its tolerance, at the script's own value."""
    at_own = math.inf if own is None else promised_at(each, number, own)
    error = at_own if math.isfinite(at_own) else float(number.verdict.promised[-1])
    return error / (number.tolerance or 1e-300)


def _tolerance(study: "ScriptStudy", number: NumberLadder) -> str:
    if study.tolerance is not None:
        return f"{number.tolerance:.2g} asked"
    return f"{number.tolerance:.2g} wanted, {number.tolerance_reason.partition(';')[0]}"


def _all_of(numbers: list[NumberLadder]) -> str:
    if len(numbers) == 1:
        return short_name(numbers[0])
    return f"all {len(numbers)} quantities"


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
