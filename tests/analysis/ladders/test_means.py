"""Bounds from means alone, and standard errors of correlated series."""

import numpy as np
import pytest

from chaincor.analysis.ladders.order_fit import judge_means
from chaincor.analysis.ladders.series import standard_error
from chaincor.analysis.ladders.verdict import judge_ladder
from tests.analysis.ladders.draws import autoregressive

DRAWS = 200
# 95 % are meant to hold; of 200 draws, three standard deviations fewer than that.
LEAST_HELD = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / DRAWS)


@pytest.mark.parametrize("order", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("ratio", [0.0, 0.3, 1.0, 3.0, 30.0])
def test_limits_and_biases_are_bounded_at_every_ratio_of_bias_to_noise(order, ratio):
    """Noise of 1, a bias of `ratio` on the coarsest rung."""
    random = np.random.default_rng(3)
    h = np.array([1.0, 0.5, 0.25, 0.125])
    held = []
    for _ in range(DRAWS):
        steps = h[:, None] * random.uniform(0.98, 1.02, (4, 4))
        values = 7.0 + ratio * steps**order + random.normal(size=(4, 4))
        bias = ratio * (steps**order).mean(axis=1)
        scatter = np.full(4, values.std(axis=1, ddof=1).mean())
        found = judge_means(steps, values, scatter)
        held.append([abs(found.value - 7.0) <= found.value_error, *(bias <= found.bias)])
    assert np.all(np.mean(held, axis=0) >= LEAST_HELD)


def test_order_two_in_noise_gets_an_answer_without_an_order():
    random = np.random.default_rng(5)
    steps = 0.5 ** np.arange(6)[:, None] * random.uniform(0.98, 1.02, (6, 6))
    values = 3.0 + 1e-2 * steps**2 + 5e-3 * random.normal(size=steps.shape)
    verdict = judge_ladder(steps, values)
    assert verdict.kind == "bounded"
    assert verdict.order is None
    assert abs(verdict.value - 3.0) <= verdict.value_error
    assert np.all(np.isfinite(verdict.bias))


def test_what_follows_no_power_is_bounded_by_its_finest_rungs():
    h = np.array([1.0, 0.5, 0.25, 0.125])
    values = np.sign(np.sin(9.0 * h))[:, None] + np.zeros((4, 3))
    values[-1] += 0.6
    found = judge_means(h[:, None] * np.ones((4, 3)), values, np.full(4, 1e-6))
    assert found.value == pytest.approx(values[-1, 0], rel=1e-12)
    assert found.value_error >= 2.0 * abs(values[-1, 0] - values[-2, 0])


def test_rungs_that_agree_by_luck_promise_nothing():
    """Of `couette` and `langevin` inputs: finest rungs that agree, or that some power fits."""
    h = np.array([1.0, 0.5, 0.25, 0.125])
    for values, limit in (
        ([2.4762, 2.6902, 2.9291, 2.9279], 2.8690),
        ([0.95624, 0.95967, 0.97748, 0.98223], 0.9697),
        ([0.93574, 0.95569, 0.90861, 0.92880], 0.9600),
    ):
        columns = np.array(values)[:, None] * np.ones((4, 3))
        found = judge_means(h[:, None] * np.ones((4, 3)), columns, np.full(4, 1e-6))
        assert abs(found.value - limit) < found.value_error
        # As steep as between the finest rungs, twice.
        slopes = np.abs(np.diff(values[1:]) / np.diff(h[1:]))
        assert found.value_error == pytest.approx(2.0 * slopes.max() * h[-1], rel=1e-3)


def test_a_rung_without_scatter_is_no_end():
    """All runs of a rung may have as many steps, and the same digits, where others scatter."""
    h = np.array([1.0, 0.5, 0.25, 0.125])[:, None] * np.array([[0.98, 1.0, 1.01, 1.02]])
    values = 3.0 + 1e-2 * h**2 + 1e-3 * np.random.default_rng(4).normal(size=h.shape)
    for rung in range(4):
        same = values.copy()
        same[rung] = same[rung, 0]
        verdict = judge_ladder(h, same)
        assert abs(verdict.value - 3.0) <= verdict.value_error < 0.03


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
