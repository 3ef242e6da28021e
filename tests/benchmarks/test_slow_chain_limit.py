"""Test that the error bar of the limit of slow chains covers the form of the approach."""

import numpy as np
import pytest

from benchmarks.slow_chains.limit import (
    FORMS,
    LARGEST_RESIDUAL,
    STARTS,
    fitted,
    modulated_slopes,
    points,
)
from chaincor.analysis.slow_chains.curve import STEEP_LIMIT, STEEP_LIMIT_ERROR


def test_fits_that_describe_the_points_are_within_the_bar_of_the_limit():
    y, slope = points()
    forms = set()
    for form in FORMS:
        for start in STARTS:
            chosen = y >= start
            best, residual = fitted(y[chosen], slope[chosen], form)
            if residual <= LARGEST_RESIDUAL:
                forms.add(form)
                assert abs(best[0] - STEEP_LIMIT) <= STEEP_LIMIT_ERROR
    # More than one form describes the points, so the bar must cover them.
    assert {"ln t/t", "1/y"} <= forms


def test_limit_is_above_the_steepest_fronts():
    # C' rises from y = 60 on, but for the swing, which is 2e-4 there.
    slopes = [smooth for _, smooth in modulated_slopes().values()]
    assert np.all(np.diff(slopes) > 0.0)
    assert slopes[-1] < STEEP_LIMIT


@pytest.mark.parametrize("form", FORMS)
def test_fit_finds_the_limit_of_a_curve_of_its_form(form):
    y = np.array([40.0, 50.0, 60.0, 80.0, 120.0])
    t = (y / 2.0) ** 1.5 / 3.0
    slope = 0.4 - 0.05 * sum(term(y, t) for term in FORMS[form])
    best, residual = fitted(y, slope, form)
    # The least squares of five points are exact to rounding.
    assert best[0] == pytest.approx(0.4, abs=1e-10)
    assert residual < 1e-10
