"""How the runs of a ladder scatter, by how much less at finer steps, and if their means change."""

import numpy as np

from chaincor.analysis.ladders.order_fit import SURE, OrderFit, fit_order
from chaincor.lammps_inputs.arrays import Array

# Fewer rungs tell no decay.
_LEAST_RUNGS = 4
# What is seen by chance alone in 1 of 100 ladders.
_CHANCE = 0.01


def smooth_scatter(h: Array, scatter: Array) -> Array:
    """
    Return the scatter of each rung halfway to the straight line through the logarithms of all.

    Single rungs tell their scatter badly.
    """
    x, y = np.log(h.mean(axis=1)), np.log(scatter)
    return np.exp(0.5 * (y + np.polyval(np.polyfit(x, y, 1), x)))


def spread_of_rungs(h: Array, values: Array, resolution: float) -> Array:
    """
    Return the standard deviation of each rung.

    Of numbers with all digits, runs of a rung that agree in all had as many steps each: they tell
    no scatter, which is taken from the rungs around.
    """
    spread = values.std(axis=1, ddof=1)
    told = np.ptp(values, axis=1) > 0.0
    if resolution > 0.0 or not np.any(told):
        return spread
    x = -np.log(h.mean(axis=1))
    return np.where(told, spread, np.exp(np.interp(x, x[told], np.log(spread[told]))))


def scatter_about_law(
    h: Array, values: Array, floor: float, seeded: bool
) -> tuple[Array, OrderFit]:
    """Return the scatter about a smooth law, by rung, and that law; each needs the other."""
    rough = np.hypot(values.std(axis=1, ddof=1), floor)
    fit = fit_order(h, values, rough)
    for _ in range(3):
        rest = (values - fit.slope * h**fit.order).std(axis=1, ddof=1)
        rough = _seeds_apart(h, values, fit.order, rest) if seeded else rest
        rough = np.hypot(rough, floor)
        fit = fit_order(h, values, smooth_scatter(h, rough))
    return rough, fit


def _seeds_apart(h: Array, values: Array, p: float, rough: Array) -> Array:
    """
    Return the scatter about A + B h^p with A and B of each seed's own, where seeds have their own.

    Whether they have is decided by an F test; `rough` is the scatter about a common law.
    """
    from scipy.stats import f

    rungs, columns = values.shape
    # As if all rungs scattered alike: what is compared is the same sum of squares.
    squares = np.zeros(rungs)
    for k in range(columns):
        design = np.stack([np.ones(rungs), h[:, k] ** p], axis=1)
        q, _ = np.linalg.qr(design)
        rest = values[:, k] - q @ (q.T @ values[:, k])
        squares += rest**2 / np.maximum(1.0 - np.sum(q**2, axis=1), 0.1)
    apart = np.sqrt(squares / columns)
    common, own = float(np.sum(rough**2)), float(np.sum(apart**2))
    # Degrees of freedom: of a common law one mean a rung, of seeds' own laws two numbers a seed.
    freedom = rungs * (columns - 1), (rungs - 2) * columns
    return apart if common / max(own, 1e-300) > f.ppf(1.0 - _CHANCE, *freedom) else rough


def decay_of_scatter(h: Array, rough: Array, columns: int, floor: float) -> tuple[float, float]:
    """Return the power of the step by which scatter shrinks, and its 95 % error."""
    from scipy.special import polygamma

    seen = rough > 2.0 * floor
    if seen.sum() < _LEAST_RUNGS:
        return 0.0, np.inf
    x, y = np.log(h[seen]), np.log(rough[seen])
    slope, level = np.polyfit(x, y, 1)
    rest = y - slope * x - level
    # Variance of the logarithm of a standard deviation from M Gaussian values; where the rungs
    # themselves scatter by more, that counts.
    expected = float(polygamma(1, 0.5 * (columns - 1))) / 4.0
    variance = max(expected, float(rest @ rest) / (len(x) - 2))
    return float(slope), SURE * float(np.sqrt(variance / np.sum((x - x.mean()) ** 2)))


def bias_is_seen(h: Array, values: Array) -> bool:
    """
    Test whether the mean changes along the ladder, by more than chance.

    The contrast has the shape of h^1.5, between orders 1 and 2; columns are compared with
    themselves, so that seeds of different levels do not hide it.
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
