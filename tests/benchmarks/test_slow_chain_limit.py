"""Test that the error bar of the limit of slow chains covers the form of the approach."""

import numpy as np
import pytest

from benchmarks.slow_chains.limit import FORMS, STARTS, TABLE, fitted, points
from chaincor.analysis.slow_chains.curve import STEEP_LIMIT, STEEP_LIMIT_ERROR


@pytest.mark.parametrize("form", FORMS)
def test_every_fit_is_within_the_bar_of_the_limit(form):
    y, slope = points()
    for start in STARTS:
        chosen = y >= start
        limit = fitted(y[chosen], slope[chosen], form)[0][0]
        assert abs(limit - STEEP_LIMIT) <= STEEP_LIMIT_ERROR


def test_limit_is_above_the_steepest_fronts():
    variable, _, loss = np.loadtxt(TABLE, delimiter=",", skiprows=1).T
    assert (loss / variable).max() < STEEP_LIMIT


@pytest.mark.parametrize("form", FORMS)
def test_fit_finds_the_limit_of_a_curve_of_its_form(form):
    y = np.array([40.0, 50.0, 60.0, 80.0, 120.0])
    t = (y / 2.0) ** 1.5 / 3.0
    slope = 0.4 - 0.05 * sum(term(y, t) for term in FORMS[form])
    best, residual = fitted(y, slope, form)
    # The least squares of five points are exact to rounding.
    assert best[0] == pytest.approx(0.4, abs=1e-10)
    assert residual < 1e-10
