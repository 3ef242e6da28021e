"""Regular, irregular or noise: what the error of a number is like along a ladder of steps."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from chaincor.analysis.ladders.means import judge_means
from chaincor.analysis.ladders.order_fit import OrderFit
from chaincor.analysis.ladders.scatter import (
    bias_is_seen,
    decay_of_scatter,
    scatter_about_law,
    smooth_scatter,
    spread_of_rungs,
)
from chaincor.lammps_inputs.arrays import Array

Kind = Literal["regular", "irregular", "noise", "bounded", "cannot tell"]

LEAST_RUNGS, LEAST_COLUMNS = 4, 3
# An order is known when 1 and 2 cannot be taken for each other.
KNOWN_ORDER = 0.5
# Scatter beside a smooth error does not matter below this share of what the error changes by to
# the next rung, on half of the rungs.
ROUGH = 0.5
# Scatter that shrinks slower than this power of the step is not taken for an error of the step,
# nor faster for noise.
LEAST_DECAY = 0.5
# Values of one rung are this many standard deviations from their mean at most, in the promise.
SCATTER_RESERVE = 3.0
_ROUNDING = 4e-15


@dataclass(frozen=True)
class LadderVerdict:
    """What a ladder says of an error."""

    #: ``regular``: a smooth power of the step, so that the value can be extrapolated.
    #: ``irregular``: it jumps about between nearby steps, and shrinks with the step. ``noise``: it
    #: jumps about and the step has no part in it. ``bounded``: none of these is sure, and means
    #: bound the error without an order. ``cannot tell``: the number is the same everywhere.
    kind: Kind
    reason: str  #: Why, in one sentence.
    #: Power of the step: of the smooth error, or of the scatter where that is irregular; with what
    #: it holds within in 95 of 100 cases. None for noise, and where it cannot be told.
    order: float | None
    order_error: float | None  #: See ``order``.
    #: The best value and its error, likewise: extrapolated, of the finest rungs, or the mean of all
    #: runs. None where it cannot be told.
    value: float | None
    value_error: float | None  #: See ``value``.
    #: Bound on the systematic error of each rung, the error of `value` included; of shape (R,).
    bias: Array
    scatter: Array  #: Standard deviation of one run, by rung; of shape (R,).
    fit: OrderFit | None = None  #: The law of a regular error.


def judge_ladder(
    steps: Array, values: Array, *, resolution: float = 0.0, seeded: bool = False
) -> LadderVerdict:
    """
    Say what the error of a number is like, and why.

    `steps` and `values`, of shape (R, M), are rung by rung from coarse to fine, the M steps of a
    rung all a little different; `resolution` is the unit of the last digit that the number is given
    with. `seeded` says that a column has one seed throughout: then seeds may differ by more than
    the step changes, and each is compared with itself. Raises ValueError for fewer rungs or runs
    than LEAST_RUNGS and LEAST_COLUMNS.
    """
    rungs, columns = values.shape
    if rungs < LEAST_RUNGS or columns < LEAST_COLUMNS:
        raise ValueError(
            f"a ladder of {rungs} rungs with {columns} runs; expected {LEAST_RUNGS} and "
            f"{LEAST_COLUMNS} at least"
        )
    h = steps / steps.max()
    floor = resolution / np.sqrt(12.0) + _ROUNDING * float(np.max(np.abs(values)))
    scatter = np.hypot(spread_of_rungs(h, values, resolution), floor)
    if np.ptp(values) <= resolution:
        return LadderVerdict(
            "cannot tell",
            "the number has the same digits in all runs: nothing tells what finer steps would "
            "change",
            *(None, None, None, None),
            np.full(rungs, np.inf),
            scatter,
        )
    rough, fit = scatter_about_law(h, values, floor, seeded)
    decay, decay_error = decay_of_scatter(h.mean(axis=1), rough, columns, floor)
    change = np.abs(np.diff(fit.bias(h.mean(axis=1))))
    is_rough = bool(np.median(rough[:-1] - ROUGH * change) > 2.0 * floor)
    known = fit.order_error < KNOWN_ORDER
    if is_rough and decay - decay_error > LEAST_DECAY:
        return _irregular(h, values, scatter, decay, decay_error)
    biased = bias_is_seen(h, values)
    if known and biased:
        error = fit.limit_error
        bias = np.abs(values.mean(axis=1) - fit.limit) + error
        reason = f"a smooth power of the step describes the {fit.rungs} finest rungs"
        if is_rough:
            reason += ", beside scatter that the step does not change"
        return LadderVerdict(
            "regular", reason, fit.order, fit.order_error, fit.limit, error, bias, scatter, fit
        )
    if is_rough and decay + decay_error < LEAST_DECAY and not biased:
        return _noise(h, values, scatter, seeded)
    return _bounded(_why_not(is_rough, biased, decay, decay_error, fit), h, values, scatter)


def _irregular(
    h: Array, values: Array, scatter: Array, decay: float, decay_error: float
) -> LadderVerdict:
    reason = "between nearby steps the number jumps about, by less the finer the steps are"
    if decay_error >= KNOWN_ORDER:
        return _bounded(f"{reason}, but how fast that falls is not clear", h, values, scatter)
    # Neither the mean of a rung nor that of the finest one need be nearer than a single run.
    mean = values.mean(axis=1)
    value, error = float(mean[-1]), float(SCATTER_RESERVE * scatter[-1])
    bias = np.abs(mean - value) + error
    return LadderVerdict("irregular", reason, decay, decay_error, value, error, bias, scatter)


def _noise(h: Array, values: Array, scatter: Array, seeded: bool) -> LadderVerdict:
    """The mean of all runs, and the largest bias of order 1 or more that noise may hide."""
    from scipy.stats import t

    rungs, columns = values.shape
    value = float(values.mean())
    means = values.mean(axis=0) if seeded else values.ravel()
    error = float(t.ppf(0.975, len(means) - 1) * means.std(ddof=1) / np.sqrt(len(means)))
    x = h.mean(axis=1) - h.mean()
    slopes = x @ (values - values.mean(axis=0)) / float(x @ x)
    level = float(slopes.mean())
    rest = values - values.mean(axis=0) - x[:, None] * level
    freedom = (rungs - 1) * columns - 1
    spread = np.sqrt(float(np.sum(rest**2)) / freedom / float(x @ x) / columns)
    hidden = abs(level) + float(t.ppf(0.975, freedom)) * spread
    bias = hidden * h.mean(axis=1) + error
    # The mean of all runs may hide as much of it, on an average over rungs.
    error = float(np.hypot(error, hidden * h.mean()))
    reason = "runs scatter, the step changes neither how much nor the mean"
    return LadderVerdict("noise", reason, None, None, value, error, bias, scatter)


def _bounded(reason: str, h: Array, values: Array, scatter: Array) -> LadderVerdict:
    """What means say where there is no order, with a scatter that all rungs tell together."""
    means = judge_means(h, values, smooth_scatter(h, scatter))
    reason += "; means bound the error"
    return LadderVerdict(
        "bounded", reason, None, None, means.value, means.value_error, means.bias, scatter
    )


def _why_not(is_rough: bool, biased: bool, decay: float, decay_error: float, fit: OrderFit) -> str:
    if not is_rough:
        return (
            "the number changes smoothly, but not as one power of the step"
            if biased
            else "the number hardly changes along the ladder"
        ) + "; a longer ladder may tell"
    if biased:
        return (
            "runs scatter, and the step changes their mean, but the order is anything from "
            f"{max(fit.order - fit.order_error, 0.0):.2g} to {fit.order + fit.order_error:.2g}; "
            "more runs a rung may tell"
        )
    return (
        "runs scatter, and whether that shrinks with the step is not clear (power "
        f"{decay:.2g} +- {decay_error:.2g}); a longer ladder or more runs a rung may tell"
    )
