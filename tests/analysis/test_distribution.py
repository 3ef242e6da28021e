"""Test errors of means, quantiles and probabilities of samples against many draws."""

import math

import numpy as np
import pytest

from chaincor.analysis.distribution import Distribution, quantile, share_above, wilson_interval
from chaincor.analysis.figures.terminal import draw_histogram
from chaincor.lammps_inputs.errors import InputError


def test_mean_and_its_two_errors():
    found = Distribution.of([1.0, 2.0, 3.0, 6.0], [0.1, 0.2, 0.3, 0.4])
    assert found.mean == 3.0
    # The variance is (4 + 1 + 0 + 9)/3. The standard error is its square root divided by that of
    # four samples.
    assert found.deviation == pytest.approx(math.sqrt(14.0 / 3.0), rel=1e-15)
    assert found.standard_error == pytest.approx(math.sqrt(14.0 / 12.0), rel=1e-15)
    # All errors may have the same sign, so that they do not average out.
    assert found.numerical_error == pytest.approx(0.25, rel=1e-15)
    assert found.samples_needed(math.sqrt(14.0 / 12.0)) == 4
    assert found.samples_needed(math.sqrt(14.0 / 12.0) / 3.0) == 36


def test_one_sample_has_no_scatter():
    found = Distribution.of([0.5], [1e-6])
    assert math.isnan(found.standard_error)
    assert found.samples_needed(0.01) is None
    with pytest.raises(InputError, match="no samples"):
        Distribution.of([], [])


@pytest.mark.parametrize("probability", [0.05, 0.5, 0.95])
@pytest.mark.parametrize("count", [20, 200])
@pytest.mark.slow_cases
def test_quantiles_are_within_their_intervals(count, probability):
    draws = np.random.default_rng(3).random((2000, count))
    found = [quantile(row, probability) for row in draws]
    held = np.mean([each.low <= probability <= each.high for each in found])
    # At least 95 % of intervals must cover the quantile. For 2000 draws, four standard errors are 2
    # %.
    assert held > 0.93
    if count == 200:
        assert held < 0.99, "intervals are not wider than they need to be"


@pytest.mark.parametrize("probability", [0.01, 0.3, 0.97])
def test_wilson_intervals_hold_the_probability(probability):
    count = 100
    hits = np.random.default_rng(4).binomial(count, probability, 4000)
    ends = [wilson_interval(k, count) for k in range(count + 1)]
    held = np.mean([ends[k][0] <= probability <= ends[k][1] for k in hits])
    # Averaged over probabilities, Wilson's interval has the right coverage. For a single
    # probability, the coverage is right within a few per cent.
    assert 0.90 < held < 0.99


def test_wilson_intervals_known_values():
    # Newcombe (1998), Statist. Med. 17, 857, table I, method 3.
    assert wilson_interval(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson_interval(15, 148) == pytest.approx((0.0624, 0.1605), abs=5e-5)
    assert wilson_interval(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert wilson_interval(1, 29) == pytest.approx((0.0061, 0.1718), abs=5e-5)


def test_bars_that_cross_the_threshold_widen_the_interval():
    values = np.array([0.9] * 50 + [0.9995] * 2 + [1.0005] * 3 + [1.2] * 45)
    sharp = share_above(values, np.full(100, 1e-6), 1.0)
    vague = share_above(values, np.full(100, 1e-3), 1.0)
    blind = share_above(values, np.full(100, np.nan), 1.0)
    assert sharp.value == vague.value == 0.48
    assert (sharp.doubtful, vague.doubtful, blind.doubtful) == (0, 5, 100)
    assert (sharp.low, sharp.high) == wilson_interval(48, 100)
    assert (vague.low, vague.high) == (wilson_interval(45, 100)[0], wilson_interval(50, 100)[1])
    assert (blind.low, blind.high) == (0.0, 1.0)


def test_a_histogram_counts_every_value_once():
    values = np.concatenate((np.random.default_rng(5).normal(1.0, 0.1, 500), [-5.0, 9.0]))
    lines = draw_histogram(values, label="e", mark=1.0).splitlines()
    assert sum(int(line.split()[-1]) for line in lines[1:]) == 502
    assert [line.split()[0] for line in lines if ">" in line] == ["1.00"]
    assert max(map(len, lines)) <= 78


@pytest.mark.parametrize("values", [[0.5], [0.5, 0.5], [1e-9, 2e-9, 1.0]])
def test_histograms_of_few_values(values):
    lines = draw_histogram(values, label="e", mark=1.0).splitlines()
    assert sum(int(line.split()[-1]) for line in lines[1:]) == len(values)
