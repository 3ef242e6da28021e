"""
Estimate mean, quantiles and probabilities of a quantity from samples.

Each sample has a numerical error bar, and each estimate a statistical interval.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.errors import InputError

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Quantile:
    """Quantile of a distribution."""

    probability: float  #: Expected fraction of all samples below the quantile.
    value: float  #: Estimate of the quantile.
    #: Lower end of the confidence interval, which is valid for any distribution. Both ends are
    #: sampled values; if there are too few samples, they are -inf and inf.
    low: float
    high: float  #: Upper end of the interval.


@dataclass(frozen=True)
class Share:
    """Probability of an event, from its frequency in samples."""

    value: float  #: Fraction of the samples in which the event happened.
    #: Lower end of Wilson's interval. If the error bar of a sample does not decide about the event,
    #: the lower end assumes that the event did not happen, and the upper end that it did.
    low: float
    high: float  #: Upper end of the interval.
    doubtful: int  #: Number of samples whose error bars do not decide about the event.


@dataclass(frozen=True)
class Distribution:
    r"""Estimates of a distribution from samples."""

    count: int  #: Number N of samples.
    #: Mean, and the standard deviation :math:`s` with N - 1 degrees of freedom.
    mean: float
    deviation: float  #: See ``mean``.
    standard_error: float  #: Statistical error of the mean, :math:`s/\sqrt N`; nan for one sample.
    #: Numerical error of the mean: the mean of the samples' error bars, because all errors may have
    #: the same sign. The result is nan if a sample has no error bar.
    numerical_error: float
    quantiles: tuple[Quantile, ...]  #: Quantiles at the probabilities `QUANTILES`.

    @classmethod
    def of(cls, values: ArrayLike, errors: ArrayLike) -> "Distribution":
        """
        Return the distribution of samples and their numerical error bars, both of shape (N,).

        Raises InputError if there are no samples.
        """
        x, bars = np.asarray(values, dtype=float), np.asarray(errors, dtype=float)
        if len(x) == 0:
            raise InputError("a distribution of no samples was asked for. Give at least one sample")
        deviation = float(np.std(x, ddof=1)) if len(x) > 1 else math.nan
        return cls(
            count=len(x),
            mean=float(np.mean(x)),
            deviation=deviation,
            standard_error=deviation / math.sqrt(len(x)),
            numerical_error=float(np.mean(bars)),
            quantiles=tuple(quantile(x, p) for p in QUANTILES),
        )

    def samples_needed(self, precision: float) -> int | None:
        r"""
        Return the number of samples whose mean has a given standard error, :math:`(s/\epsilon)^2`.

        The result is None for one sample, which has no scatter.
        """
        if not math.isfinite(self.deviation):
            return None
        # If the samples differ only by rounding, one sample suffices.
        return max(1, math.ceil((self.deviation / precision) ** 2 * (1.0 - 1e-12)))


def quantile(values: ArrayLike, probability: float) -> Quantile:
    """
    Return a quantile with a confidence interval that is valid for any distribution.

    The quantile is interpolated linearly between samples, like `numpy.quantile`. The number of
    samples below the true quantile has a binomial distribution, which determines the two ordered
    samples that enclose the quantile.
    """
    from scipy.stats import binom

    ordered = np.sort(np.asarray(values, dtype=float))
    count, tail = len(ordered), 0.5 * (1.0 - CONFIDENCE)
    padded = np.concatenate(([-math.inf], ordered, [math.inf]))
    # The quantile is below sample k (counted from 1) only if fewer than k samples are below the
    # quantile.
    below = int(binom.ppf(tail, count, probability))
    above = int(binom.ppf(1.0 - tail, count, probability)) + 1
    return Quantile(
        probability,
        float(np.quantile(ordered, probability)),
        float(padded[below]),
        float(padded[above]),
    )


def wilson_interval(hits: int, count: int) -> tuple[float, float]:
    """Return Wilson's interval for an event that happened `hits` times in `count`."""
    from scipy.stats import binomtest

    found = binomtest(hits, count).proportion_ci(CONFIDENCE, method="wilson")
    return float(found.low), float(found.high)


def share_above(values: ArrayLike, errors: ArrayLike, threshold: float) -> Share:
    """
    Return the probability that a sample exceeds a threshold, with its interval.

    `values` are the samples and `errors` their numerical error bars, both of shape (N,).
    """
    x, bars = np.asarray(values, dtype=float), np.asarray(errors, dtype=float)
    surely = int(np.count_nonzero(x - bars > threshold))
    # A sample without an error bar may have any value.
    possibly = int(np.count_nonzero(~(x + bars <= threshold)))
    return Share(
        float(np.mean(x > threshold)),
        wilson_interval(surely, len(x))[0],
        wilson_interval(possibly, len(x))[1],
        possibly - surely,
    )
