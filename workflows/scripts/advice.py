"""Find the cheapest value of a setting for one quantity, and the number of runs to average."""

import math
from dataclasses import dataclass

import numpy as np

from chaincor.analysis.ladders.verdict import SCATTER_RESERVE, LadderVerdict
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.scripts.varied import Ladder

# Advice never averages more runs than this.
MOST_RUNS = 10_000
_AIM = 0.5


@dataclass(frozen=True)
class ScriptAdvice:
    """Advice on how one quantity meets its tolerance."""

    value: float  #: Advised value of the varied setting.
    runs: int  #: Number of runs to average.
    #: Largest error of the advised mean; None if the value was not tried.
    promised_error: float | None
    seconds: float  #: Processor time of all these runs.
    #: Whether the value lies within the range of tried values. Advice beyond this range is
    #: extrapolated with the convergence order.
    tried: bool


def runs_to_average(verdict: LadderVerdict, tolerance: float) -> list[int | None]:
    """Return, for each rung, how many runs to average to meet a tolerance; None if too many."""
    bias = np.maximum.accumulate(verdict.bias[::-1])[::-1]
    found: list[int | None] = []
    for promised, error, scatter in zip(verdict.promised, bias, verdict.scatter, strict=True):
        runs = None
        if promised <= tolerance:
            runs = 1
        elif error < tolerance:
            runs = math.ceil((SCATTER_RESERVE * scatter / (tolerance - error)) ** 2)
        found.append(runs if runs is not None and runs <= MOST_RUNS else None)
    return found


def largest_value(
    ladder: Ladder, values: Array, verdict: LadderVerdict, tolerance: float
) -> float | None:
    """Return the coarsest value at which one run meets a tolerance; None if there is none."""
    promised = verdict.promised
    good = np.flatnonzero(promised <= tolerance)
    if not len(good):
        return None
    k = int(good[0])
    if k == 0 or verdict.kind == "noise":
        return float(values[k])
    return _value_between(ladder, values[k - 1 : k + 1], promised[k - 1 : k + 1], tolerance)


def advise_value(
    ladder: Ladder,
    values: Array,
    verdict: LadderVerdict,
    seconds: Array,
    tolerance: float,
    *,
    repeats: bool,
) -> ScriptAdvice | None:
    """
    Return the cheapest way to meet a tolerance; None if the runs show none.

    `values` are the tried values, from coarse to fine, without those at which runs failed.
    `seconds` is the processor time of one run at each value. If `repeats` is true, the advice may
    be to average several runs, at nearby values or with other seeds.
    """
    # A run at a coarser value never costs more than a run at a finer value. If its measured time is
    # longer, the machine was busy.
    seconds = np.minimum.accumulate(seconds[::-1])[::-1]
    promised = verdict.promised
    bias = np.maximum.accumulate(verdict.bias[::-1])[::-1]
    found: dict[int, ScriptAdvice] = {}
    for k, runs in enumerate(runs_to_average(verdict, tolerance)):
        if runs is None or (runs > 1 and not repeats):
            continue
        scatter = SCATTER_RESERVE * float(verdict.scatter[k])
        kept = float(promised[k] if runs == 1 else bias[k] + scatter / math.sqrt(runs))
        found[k] = ScriptAdvice(float(values[k]), runs, kept, runs * float(seconds[k]), True)
    if not found:
        return _beyond(ladder, float(values[-1]), verdict, float(seconds[-1]), tolerance)
    k = min(found, key=lambda each: found[each].seconds)
    if found[k].runs == 1 and k > 0 and verdict.kind != "noise" and promised[k - 1] > tolerance:
        pair = slice(k - 1, k + 1)
        return _between(ladder, values[pair], seconds[pair], promised[pair], tolerance)
    return found[k]


def _between(
    ladder: Ladder, values: Array, seconds: Array, promised: Array, tolerance: float
) -> ScriptAdvice:
    """Advise a value between two rungs, of which only the finer one meets the tolerance."""
    coarse, fine = map(float, values)
    span = math.log(float(promised[0] / promised[1]))
    value = _value_between(ladder, values, promised, tolerance)
    share = math.log(value / fine) / math.log(coarse / fine)
    cost = float(seconds[1] * (seconds[0] / seconds[1]) ** share)
    return ScriptAdvice(value, 1, float(promised[1] * math.exp(share * span)), cost, True)


def _value_between(ladder: Ladder, values: Array, promised: Array, tolerance: float) -> float:
    """Return the coarsest value between two rungs that meets a tolerance, rounded."""
    coarse, fine = map(float, values)
    span = math.log(float(promised[0] / promised[1])) if np.isfinite(promised[0]) else 0.0
    share = math.log(tolerance / float(promised[1])) / span if span > 0.0 else 0.0
    value = round_towards(fine * (coarse / fine) ** share, fine)
    if ladder.counts:
        value = float(math.ceil(value) if ladder.fine > ladder.coarse else math.floor(value))
    return value


def _beyond(
    ladder: Ladder, finest: float, verdict: LadderVerdict, seconds: float, tolerance: float
) -> ScriptAdvice | None:
    """Extrapolate with the convergence order to a value finer than all rungs, without a bound."""
    promised = float(verdict.promised[-1])
    if verdict.order is None or not math.isfinite(promised):
        return None
    factor = (_AIM * tolerance / promised) ** (1.0 / verdict.order)
    shrinks = ladder.fine < ladder.coarse
    value = finest * factor if shrinks else finest / factor
    value = round_towards(value, 0.0 if shrinks else math.inf)
    if ladder.counts:
        value = float(max(round(value), 1))
    return ScriptAdvice(value, 1, None, seconds / factor, False)


def round_towards(value: float, fine: float) -> float:
    """Round a value to two digits, in the direction of `fine` but not beyond it."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    if fine < value:
        return float(f"{max(math.floor(value / unit) * unit, fine):.6g}")
    return float(f"{min(math.ceil(value / unit) * unit, fine):.6g}")
