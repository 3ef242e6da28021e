"""Choose one value of the varied setting for all quantities, and judge the script's own value."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.ladders.verdict import SCATTER_RESERVE
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.scripts.advice import largest_value, runs_to_average
from chaincor.workflows.scripts.ladder_runs import NumberLadder, ScriptLadder

# Possible states of a quantity at the script's own value. "small enough": one run meets the
# tolerance. "too noisy": only a mean of several runs meets the tolerance. "too large": not even a
# mean meets the tolerance. "beyond": no tried value meets the tolerance, and the runs show the
# error. "not judged": the scatter between the runs hides the error. "constant": all runs give the
# same result.
AnswerState = Literal["small enough", "too noisy", "too large", "beyond", "not judged", "constant"]
# A value that is coarser than the advised value is mentioned only if it is larger by this factor.
_COARSER = 1.1
# The step causes the scatter if the scatter shrinks from coarse to fine steps by more than the
# factor _SHRINKS. A finer step is needed if the step causes an error above _STEP_PART times the
# tolerance.
_SHRINKS, _STEP_PART = 2.0, 0.5
# An answer never averages more runs than this.
_MOST_RUNS = 100


@dataclass(frozen=True)
class Choice:
    """A value of the varied quantity that meets all tolerances."""

    value: float
    runs: int  #: Number of runs to average.
    decides: NumberLadder  #: Quantity that needs the finest value, or the most runs.


@dataclass(frozen=True)
class NumberAnswer:
    """Judgement of one quantity."""

    number: NumberLadder
    #: State at the script's own value, or at the finest value if the script's own is unknown.
    state: AnswerState
    error: float  #: Largest error of one run at the value of `state`; inf if unknown.
    runs: (
        int | None
    )  #: Number of runs whose mean meets the tolerance at the value of `state`; None if too many.
    largest: float | None  #: Coarsest value at which one run meets the tolerance.
    reached: bool  #: Whether one run or a mean meets the tolerance at some value.


@dataclass(frozen=True)
class LadderAnswer:
    """Judgement of all quantities."""

    numbers: tuple[NumberAnswer, ...]
    own: float | None  #: The script's own value of the varied setting, if it is known.
    own_fails: bool  #: Whether runs fail at that value or near it.
    single: Choice | None  #: Coarsest value at which one run meets all tolerances.
    several: Choice | None  #: Cheapest mean of several runs that meets all tolerances.
    #: Advised choice: the script's own value if it is small enough, otherwise `single` or
    #: `several`.
    use: Choice | None

    @property
    def all_constant(self) -> bool:
        """Whether no quantity differs between the runs. The study then tested nothing."""
        return all(a.state == "constant" for a in self.numbers)

    @property
    def keeps_own(self) -> bool:
        """Whether the script's own value is small enough."""
        return self.use is not None and self.use.value == self.own

    @property
    def coarser(self) -> Choice | None:
        """
        Coarser value at which one run meets all tolerances.

        The result is None if the value is hardly coarser than the script's own.
        """
        if self.use is None or self.single is None or self.use.runs > 1:
            return None
        return self.single if self.single.value > _COARSER * self.use.value else None

    @property
    def judged(self) -> list[NumberAnswer]:
        """Answers for the quantities that meet their tolerance at some tried value."""
        return [a for a in self.numbers if a.reached]

    def in_state(self, *states: AnswerState) -> list[NumberAnswer]:
        """Return the answers that are in one of the given states."""
        return [each for each in self.numbers if each.state in states]


def answer_ladder(
    each: ScriptLadder, own: float | None, crashed: Iterable[float] = ()
) -> LadderAnswer:
    """
    Return the judgement of all quantities of a ladder.

    `own` is the script's own value of the varied setting, and `crashed` are the values at which
    runs failed. The advised value is finer than all values in `crashed`.
    """
    steps = np.array([each.ladder.step(x) for x in each.values])
    failed = [each.ladder.step(x) for x in crashed]
    safe = steps < min(failed, default=math.inf)
    own_step = None if own is None else each.ladder.step(own)
    own_fails = own_step is not None and own_step >= min(failed, default=math.inf)
    at = float(steps[-1]) if own_step is None else own_step
    outside = own_fails or at > float(steps[0]) * (1.0 + 1e-9)
    found = tuple(_answer(each, number, at, outside) for number in each.numbers)
    judged = [a for a in found if a.reached]
    for a in found:
        if not a.reached and a.number.tolerance is not None:
            safe &= _unseen(a.number, a.number.tolerance)
    if not judged or any(a.state == "beyond" for a in found):
        return LadderAnswer(found, own, own_fails, None, None, None)
    single = _single(each, judged, steps, safe)
    several = _several(each, judged, safe)
    use = single or several
    if own is not None and all(a.state in ("small enough", "too noisy") for a in judged):
        seen = own_fails or any(a.state == "too large" for a in found)
        most = max(judged, key=lambda a: (a.runs or 0, _part(a)))
        use = use if seen else Choice(own, most.runs or 1, most.number)
    return LadderAnswer(found, own, own_fails, single, several, use)


def promised_at(each: ScriptLadder, number: NumberLadder, step: float) -> float:
    """Return the largest error of one run at a step; inf for steps coarser than all tried ones."""
    steps = np.array([each.ladder.step(x) for x in each.values])
    return _between(steps, number.verdict.promised, step)


def needs_finer(number: NumberLadder) -> bool:
    """Return whether finer values, instead of longer runs, would make the error small enough."""
    verdict, tolerance = number.verdict, number.tolerance or 0.0
    if verdict.kind == "regular" and verdict.value is not None:
        left = abs(float(number.results[-1].mean()) - verdict.value)
        return left > _STEP_PART * tolerance
    if verdict.kind == "bounded":
        scatter = verdict.scatter
        shrinks = float(np.median(scatter[:2])) > _SHRINKS * float(np.median(scatter[-2:]))
        return shrinks or SCATTER_RESERVE * float(scatter[-1]) < _STEP_PART * tolerance
    return verdict.kind == "irregular"


def _answer(each: ScriptLadder, number: NumberLadder, at: float, outside: bool) -> NumberAnswer:
    """Judge one quantity; `outside` means that the script's own value lies outside the ladder."""
    tolerance = number.tolerance
    if tolerance is None:
        known = number.verdict.kind == "cannot tell"
        state: AnswerState = "constant" if known else "not judged"
        return NumberAnswer(number, state, math.inf, None, None, False)
    steps = np.array([each.ladder.step(x) for x in each.values])
    error = math.inf if outside else promised_at(each, number, at)
    largest = largest_value(each.ladder, each.values, number.verdict, tolerance)
    runs = None if outside else _runs_at(steps, number, at, tolerance)
    reached = [n is not None for n in _runs_of(number)]
    state = "too large"
    if runs == 1:
        state = "small enough"
    elif runs is not None:
        state = "too noisy"
    elif not any(reached):
        seen = outside or not _unseen(number, tolerance)[_rung(steps, at)]
        known = number.verdict.kind in ("regular", "irregular") and needs_finer(number)
        state = "beyond" if known or seen else "not judged"
    return NumberAnswer(number, state, error, runs, largest, any(reached))


def _runs_of(number: NumberLadder) -> list[int | None]:
    """Return the number of runs on each rung whose mean meets the tolerance; None if too many."""
    most = _MOST_RUNS if number.repeats else 1
    runs = runs_to_average(number.verdict, number.tolerance or 0.0)
    return [n if n is not None and n <= most else None for n in runs]


def _runs_at(steps: Array, number: NumberLadder, at: float, tolerance: float) -> int | None:
    """Return the number of runs at a step whose mean meets a tolerance; None if too many."""
    verdict = number.verdict
    if _between(steps, verdict.promised, at) <= tolerance:
        return 1
    bias = _between(steps, np.maximum.accumulate(verdict.bias[::-1])[::-1], at)
    if not number.repeats or bias >= tolerance:
        return None
    scatter = _between(steps, verdict.scatter, at)
    runs = math.ceil((SCATTER_RESERVE * scatter / (tolerance - bias)) ** 2)
    return max(runs, 2) if runs <= _MOST_RUNS else None


def _between(steps: Array, errors: Array, at: float) -> float:
    """Interpolate errors logarithmically between rungs; inf for steps coarser than all rungs."""
    if at > steps[0] * (1.0 + 1e-9) or not np.all(np.isfinite(errors)):
        return math.inf
    tiny = np.maximum(errors[::-1], 1e-300)
    return float(math.exp(np.interp(math.log(at), np.log(steps[::-1]), np.log(tiny))))


def _rung(steps: Array, at: float) -> int:
    return int(np.argmin(np.abs(np.log(steps / at))))


def _unseen(number: NumberLadder, tolerance: float) -> NDArray[np.bool_]:
    """Mark each rung if neither this rung nor a finer one surely exceeds the tolerance."""
    verdict, means = number.verdict, number.results.mean(axis=1)
    best = float(means[-1]) if verdict.value is None else verdict.value
    error = (verdict.value_error or 0.0) + 2.0 * verdict.scatter / math.sqrt(
        number.results.shape[1]
    )
    seen = np.abs(means - best) - error > tolerance
    return ~np.logical_or.accumulate(seen[::-1])[::-1]


def _single(
    each: ScriptLadder, judged: list[NumberAnswer], steps: Array, safe: NDArray[np.bool_]
) -> Choice | None:
    """Return the coarsest value without failed runs at which one run meets all tolerances."""
    if any(a.largest is None for a in judged) or not np.any(safe):
        return None
    coarsest = float(each.values[int(np.flatnonzero(safe)[0])])
    values = [a.largest for a in judged if a.largest is not None]
    finest = min(range(len(values)), key=lambda k: (each.ladder.step(values[k]), -_part(judged[k])))
    value = values[finest]
    if each.ladder.step(value) > each.ladder.step(coarsest):
        value = coarsest
    return Choice(value, 1, judged[finest].number)


def _several(
    each: ScriptLadder, judged: list[NumberAnswer], safe: NDArray[np.bool_]
) -> Choice | None:
    """Return the cheapest mean of several runs that meets all tolerances."""
    costs = np.minimum.accumulate(each.seconds[::-1])[::-1]
    wanted = [_runs_of(a.number) for a in judged]
    means: list[tuple[float, Choice]] = []
    for k in np.flatnonzero(safe):
        runs = [row[k] for row in wanted]
        if all(n is not None for n in runs):
            most = max(range(len(runs)), key=lambda j: runs[j] or 0)
            choice = Choice(float(each.values[k]), runs[most] or 1, judged[most].number)
            means.append((choice.runs * float(costs[k]), choice))
    best = min(means, key=lambda pair: pair[0])[1] if means else None
    return None if best is None or best.runs == 1 else best


def _part(answer: NumberAnswer) -> float:
    """Return the error in units of the tolerance."""
    return answer.error / (answer.number.tolerance or 1e-300)
