"""What means alone say of a ladder of steps: a value, and bounds on the bias, without an order."""

from dataclasses import dataclass

import numpy as np

from chaincor.analysis.ladders.order_fit import linear_fit
from chaincor.lammps_inputs.arrays import Array

# Powers of the step that a bias may fall with; where several agree with the means, all count.
ORDERS = (1.0, 1.5, 2.0, 3.0, 4.0)
# So many rungs tell a steepest slope; a power has to fit more than these.
LEAST_RUNGS = 3
# A power is given up where noise alone would miss it as far in 1 of 20 ladders.
_CHANCE = 0.05
# Where no power fits, the bias falls to step 0 as steeply as between the finest rungs, times this.
_NO_LAW = 2.0
# A choice among windows makes bars too short, and among verdicts, where a rung has few runs: by
# 1 + this over them, as `benchmarks.bars.ladders` counts with 4 and 8.
_WIDER, _FEW_RUNS = 1.2, 2.2


@dataclass(frozen=True)
class Means:
    """What a ladder's means say."""

    #: Limit of fine steps, and what it holds within in 95 of 100 cases.
    value: float
    value_error: float  #: See ``value``.
    bias: Array  #: Bound on the systematic error of each rung, likewise; of shape (R,).


def judge_means(steps: Array, values: Array, scatter: Array) -> Means:
    """
    Bound the bias of every rung, and find the limit, from means and their errors.

    For each p of a few orders, :math:`y = A + B h^p` is fitted to the finest rungs by least
    squares, weighted by the scatter. All p that the misfit does not exclude count: the limit lies
    in the union of their intervals, and the bias of a rung is at most the largest :math:`|B| h^p`
    with its own error. The widest window of rungs that some p fits is taken; of three rungs, of
    which one power or another always nearly fits, nothing is believed. Where none fits, the
    steepest slope between the three finest rungs, twice, down to step 0, stands for what is left.

    `steps` and `values`, of shape (R, M), are rung by rung from coarse to fine; `scatter`, of shape
    (R,), is the standard deviation of one run, by rung, positive. Raises ValueError if there are
    fewer than three rungs or two runs a rung.
    """
    from scipy.stats import chi2, t

    rungs, columns = values.shape
    if rungs < LEAST_RUNGS or columns < 2:
        raise ValueError(
            f"{rungs} rungs with {columns} runs; expected {LEAST_RUNGS} and 2 at least"
        )
    h = steps.mean(axis=1) / steps.max()
    means, errors = values.mean(axis=1), scatter / np.sqrt(columns)
    gaussian = float(t.ppf(0.975, rungs * (columns - 1)))
    sure = (1.0 + _FEW_RUNS / columns) * gaussian
    for window in range(rungs, LEAST_RUNGS, -1):
        x, y, e = h[-window:], means[-window:], errors[-window:]
        fits = [(p, *_fit(x**p, y, e)) for p in ORDERS]
        limit = float(chi2.ppf(1.0 - _CHANCE, window - 2)) * (_WIDER * gaussian / 1.96) ** 2
        kept = [fit for fit in fits if fit[3] <= limit]
        if kept:
            break
    else:
        slopes = np.diff(means[-LEAST_RUNGS:]) / np.diff(h[-LEAST_RUNGS:])
        steepest = float(np.max(np.abs(slopes))) * h[-1]
        error = _NO_LAW * steepest + sure * float(np.hypot(*errors[-2:]))
        bias = np.abs(means - means[-1]) + error
        return Means(float(means[-1]), float(error), bias)
    low = min(a[0] - sure * a[1] for _, a, _, _ in kept)
    high = max(a[0] + sure * a[1] for _, a, _, _ in kept)
    value, error = 0.5 * (low + high), 0.5 * (high - low)
    bias = np.max([(abs(b[0]) + sure * b[1]) * h**p for p, _, b, _ in kept], axis=0)
    # Rungs too coarse for the law: their own distance.
    apart = np.abs(means - value) + error + sure * errors
    bias[: rungs - window] = apart[: rungs - window]
    return Means(value, error, bias)


def _fit(
    x: Array, y: Array, errors: Array
) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Return A and B of y = A + B x with their standard errors, and the weighted misfit."""
    least = errors.min()
    weights = least**2 / errors**2
    a, b = linear_fit(x, y, weights)
    total = weights.sum()
    middle = weights @ x / total
    spread = weights @ (x - middle) ** 2
    misfit = weights @ (y - a - b * x) ** 2 / least**2
    of_a, of_b = least * np.sqrt([1.0 / total + middle**2 / spread, 1.0 / spread])
    return (a, float(of_a)), (b, float(of_b)), float(misfit)
