"""Standard errors of correlated series."""

import numpy as np
import pytest

from chaincor.analysis.ladders.series import standard_error
from tests.analysis.ladders.draws import autoregressive


@pytest.mark.parametrize("time", [0.0, 1.5, 10.0])
def test_standard_errors_of_long_series(time):
    """An autoregressive series: its mean has variance (1 + a)/(1 - a)/N of a sample's."""
    random = np.random.default_rng(8)
    count = 4000
    series = [autoregressive(count, time, random) for _ in range(100)]
    memory = np.exp(-1.0 / time) if time else 0.0
    exact = np.sqrt((1.0 + memory) / (1.0 - memory) / count)
    # Each is uncertain by some 5 % at 200 correlation times, their mean by a tenth of that; the
    # estimate errs on the large side, by the window's 2 %, Student's 2 % and some percent.
    assert np.mean([standard_error(each) for each in series]) == pytest.approx(exact, rel=0.08)
    assert np.std([each.mean() for each in series]) == pytest.approx(exact, rel=3.0 / np.sqrt(200))


@pytest.mark.parametrize(
    ("count", "time"),
    [(100, 0), (100, 3), (100, 10), (100, 30), (100, 100), (200, 10), (200, 30), (200, 100)],
)
def test_means_of_short_series_are_within_three_bars_or_not_told(count, time):
    """Of those told 95 in 100, in series as short as one correlation time; long ones are told."""
    random = np.random.default_rng(9)
    series = [autoregressive(count, time, random) for _ in range(2000)]
    bars = np.array([standard_error(each) for each in series])
    means = np.abs([each.mean() for each in series])
    told = np.isfinite(bars)
    # Of 900 that are told at least, three standard deviations below 95 in 100.
    assert np.mean(means[told] <= 3.0 * bars[told]) > 0.95 - 3.0 * np.sqrt(0.05 * 0.95 / 900)
    # Bars are told where a series has 30 correlation times, and not beyond what it spans.
    assert np.mean(told) > (0.95 if count >= 30 * time else 0.4)
    assert count < 20 * time or np.median(bars[told]) < 1.0


def test_standard_errors_of_what_is_no_series():
    assert standard_error(np.ones(10)) == 0.0
    assert standard_error(np.ones(3)) == np.inf
