"""
Classify how a quantity depends on the time step: regular, irregular or noise.

The package defines ladders and rungs.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from chaincor.analysis.ladders.order_fit import SURE, OrderFit, fit_order, judge_means
from chaincor.lammps_inputs.arrays import Array

VerdictKind = Literal["regular", "irregular", "noise", "bounded", "cannot tell"]

LEAST_RUNGS, LEAST_COLUMNS = 4, 3
# An order is known if its error bar is shorter than this, because orders 1 and 2 are then distinct.
KNOWN_ORDER = 0.5
# Scatter is negligible if, on at least half of the rungs, it is below this fraction of the change
# of the smooth error from one rung to the next.
ROUGH = 0.5
# Scatter is attributed to the time step only if it decreases at least as fast as this power of the
# time step. Scatter that decreases more slowly may be noise.
LEAST_DECAY = 0.5
# The promised error assumes that no run differs from the mean of its rung by more than this many
# standard deviations.
SCATTER_RESERVE = 3.0
_ROUNDING = 4e-15
# Significance of statistical tests: chance alone causes a positive result in 1 of 100 ladders.
_CHANCE = 0.01


@dataclass(frozen=True)
class LadderVerdict:
    """Classification of the error of a quantity along a ladder."""

    #: ``regular``: the error is a smooth power of the time step, and the quantity can be
    #: extrapolated. ``irregular``: the error changes at random between nearby time steps, and
    #: decreases with the time step. ``noise``: the quantity changes at random, and the time step
    #: has no effect. ``bounded``: none of these is certain, and the means of rungs bound the error
    #: without an order. ``cannot tell``: the quantity is the same at every time step.
    kind: VerdictKind
    reason: str  #: Reason for the verdict, in one sentence.
    #: Power of the time step with which the smooth error, or the scatter of an irregular error,
    #: decreases. The order is None for noise, or if it is unknown.
    order: float | None
    #: Error bar of the order, valid in 95 of 100 cases; None without an order.
    order_error: float | None
    #: Best estimate of the quantity: extrapolated, from the finest rungs, or the mean of all runs;
    #: None without an estimate.
    value: float | None
    #: Error bar of `value`, valid in 95 of 100 cases; None without an estimate.
    value_error: float | None
    #: Bound on the systematic error of each rung, including the error of `value`; of shape (R,).
    bias: Array
    scatter: Array  #: Standard deviation of one run, by rung; of shape (R,).
    fit: OrderFit | None = None  #: Fitted law of a regular error.

    @property
    def promised(self) -> Array:
        """
        Bound on the error of a single run on each rung, of shape (R,).

        The error is the difference from the limit of small time steps. It is bounded by the bound
        on the bias plus three standard deviations of single runs. The bound is never smaller than
        that of a finer rung, because an error may vanish by chance at one time step. An unknown
        bound is inf.
        """
        errors = self.bias + SCATTER_RESERVE * self.scatter
        return np.maximum.accumulate(errors[::-1])[::-1]


def judge_ladder(
    steps: Array, values: Array, *, resolution: float = 0.0, seeded: bool = False
) -> LadderVerdict:
    """
    Classify the error of a quantity, and give the reason.

    `steps` and `values` have the shape (R, M): M runs on each of R rungs, from coarse to fine. A
    rung is a row of M runs, whose time steps differ slightly. `resolution` is the unit of the last
    printed digit. With `seeded`, all runs in a column have the same seed. Results may then differ
    more between seeds than between time steps, and runs are compared only with runs that have the
    same seed. Raises ValueError for fewer than LEAST_RUNGS rungs or LEAST_COLUMNS runs per rung.
    """
    rungs, columns = values.shape
    if rungs < LEAST_RUNGS or columns < LEAST_COLUMNS:
        raise ValueError(
            f"a ladder of {rungs} rungs with {columns} runs. Give at least {LEAST_RUNGS} "
            f"rungs and {LEAST_COLUMNS} runs"
        )
    h = steps / steps.max()
    floor = resolution / np.sqrt(12.0) + _ROUNDING * float(np.max(np.abs(values)))
    scatter = np.hypot(_spread_of_rungs(h, values, resolution), floor)
    if np.ptp(values) <= resolution:
        return LadderVerdict(
            "cannot tell",
            "the result has the same digits in all runs, so the effect of finer steps is unknown",
            *(None, None, None, None),
            np.full(rungs, np.inf),
            scatter,
        )
    rough, fit = _scatter_about_law(h, values, floor, seeded)
    decay, decay_error = _decay_of_scatter(h.mean(axis=1), rough, columns, floor)
    change = np.abs(np.diff(fit.bias(h.mean(axis=1))))
    is_rough = bool(np.median(rough[:-1] - ROUGH * change) > 2.0 * floor)
    known = fit.order_error < KNOWN_ORDER
    if is_rough and decay - decay_error > LEAST_DECAY:
        return _irregular(h, values, scatter, decay, decay_error)
    biased = _bias_is_seen(h, values)
    if known and biased:
        error = fit.limit_error
        bias = np.abs(values.mean(axis=1) - fit.limit) + error
        reason = f"the error is a smooth power of the step at the {fit.rungs} finest steps"
        if is_rough:
            reason += ", beside scatter that the step does not change"
        return LadderVerdict(
            "regular", reason, fit.order, fit.order_error, fit.limit, error, bias, scatter, fit
        )
    if is_rough and decay + decay_error < LEAST_DECAY and not biased:
        return _noise(h, values, scatter, seeded)
    return _bounded(_why_not(is_rough, biased, fit), h, values, scatter)


def _irregular(
    h: Array, values: Array, scatter: Array, decay: float, decay_error: float
) -> LadderVerdict:
    reason = "the result jumps between nearby steps, and the jumps shrink with the step"
    if decay_error >= KNOWN_ORDER:
        return _bounded(f"{reason}, but the order of this decrease is unclear", h, values, scatter)
    # The mean of a rung may be as far from the true value as a single run.
    mean = values.mean(axis=1)
    value, error = float(mean[-1]), float(SCATTER_RESERVE * scatter[-1])
    bias = np.abs(mean - value) + error
    return LadderVerdict("irregular", reason, decay, decay_error, value, error, bias, scatter)


def _noise(h: Array, values: Array, scatter: Array, seeded: bool) -> LadderVerdict:
    """Return the mean of all runs, and the largest bias of order 1 or more that noise may hide."""
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
    # The mean of all runs may contain the mean of the hidden biases of all rungs.
    error = float(np.hypot(error, hidden * h.mean()))
    reason = "runs scatter, and the step changes neither their scatter nor their mean"
    return LadderVerdict("noise", reason, None, None, value, error, bias, scatter)


def _bounded(reason: str, h: Array, values: Array, scatter: Array) -> LadderVerdict:
    """Return the verdict ``bounded``, from the means of rungs and their smoothed scatter."""
    means = judge_means(h, values, _smooth_scatter(h, scatter))
    reason += "; the bound comes from the means of the runs"
    return LadderVerdict("bounded", reason, None, None, *means, scatter)


def _why_not(is_rough: bool, biased: bool, fit: OrderFit) -> str:
    if not is_rough:
        return (
            "the result changes smoothly, but not as one power of the step"
            if biased
            else "the result hardly changes from the coarsest to the finest step"
        ) + "; more steps may show it"
    if biased:
        return (
            "runs scatter, and the step changes their mean, but the order is anything from "
            f"{max(fit.order - fit.order_error, 0.0):.2g} to {fit.order + fit.order_error:.2g}; "
            "more runs at each step may show it"
        )
    return (
        "the scatter between runs hides any effect of the step; smaller steps or more runs at "
        "each may show it"
    )


def _smooth_scatter(h: Array, scatter: Array) -> Array:
    """
    Return the scatter of each rung, averaged with a power law fitted to all rungs.

    The scatter of a single rung is uncertain.
    """
    x, y = np.log(h.mean(axis=1)), np.log(scatter)
    return np.exp(0.5 * (y + np.polyval(np.polyfit(x, y, 1), x)))


def _spread_of_rungs(h: Array, values: Array, resolution: float) -> Array:
    """
    Return the standard deviation of each rung.

    If all runs of a rung agree in all digits, they had the same number of steps and show no
    scatter. The scatter of this rung is then interpolated between other rungs.
    """
    spread = values.std(axis=1, ddof=1)
    resolved = np.ptp(values, axis=1) > 0.0
    if resolution > 0.0 or not np.any(resolved):
        return spread
    x = -np.log(h.mean(axis=1))
    return np.where(resolved, spread, np.exp(np.interp(x, x[resolved], np.log(spread[resolved]))))


def _scatter_about_law(
    h: Array, values: Array, floor: float, seeded: bool
) -> tuple[Array, OrderFit]:
    """Find a smooth law by iteration; return the scatter of each rung about it, and the law."""
    rough = np.hypot(values.std(axis=1, ddof=1), floor)
    fit = fit_order(h, values, rough)
    for _ in range(3):
        rest = (values - fit.slope * h**fit.order).std(axis=1, ddof=1)
        rough = _seeds_apart(h, values, fit.order, rest) if seeded else rest
        rough = np.hypot(rough, floor)
        fit = fit_order(h, values, _smooth_scatter(h, rough))
    return rough, fit


def _seeds_apart(h: Array, values: Array, p: float, rough: Array) -> Array:
    """
    Return the scatter about A + B h^p; if seeds differ, each seed has its own A and B.

    An F test decides whether seeds differ. `rough` is the scatter about a common law.
    """
    from scipy.stats import f

    rungs, columns = values.shape
    # The test assumes the same scatter on all rungs, because it sums squares over all rungs.
    squares = np.zeros(rungs)
    for k in range(columns):
        design = np.stack([np.ones(rungs), h[:, k] ** p], axis=1)
        q, _ = np.linalg.qr(design)
        rest = values[:, k] - q @ (q.T @ values[:, k])
        squares += rest**2 / np.maximum(1.0 - np.sum(q**2, axis=1), 0.1)
    apart = np.sqrt(squares / columns)
    common, own = float(np.sum(rough**2)), float(np.sum(apart**2))
    # Degrees of freedom: a law for all seeds has one mean per rung, and separate laws have two
    # parameters per seed.
    freedom = rungs * (columns - 1), (rungs - 2) * columns
    return apart if common / max(own, 1e-300) > f.ppf(1.0 - _CHANCE, *freedom) else rough


def _decay_of_scatter(h: Array, rough: Array, columns: int, floor: float) -> tuple[float, float]:
    """Return the power of the time step with which scatter decreases, and its 95 % error."""
    from scipy.special import polygamma

    seen = rough > 2.0 * floor
    if seen.sum() < LEAST_RUNGS:
        return 0.0, np.inf
    x, y = np.log(h[seen]), np.log(rough[seen])
    slope, level = np.polyfit(x, y, 1)
    rest = y - slope * x - level
    # Variance of the logarithm of a standard deviation from M Gaussian values. If the rungs deviate
    # more from the fit, the variance of their deviations is used.
    expected = float(polygamma(1, 0.5 * (columns - 1))) / 4.0
    variance = max(expected, float(rest @ rest) / (len(x) - 2))
    return float(slope), SURE * float(np.sqrt(variance / np.sum((x - x.mean()) ** 2)))


def _bias_is_seen(h: Array, values: Array) -> bool:
    """
    Test whether the mean changes along the ladder by more than chance explains.

    The test looks for a change proportional to h^1.5, which is between orders 1 and 2. Each column
    is compared only with itself, so that differences between seeds do not hide the change.
    """
    from scipy.stats import t

    rungs, columns = values.shape
    shape = h.mean(axis=1) ** 1.5
    shape = shape - shape.mean()
    rest = values - values.mean(axis=0) - values.mean(axis=1, keepdims=True) + values.mean()
    freedom = (rungs - 1) * (columns - 1)
    variance = float(np.sum(rest**2)) / freedom
    if variance == 0.0:
        return True
    contrast = float(shape @ values.mean(axis=1))
    error = np.sqrt(variance * float(shape @ shape) / columns)
    return bool(abs(contrast) / error > t.ppf(1.0 - 0.5 * _CHANCE, freedom))
