"""Test standard errors of correlated series."""

import numpy as np
import pytest

from chaincor.analysis.ladders.series import standard_error
from tests.analysis.ladders.draws import autoregressive


@pytest.mark.parametrize("time", [0.0, 1.5, 10.0])
def test_standard_errors_of_long_series(time):
    """Use autoregressive series: the mean has (1 + a)/(1 - a)/N times the variance of a sample."""
    random = np.random.default_rng(8)
    count = 4000
    series = [autoregressive(count, time, random) for _ in range(100)]
    memory = np.exp(-1.0 / time) if time else 0.0
    exact = np.sqrt((1.0 + memory) / (1.0 - memory) / count)
    # With 200 correlation times, one error bar is uncertain by about 5 %, and the mean of 100 bars
    # by a tenth of this. The window makes the estimate too large by 2 %, Student's factor by 2 %,
    # and other effects by a few per cent.
    assert np.mean([standard_error(each).error for each in series]) == pytest.approx(
        exact, rel=0.08
    )
    assert np.std([each.mean() for each in series]) == pytest.approx(exact, rel=3.0 / np.sqrt(200))


@pytest.mark.parametrize(
    ("count", "time"),
    [(100, 0), (100, 3), (100, 10), (100, 30), (100, 100), (200, 10), (200, 30), (200, 100)],
)
def test_means_of_short_series_are_within_three_bars_or_not_given(count, time):
    """Allow at most 5 misleading error bars in 100 series, even for one correlation time."""
    random = np.random.default_rng(9)
    series = [autoregressive(count, time, random) for _ in range(2000)]
    bars = np.array([standard_error(each).error for each in series])
    means = np.abs([each.mean() for each in series])
    printed = np.isfinite(bars)
    # For 2000 draws, the limit is three standard deviations above 5 in 100.
    misled = printed & (means > 3.0 * bars)
    assert np.mean(misled) < 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / 2000)
    # Most series of 30 correlation times have error bars. No bar is far larger than the scatter of
    # its series.
    assert count < 30 * time or np.mean(printed) > 0.95
    assert np.all(bars[printed] <= 1.5 * np.std(series, axis=1)[printed] * (1.0 + 1e-9))


def test_standard_errors_of_what_is_no_series():
    assert standard_error(np.ones(10)) == (0.0, 10.0)
    assert standard_error(np.ones(3)).error == np.inf


def test_fewer_than_50_samples_have_no_bar():
    """Give short series no error bar, because short parts of a slow series may look independent."""
    independent = np.random.default_rng(5).normal(size=60)
    assert standard_error(independent[:49]).error == np.inf
    assert standard_error(independent[:50]).error < 0.5


def test_bars_are_never_wider_than_the_series():
    """Give a part of a slow sine no error bar, because its mean is hardly known."""
    for periods in (0.2, 0.5, 1.0, 2.0):
        series = np.sin(2.0 * np.pi * periods * np.linspace(0.0, 1.0, 100))
        error, independent = standard_error(series)
        assert error == np.inf, periods
        assert 1.0 <= independent <= 3.0
