"""Compute the standard error of the mean of a correlated series."""

from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array

# A series has an error bar only if its correlations last at most this fraction of its length, and
# if it has at least this many independent samples.
_LARGEST_SHARE, _LEAST_INDEPENDENT = 0.25, 3.0
# A series with fewer samples has no error bar. If the correlation time is 10, 3 of 100 series with
# 24 samples look independent. For such series, only 52 of 100 error bars contain the true mean.
_LEAST_SAMPLES = 50
_THREE_SIGMA = 0.99865
# An error bar longer than this many standard deviations of the series has no meaning.
_LONGEST_BAR = 1.5
# Error bars are longer for series that resemble a random walk, for which the von Neumann ratio
# times the length is 6 to 10. If this product is equal to this value, the error bar is doubled.
# According to `benchmarks.bars.series`, three error bars then contain the true mean of 95 of 100
# series, even if the correlation time is 100 samples.
_WALKS = 35.0


class MeanError(NamedTuple):
    """Uncertainty of the mean of a series."""

    error: float  #: Standard error; 0 for a constant series, inf for too few samples.
    independent: float  #: Number of independent samples, at least 1.


def standard_error(series: Array) -> MeanError:
    r"""
    Return the standard error of the mean of a stationary, correlated series of shape (N,).

    .. math:: \sigma^2 = \frac{1}{N} \Big( \gamma_0 + 2 \sum_{k = 1}^{M - 1} \gamma_k \Big)

    The autocovariances :math:`\gamma_k` are summed in pairs of neighbouring lags, as long as the
    sums of pairs are positive and decrease. This is the initial monotone sequence of Geyer
    (Statist. Sci. 7, 473, 1992). Because the mean of the series itself is subtracted, the sum of
    autocovariances is too small by about the fraction :math:`(2M - 1)/N`; :math:`\sigma` is divided
    by the remaining fraction. The number of independent samples is :math:`N \gamma_0` divided by
    the sum. Student's t with this number of samples widens :math:`\sigma`: three :math:`\sigma`
    then have the same probability as for a Gaussian. A series that looks like a random walk may be
    a short part of a slower series. Therefore :math:`\sigma` is multiplied by :math:`1 +
    (35/\nu)^3` with :math:`\nu = N \sum (x_{i+1} - x_i)^2 / \sum (x_i - \bar x)^2`. The error is
    inf for fewer than 50 samples. An error above 1.5 standard deviations of the series is also
    replaced by inf. This happens with fewer than about four independent samples.
    """
    from scipy.special import stdtrit

    count = len(series)
    if count < 4:
        return MeanError(float("inf"), 1.0)
    rest = series - series.mean()
    if not np.any(rest):
        return MeanError(0.0, float(count))
    spectrum = np.fft.rfft(rest, 2 * count)
    covariance = np.fft.irfft(np.abs(spectrum) ** 2)[:count] / count
    pairs = covariance[: count // 2 * 2].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0.0)
    pairs = np.minimum.accumulate(pairs[: ends[0] if len(ends) else None])
    lags = 2 * len(pairs)
    left = 1.0 - (2 * lags - 1) / count
    # If the sum is smaller than for independent samples, this is due to chance.
    total = max(2.0 * float(pairs.sum()) - float(covariance[0]), float(covariance[0]))
    independent = max(left * count * float(covariance[0]) / total, 1.0)
    few = count < _LEAST_SAMPLES or independent < _LEAST_INDEPENDENT
    if few or lags > _LARGEST_SHARE * count:
        return MeanError(float("inf"), min(independent, _LEAST_INDEPENDENT))
    wider = float(stdtrit(independent - 1.0, _THREE_SIGMA)) / 3.0
    walk = _WALKS * float(np.sum(rest**2) / np.sum(np.diff(rest) ** 2)) / count
    error = wider * (1.0 + walk**3) * float(np.sqrt(total / count)) / left
    if error > _LONGEST_BAR * float(np.sqrt(covariance[0])):
        return MeanError(float("inf"), min(independent, _LEAST_INDEPENDENT))
    return MeanError(error, independent)
