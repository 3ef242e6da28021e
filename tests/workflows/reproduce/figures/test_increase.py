"""Test powers of the increase in a common range and in the limit of low speed."""

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.claims import Verdict
from chaincor.workflows.reproduce.curve import Curve
from chaincor.workflows.reproduce.figures.increase import (
    CLAIMS,
    FIT_RANGE,
    RANGES,
    increase_of,
    limit_power,
    local_powers,
    shortening_of,
)
from chaincor.workflows.reproduce.measurements import Answer, MeasuredPoint, Measurements
from chaincor.workflows.reproduce.plan import QUICK

SPEEDS = np.geomspace(0.002, 0.2, 21)


def point(scene: Scene, eta: float) -> MeasuredPoint:
    result = {
        "restitution": eta,
        "restitution_error": 1e-12,
        "tolerance_met": True,
        "contacts": 87,
        "last_contact_time": 200.0,
    }
    return MeasuredPoint(scene, None, Answer(result))


def increase(order: int, curve) -> Curve:
    scenes = [
        Scene(potential="power", power_order=order, power_c=(-1.0) ** order, particles=100, speed=u)
        for u in SPEEDS
    ]
    chains = [point(scene, 0.97 - curve(scene.speed)) for scene in scenes]
    return increase_of(chains, point(Scene(potential="harmonic", velocity=0.1), 0.97))


@pytest.mark.parametrize("order", [4, 6])
def test_limit_is_found_where_no_range_gives_it(order):
    """Use a next term that is smaller by v^(r-2), so that every range gives too large a power."""
    m = order - 2
    found = increase(order, lambda u: 0.4 * u**m * (1.0 + (u / 0.02) ** m))
    limit = limit_power(found, order)
    first = local_powers(found)[1][0]
    # The straight line leaves out terms of second order in (v/0.02)^m, below 0.06 here.
    assert abs(limit.value - m) <= 0.5 * abs(first - m)
    assert abs(limit.value - m) <= 3.0 * limit.error
    assert found.between(*FIT_RANGE).power_law().exponent > m + 0.3


def test_fits_are_over_one_range_its_halves_and_on_to_the_end_whatever_the_numbers():
    for curve in (lambda u: u**1.34, lambda u: u**2.09):
        fits = increase(4, curve).over(RANGES, Curve.power_law)
        ends = [(fit.first, fit.last) for fit in fits]
        # The ends agree within one of the speeds, which are a factor of 1.26 apart.
        assert ends[0] == pytest.approx(FIT_RANGE, rel=0.26)
        assert ends[1][0] == pytest.approx(FIT_RANGE[0], rel=0.26)
        assert ends[2][1] == pytest.approx(FIT_RANGE[1], rel=0.26)
        assert ends[3] == pytest.approx((ends[0][0], SPEEDS[-1]))
        assert len(ends) == 4


@pytest.mark.parametrize(("kink", "verdict"), [(0.1, Verdict.UNDECIDED), (9.0, Verdict.CORRECTED)])
def test_slope_that_the_points_beyond_the_range_give_is_undecided(kink, verdict):
    """Leave r = 5 undecided: a range up to 0.2 v* gives the 3.14 that figure 6 prints."""
    points = increase(5, lambda u: 20.0 * u**3 * max(1.0, u / kink)).points
    zero = point(Scene(potential="harmonic", velocity=0.1), 0.97)
    measured = Measurements(QUICK, (), {"increase": (*points, zero)})
    (claim,) = (claim for claim in CLAIMS if claim.key == "printed power r = 5")
    found = claim.found(measured)
    assert found.value == pytest.approx(3.0, abs=0.01)
    assert claim.judge(found).verdict is verdict


def test_dissipation_that_falls_has_no_power():
    assert np.isnan(limit_power(increase(4, lambda u: -0.4 * u**2), 4).value)


def test_too_few_speeds_give_no_limit():
    found = increase(4, lambda u: u**2)
    few = found.between(SPEEDS[0], SPEEDS[2])
    assert len(few.points) == 3
    assert np.isnan(limit_power(few, 4).value)


def test_shortening_of_contact_times_is_bounded_by_what_the_engines_differ_by():
    def answer(time):
        return Answer({"restitution": 0.9, "restitution_error": 1e-12, "last_contact_time": time})

    def both(scene, time):
        return MeasuredPoint(scene, answer(time + 1e-7), answer(time))

    scenes = [
        point(Scene(potential="power", power_order=4, power_c=1.0, speed=u), 0.9) for u in SPEEDS
    ]
    chains = [both(p.scene, 200.0 - 3.0 * p.speed**2) for p in scenes]
    zero = both(Scene(potential="harmonic", velocity=0.1), 200.0)
    found = shortening_of(chains, zero)
    np.testing.assert_allclose(found.y, 3.0 * SPEEDS**2, atol=1e-12)
    # Each time has an error of 1e-7; times near 200 are rounded to 3e-14.
    np.testing.assert_allclose(found.errors, 2e-7, rtol=1e-6)
    limit = limit_power(found, 4)
    assert abs(limit.value - 2.0) < 1e-6 + limit.error
