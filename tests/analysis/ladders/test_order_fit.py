"""Test bounds on the error that come from the means alone."""

import numpy as np
import pytest

from chaincor.analysis.ladders.order_fit import judge_means
from chaincor.analysis.ladders.verdict import judge_ladder

DRAWS = 200
# 95 % of the bounds should hold. The limit is three standard deviations of 200 draws lower.
LEAST_HELD = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / DRAWS)


@pytest.mark.parametrize("order", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("ratio", [0.0, 0.3, 1.0, 3.0, 30.0])
def test_limits_and_biases_are_bounded_at_every_ratio_of_bias_to_noise(order, ratio):
    """Use noise of size 1 and a bias of `ratio` at the coarsest step."""
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
    """Use `couette` and `langevin` results in which the finest steps agree by chance."""
    h = np.array([1.0, 0.5, 0.25, 0.125])
    for values, limit in (
        ([2.4762, 2.6902, 2.9291, 2.9279], 2.8690),
        ([0.95624, 0.95967, 0.97748, 0.98223], 0.9697),
        ([0.93574, 0.95569, 0.90861, 0.92880], 0.9600),
    ):
        columns = np.array(values)[:, None] * np.ones((4, 3))
        found = judge_means(h[:, None] * np.ones((4, 3)), columns, np.full(4, 1e-6))
        assert abs(found.value - limit) < found.value_error
        # The error bar uses twice the largest slope between the three finest steps.
        slopes = np.abs(np.diff(values[1:]) / np.diff(h[1:]))
        assert found.value_error == pytest.approx(2.0 * slopes.max() * h[-1], rel=1e-3)


def test_a_rung_without_scatter_is_no_end():
    """Give equal results to all runs at one step, while the runs at other steps scatter."""
    h = np.array([1.0, 0.5, 0.25, 0.125])[:, None] * np.array([[0.98, 1.0, 1.01, 1.02]])
    values = 3.0 + 1e-2 * h**2 + 1e-3 * np.random.default_rng(4).normal(size=h.shape)
    for rung in range(4):
        same = values.copy()
        same[rung] = same[rung, 0]
        verdict = judge_ladder(h, same)
        assert abs(verdict.value - 3.0) <= verdict.value_error < 0.03
