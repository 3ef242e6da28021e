"""Test the slope of the curve of slow chains for steep fronts, and that no fit extrapolates it."""

import numpy as np
import pytest

from benchmarks.slow_chains.limit import (
    FORMS,
    LARGEST_RESIDUAL,
    STARTS,
    STEEPEST,
    fitted,
    modulated_slopes,
    points,
    predicted,
    step_slopes,
)
from chaincor.analysis.slow_chains.curve import STEEP_LIMIT, STEEP_LIMIT_ERROR


def test_fits_that_describe_the_points_fail_at_the_steepest_front():
    steepest, computed = STEEPEST
    y, slope = points()
    forms = set()
    for form in FORMS:
        for start in STARTS:
            chosen = y >= start
            best, residual = fitted(y[chosen], slope[chosen], form)
            if residual <= LARGEST_RESIDUAL:
                forms.add(form)
                # Two grids of the steepest front differ by 1e-5.
                assert predicted(steepest, form, best) > computed + 1e-4
    # More than one form fits the points; the fits do not select one.
    assert {"ln t/t", "1/y"} <= forms


def test_steepest_fronts_have_the_slope_of_the_page():
    # C' of the steepest fronts is within a tenth of the assumed change beyond them.
    for slope in (points()[1][-1], STEEPEST[1]):
        assert slope == pytest.approx(STEEP_LIMIT, abs=0.1 * STEEP_LIMIT_ERROR)


def test_step_and_modulated_start_agree_where_both_were_computed():
    step, modulated = step_slopes(), modulated_slopes()
    common = sorted(step.keys() & modulated.keys())
    assert common == [60.0, 100.0, 160.0, 240.0]
    for y in common:
        # The modulated wave is the first term of an expansion in 1/t. The factor 0.0040 is the mean
        # of y = 60 and 100. The way back is known to 4e-5, the size of the correction by its grids.
        excess = modulated[y][0] - step[y][0]
        assert excess == pytest.approx(0.0040 * 3.0 / (y / 2.0) ** 1.5, abs=4e-5)
    # Without the phase of the wave train, the slope of the modulated start is smaller by 3.4e-4 at
    # y = 160.
    assert step[160.0][0] == pytest.approx(0.37454, abs=2e-5)


@pytest.mark.parametrize("form", FORMS)
def test_fit_finds_the_limit_of_a_curve_of_its_form(form):
    y = np.array([40.0, 50.0, 60.0, 80.0, 120.0])
    t = (y / 2.0) ** 1.5 / 3.0
    slope = 0.4 - 0.05 * sum(term(y, t) for term in FORMS[form])
    best, residual = fitted(y, slope, form)
    # The least squares of five points are exact to rounding.
    assert best[0] == pytest.approx(0.4, abs=1e-10)
    assert residual < 1e-10
