"""Test verdicts on series of runs with known errors."""

import numpy as np
import pytest

from chaincor.analysis.ladders.verdict import judge_ladder
from tests.analysis.ladders.draws import ORDERS, WRONG, draw

# In 300 draws of each kind, benchmarks/bars/ladders.py finds no order 1 or 2 in a series of another
# kind, and finds an order in 1 % of the noise. The 12 draws here are enough to find broken code.
DRAWS = 12


@pytest.mark.parametrize("kind", ORDERS)
@pytest.mark.slow_cases
def test_no_kind_is_taken_for_another(kind):
    random = np.random.default_rng(17)
    wrong = printed = outside = 0
    for _ in range(DRAWS):
        h, values, reference_value = draw(kind, 8, 8, random)
        verdict = judge_ladder(h, values)
        wrong += verdict.kind in WRONG[kind]
        if verdict.value is not None:
            outside += abs(verdict.value - reference_value) > verdict.value_error
        if verdict.order is not None and ORDERS[kind] is not None:
            printed += 1
            wrong += abs(verdict.order - ORDERS[kind]) > 0.5
    assert wrong == 0
    # Error bars cover the exact limit in 95 of 100 cases; 4 failures of 12 have a probability of
    # 0.2 %.
    assert outside <= 3
    if kind in ("order 1", "order 2", "order 4", "irregular, bounded"):
        assert printed >= DRAWS - 3


@pytest.mark.slow
def test_bars_hold_where_ladders_are_weakest():
    """Use noise of half the bias and 4 runs at each of 4 steps, as in a default study."""
    random = np.random.default_rng(22)
    held = []
    for _ in range(200):
        h, values, reference_value = draw("order 2 in strong noise", 4, 4, random)
        verdict = judge_ladder(h, values)
        held.append(abs(verdict.value - reference_value) <= verdict.value_error)
    # For 200 draws, the limit is three standard deviations below 95 of 100.
    assert np.mean(held) > 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / 200)


def test_seeds_of_different_levels_do_not_hide_the_order():
    # The result varies a hundred times more between seeds than with the step.
    random = np.random.default_rng(3)
    h = 20.0 ** (-np.arange(8) / 7)[:, None] * random.uniform(0.98, 1.02, (8, 6))
    values = random.normal(size=6) + 1e-2 * random.uniform(0.5, 1.5, 6) * h**2
    verdict = judge_ladder(h, values, seeded=True)
    assert verdict.kind == "regular"
    assert abs(verdict.order - 2.0) <= verdict.order_error
    # The scatter includes the deviations that come from seeds.
    assert verdict.scatter[-1] > 0.1


def test_equal_digits_tell_nothing():
    h = 20.0 ** (-np.arange(5) / 4)[:, None] * np.array([1.0, 1.01, 0.99])
    verdict = judge_ladder(h, np.full(h.shape, 0.5), resolution=1e-5)
    assert verdict.kind == "cannot tell"
    assert "same digits" in verdict.reason
    assert verdict.value is None
    assert verdict.value_error is None
    assert np.all(np.isinf(verdict.bias))


def test_digits_that_are_printed_limit_the_value():
    # With six digits, each result has an error of sqrt(1/12) units of the last digit.
    random = np.random.default_rng(5)
    h = 20.0 ** (-np.arange(8) / 7)[:, None] * random.uniform(0.98, 1.02, (8, 8))
    values = np.round(0.5 + 1e-2 * h**2, 6)
    verdict = judge_ladder(h, values, resolution=1e-6)
    assert verdict.kind == "regular"
    assert abs(verdict.order - 2.0) <= verdict.order_error
    assert abs(verdict.value - 0.5) <= verdict.value_error
    assert 1e-8 < verdict.value_error < 1e-5


def test_small_ladders_are_refused():
    with pytest.raises(ValueError, match="4 rungs and 3 runs"):
        judge_ladder(np.ones((3, 3)), np.ones((3, 3)))
