"""Means of correlated series, with their standard errors."""

import numpy as np
from numpy.typing import NDArray


def standard_error(series: NDArray[np.float64]) -> float:
    r"""
    Return the standard error of the mean of a stationary, correlated series.

    .. math:: \sigma^2 = \frac{1}{N} \Big( \gamma_0 + 2 \sum_{k \geq 1} \gamma_k \Big)

    with autocovariances :math:`\gamma_k`, summed over pairs of neighbouring lags as long as these
    are positive and fall: the initial monotone sequence of Geyer (Statist. Sci. 7, 473, 1992),
    which for time-reversible series errs on the large side.

    Parameters
    ----------
    series : ndarray of shape (N,)
        The samples, equally spaced.

    Returns
    -------
    float
        Standard error; 0 for a constant series, inf for less than four samples.
    """
    count = len(series)
    if count < 4:
        return float("inf")
    rest = series - series.mean()
    if not np.any(rest):
        return 0.0
    spectrum = np.fft.rfft(rest, 2 * count)
    covariance = np.fft.irfft(np.abs(spectrum) ** 2)[:count] / count
    pairs = covariance[: count // 2 * 2].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0.0)
    pairs = np.minimum.accumulate(pairs[: ends[0] if len(ends) else None])
    variance = max(2.0 * float(pairs.sum()) - float(covariance[0]), 0.0) / count
    # Less than independent samples have is a small number's luck; a mean of few is uncertain.
    return float(np.sqrt(max(variance, float(covariance[0]) / count)))
