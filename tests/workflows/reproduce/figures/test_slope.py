"""The limit of C: a known straight line comes back, and only points in the limit count."""

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.figures.slope import (
    BEYOND_HARMONIC,
    FASTEST,
    SlopeLimit,
    describe_limits,
    scaled_speed,
    slope_limits,
    slow_long_chains,
)
from chaincor.workflows.reproduce.measurements import Answer, Measurements, Point
from chaincor.workflows.reproduce.plan import QUICK

SPEEDS = (0.005, 0.01, 0.02, 0.04, 0.08, 0.1)
LENGTHS = (50, 100, 1000, 3000)


def measurements(dissipation):
    points = tuple(
        Point(
            Scene(potential="lj", particles=n, speed=u),
            None,
            Answer({"restitution": 1.0 - dissipation(n, u), "restitution_error": 1e-8}),
        )
        for n in LENGTHS
        for u in (*SPEEDS, 0.4)
    )
    return Measurements(QUICK, (), {"slopes": points, "sizes": points})


def test_line_of_chords_gives_its_limit():
    found = slope_limits(measurements(lambda n, u: 0.97 * u - 1.2 * u**2))
    assert {limit.least_scaled_speed for limit in found} == set(BEYOND_HARMONIC)
    assert {limit.fastest for limit in found} <= set(FASTEST)
    for limit in found:
        assert limit.value == pytest.approx(0.97, abs=1e-10)


def test_short_and_fast_chains_do_not_count():
    """Where the line does not hold, 1 - eta is absurd: it must leave no trace."""

    def dissipation(n, u):
        inside = n >= 100 and u <= FASTEST[-1] and u * n ** (2.0 / 3.0) >= min(BEYOND_HARMONIC)
        return 0.97 * u - 1.2 * u**2 if inside else 0.9

    for limit in slope_limits(measurements(dissipation)):
        assert limit.value == pytest.approx(0.97, abs=1e-10)


def test_points_of_two_studies_count_once():
    points = slow_long_chains(measurements(lambda n, u: u))
    assert len(points) == 3 * len(SPEEDS)
    scaled = [scaled_speed(p) for p in points]
    assert scaled == sorted(scaled)


def test_fits_that_exclude_each_other_give_a_range():
    limits = [SlopeLimit(0.976, 0.008, 3.5, 0.12, 12), SlopeLimit(1.015, 0.011, 5.0, 0.31, 7)]
    assert describe_limits(limits) == (
        "about 1.00, between 0.97 and 1.03 as the cuts have it (2 straight lines in v₀ through "
        "the points with (v₀/v*) n^(2/3) above 3.5 or 5 and v₀/v* up to 0.12 or 0.31)"
    )


def test_bars_of_points_are_in_that_of_the_limit():
    """Without scatter the bar is what the points allow: more for slow chains, by 1/v0."""
    (first, *_) = slope_limits(measurements(lambda n, u: 0.97 * u - 1.2 * u**2))
    # Bars of 1e-8 over speeds of 0.05 and below; the fit has about as many points as the factor.
    assert 1e-8 / 0.31 < first.error < 1e-5
