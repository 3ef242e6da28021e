"""
Fit powers of the time step to a quantity, to find the order of its error or a bound of its error.

The package defines ladders and rungs.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array

# Range of fitted orders. No scheme converges faster in practice, and below 0.25 a quantity does not
# converge.
LEAST_ORDER, MOST_ORDER = 0.25, 9.0
_GRID = np.linspace(LEAST_ORDER, MOST_ORDER, 176)
# The grid of orders is refined this many times, to this many points between the two neighbours of
# the best order.
_REFINEMENTS, _FINER = 9, 11
# Smallest error bar of an order.
_LEAST_ERROR = 1e-3
# A Gaussian variable differs from its mean by at most this many standard deviations with a
# probability of 95 %. All error bars of this module have this probability.
SURE = 1.96
# Gaussian error bars are too short by a factor of 1.2, because weights come from few runs, and
# because one of several windows is chosen.
_WIDER = 1.2 * SURE
# The estimated effect of coarse rungs on a fit is multiplied by this safety factor. The estimate
# sums a geometric series, because the effect shrinks by a similar factor from window to window.
_RESERVE = 1.5
# Factor for the error bars of limits, because noise may hide deviations from the power law. With
# this factor, error bars contain the true value in 95 of 100 ladders of order 1
# (`benchmarks.bars.ladders`).
_HIDDEN = 1.5
# Weights assume that the scatter of each rung is at least this fraction of the range of values in
# the window. Otherwise the fit would follow the finest rungs too closely, and hide the effect of
# the coarsest rung.
_EVEN = 0.03
# Powers of the time step that may describe the bias. All powers that fit the means are used.
_ORDERS = (1.0, 1.5, 2.0, 3.0, 4.0)
# The steepest slope is taken from this many rungs. A power law must fit more rungs than this.
_LEAST_RUNGS = 3
# A power is rejected if noise alone would cause its misfit in at most 1 of 20 ladders.
_CHANCE = 0.05
# If no power fits, the steepest slope between the finest rungs is extrapolated to a time step of 0.
# The bias of the finest rung is at most this factor times the extrapolated change.
_NO_LAW = 2.0
# Windows and powers are chosen from the same data as the error bars, which would be too short if
# rungs have few runs. The first number multiplies the standard errors in the test that rejects
# powers. Error bars are multiplied by 1 plus the second number divided by the number of runs. Both
# numbers come from `benchmarks.bars.ladders` with 4 and 8 runs.
_CHOSEN, _FEW_RUNS = 1.2, 2.2


@dataclass(frozen=True)
class OrderFit:
    r"""Law :math:`y = A + B h^p`, fitted to the finest rungs of a ladder."""

    #: Order p; inf if the data do not determine it.
    order: float
    order_error: float  #: Error bar of p, valid in 95 of 100 cases.
    #: Limit A, which is y at h = 0.
    limit: float
    limit_error: float  #: Error bar of A, valid in 95 of 100 cases.
    slope: float  #: Factor B, for h in units of the largest time step.
    rungs: int  #: Number of finest rungs in the fit.

    def bias(self, steps: Array) -> Array:
        """Return B h^p; `steps` are in units of the largest time step."""
        return self.slope * steps**self.order


def fit_order(steps: Array, values: Array, errors: Array) -> OrderFit:
    r"""
    Fit order and limit to the finest rungs that a single power of h describes.

    Terms of higher order distort a fit to coarse rungs, and a fit to few rungs is uncertain. Each
    window of finest rungs is therefore fitted by weighted least squares, in which A and B are
    linear at each p. The error of a window is its statistical error combined with the effect of its
    coarsest rungs. The effect is found by omitting the k coarsest rungs. If p then changes by d
    beyond chance, the error of p is d/(1 - r^k) with the ratio r of neighbouring time steps. This
    estimate assumes that the next term is of relative order h, which is the least favourable order.
    The window whose limit has the smallest error is chosen.

    `steps`, in units of the largest time step, and `values` have the shape (R, M): M runs on each
    of R rungs, from coarse to fine. `errors`, of shape (R,), are the positive standard deviations
    of one value on each rung.
    """
    rungs = len(steps)
    ratio = float((steps[-1].mean() / steps[0].mean()) ** (1.0 / (rungs - 1)))
    windows = [_fit_window(steps[-w:], values[-w:], errors[-w:]) for w in range(3, rungs + 1)]
    found = []
    # If possible, a window is compared with at least two smaller windows, because a single one may
    # agree by chance.
    first = min(2, rungs - 3)
    for k, each in enumerate(windows[first:], start=first):
        left_p = left_a = 0.0
        for finer in windows[:k]:
            p, a = _beyond_chance(each, finer)
            share = _RESERVE / (1.0 - ratio ** (each.rungs - finer.rungs))
            left_p, left_a = max(left_p, share * p), max(left_a, share * a)
        order_error = max(float(np.hypot(each.order_error, left_p)), _LEAST_ERROR)
        limit_error = _HIDDEN * float(np.hypot(each.limit_error, left_a))
        found.append(replace(each, order_error=order_error, limit_error=limit_error))
    return min(found, key=lambda fit: fit.limit_error)


def _beyond_chance(each: OrderFit, finer: OrderFit) -> tuple[float, float]:
    """Return by how much order and limit of nested fits differ beyond chance (Hausman's test)."""
    pairs = (
        (each.order - finer.order, each.order_error, finer.order_error),
        (each.limit - finer.limit, each.limit_error, finer.limit_error),
    )
    order, limit = (
        np.sqrt(max(difference**2 - max(wide**2 - narrow**2, 0.0) / SURE**2, 0.0))
        if np.isfinite(wide)
        else 0.0
        for difference, narrow, wide in pairs
    )
    return float(order), float(limit)


def _fit_window(steps: Array, values: Array, errors: Array) -> OrderFit:
    """Fit the law to all given rungs; a bad fit increases the statistical errors."""
    rungs, columns = steps.shape
    mean = values.mean(axis=1)
    chance = errors**2 / columns
    weights = 1.0 / (chance + (_EVEN * np.ptp(mean)) ** 2)
    largest = float(steps.max())
    scaled = steps / largest
    grid = _GRID
    for _ in range(_REFINEMENTS):
        misfit = _misfit(scaled, mean, weights, grid)
        k = int(np.argmin(misfit))
        grid = np.linspace(grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)], _FINER)
    order = float(grid[_FINER // 2])
    inside = LEAST_ORDER + 0.1 < order < MOST_ORDER - 0.1
    powers = (scaled**order).mean(axis=1)
    limit, slope = _linear_fit(powers, mean, weights)
    logs = slope * (scaled**order * np.log(scaled)).mean(axis=1)
    jacobian = np.stack([np.ones(rungs), powers, logs], axis=1) * np.sqrt(weights)[:, None]
    scale = np.linalg.norm(jacobian, axis=0)
    order_error, limit_error = np.inf, np.inf
    if inside and np.all(scale > 0.0):
        q, triangle = np.linalg.qr(jacobian / scale)
        if np.linalg.cond(triangle) < 1e8:
            # Residuals of the power law are treated like scatter.
            missed = (mean - limit - slope * powers) ** 2 * rungs / max(rungs - 3, 1)
            spread = np.maximum(chance, missed.mean()) * weights
            turned = np.linalg.solve(triangle, q.T)
            variance = (turned**2 @ spread) / scale**2
            limit_error = _WIDER * float(np.sqrt(variance[0]))
            order_error = _WIDER * float(np.sqrt(variance[2]))
    if not np.isfinite(limit_error):
        limit_error = float(np.ptp(mean)) + SURE * float(np.sqrt(chance.min()))
    return OrderFit(order, order_error, limit, limit_error, slope * largest**-order, rungs)


def _misfit(steps: Array, mean: Array, weights: Array, orders: Array) -> Array:
    """Return the weighted sum of squared residuals for each order, with the best A and B."""
    powers = np.exp(np.log(steps)[None] * orders[:, None, None]).mean(axis=2)
    total = weights.sum()
    dx = powers - (powers @ weights / total)[:, None]
    dy = mean - weights @ mean / total
    slope = (dx @ (weights * dy)) / (dx**2 @ weights)
    return (dy - slope[:, None] * dx) ** 2 @ weights


def _linear_fit(x: Array, y: Array, weights: Array) -> tuple[float, float]:
    """Return A and B of y = A + B x; x is fitted relative to its mean, which saves digits."""
    total = weights.sum()
    x0, y0 = weights @ x / total, weights @ y / total
    slope = float(weights @ ((x - x0) * (y - y0)) / (weights @ (x - x0) ** 2))
    return float(y0 - slope * x0), slope


class Means(NamedTuple):
    """Limit and bias from the means of a ladder, with bounds valid in 95 of 100 cases."""

    value: float  #: Limit of small time steps.
    value_error: float
    bias: Array  #: Bound on the systematic error of each rung; of shape (R,).


def judge_means(steps: Array, values: Array, scatter: Array) -> Means:
    r"""
    Find the limit, and bound the bias of every rung, from means and their errors.

    For each of a few orders p, :math:`y = A + B h^p` is fitted to the finest rungs by least
    squares, weighted by the scatter. Orders with too large a misfit are excluded. The limit lies in
    the union of the intervals from the remaining orders. The bias of a rung is at most the largest
    :math:`|B| h^p` of these orders, plus its error. The largest window of rungs that some order
    fits is used. Windows of three rungs are not used, because some power always nearly fits three
    rungs. If no power fits, the bias is bounded by extrapolation to a time step of 0, with twice
    the steepest slope between the three finest rungs.

    `steps` and `values` have the shape (R, M): M runs on each of R rungs, from coarse to fine.
    `scatter`, of shape (R,), is the positive standard deviation of one run on each rung. There must
    be at least three rungs, with at least two runs each.
    """
    from scipy.stats import chi2, t

    rungs, columns = values.shape
    h = steps.mean(axis=1) / steps.max()
    means, errors = values.mean(axis=1), scatter / np.sqrt(columns)
    gaussian = float(t.ppf(0.975, rungs * (columns - 1)))
    sure = (1.0 + _FEW_RUNS / columns) * gaussian
    for window in range(rungs, _LEAST_RUNGS, -1):
        x, y, e = h[-window:], means[-window:], errors[-window:]
        fits = [(p, *_fit(x**p, y, e)) for p in _ORDERS]
        limit = float(chi2.ppf(1.0 - _CHANCE, window - 2)) * (_CHOSEN * gaussian / 1.96) ** 2
        kept = [fit for fit in fits if fit[3] <= limit]
        if kept:
            break
    else:
        slopes = np.diff(means[-_LEAST_RUNGS:]) / np.diff(h[-_LEAST_RUNGS:])
        steepest = float(np.max(np.abs(slopes))) * h[-1]
        error = _NO_LAW * steepest + sure * float(np.hypot(*errors[-2:]))
        bias = np.abs(means - means[-1]) + error
        return Means(float(means[-1]), float(error), bias)
    low = min(a[0] - sure * a[1] for _, a, _, _ in kept)
    high = max(a[0] + sure * a[1] for _, a, _, _ in kept)
    value, error = 0.5 * (low + high), 0.5 * (high - low)
    bias = np.max([(abs(b[0]) + sure * b[1]) * h**p for p, _, b, _ in kept], axis=0)
    # If a rung is too coarse for the power law, its error is its difference from the limit.
    apart = np.abs(means - value) + error + sure * errors
    bias[: rungs - window] = apart[: rungs - window]
    return Means(value, error, bias)


def _fit(
    x: Array, y: Array, errors: Array
) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Return A and B of y = A + B x with their standard errors, and the weighted misfit."""
    least = errors.min()
    weights = least**2 / errors**2
    a, b = _linear_fit(x, y, weights)
    total = weights.sum()
    middle = weights @ x / total
    spread = weights @ (x - middle) ** 2
    misfit = weights @ (y - a - b * x) ** 2 / least**2
    of_a, of_b = least * np.sqrt([1.0 / total + middle**2 / spread, 1.0 / spread])
    return (a, float(of_a)), (b, float(of_b)), float(misfit)
