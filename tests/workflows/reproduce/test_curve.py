"""Test that fits of curves return exact laws and minima, and textbook errors for scatter."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.curve import Curve, PowerLaw, find_minimum
from chaincor.workflows.reproduce.measurements import Answer, MeasuredPoint


def fit_power_law(x, y, exponent: float | None = None, errors=0.0) -> PowerLaw:
    x, y, bars = np.broadcast_arrays(x, y, errors)
    return Curve([None] * len(x), x, y, bars).power_law(exponent)


def test_exact_power_law_is_found_to_rounding():
    x = np.geomspace(0.01, 10.0, 7)
    fit = fit_power_law(x, 0.652 * x ** (-2.0 / 3.0))
    assert fit.exponent == pytest.approx(-2.0 / 3.0, abs=1e-13)
    assert fit.prefactor == pytest.approx(0.652, rel=1e-13)
    assert fit.exponent_error < 1e-13


def test_standard_error_is_that_of_linear_regression():
    rng = np.random.default_rng(1)
    x = np.geomspace(1.0, 100.0, 12)
    noise = 0.1 * rng.standard_normal(12)
    fit = fit_power_law(x, 2.0 * x**1.5 * np.exp(noise))
    (slope, _), covariance = np.polyfit(
        np.log(x), np.log(2.0) + 1.5 * np.log(x) + noise, 1, cov=True
    )
    assert fit.exponent == pytest.approx(slope)
    assert fit.exponent_error == pytest.approx(np.sqrt(covariance[0, 0]))


def test_fixed_exponent_gives_the_geometric_mean():
    x = np.array([1.0, 2.0, 4.0])
    fit = fit_power_law(x, np.array([2.0, 8.0, 4.0]) / x, exponent=-1.0)
    assert fit.prefactor == pytest.approx(4.0)


@pytest.mark.parametrize("y", [[1.0, -1.0, 2.0], [0.0, 1.0, 2.0], [np.nan, 1.0, 2.0]])
def test_numbers_that_are_not_positive_give_no_fit(y):
    assert np.isnan(fit_power_law([1.0, 2.0, 3.0], y).exponent)


def chains(lengths: list[int], power: float) -> Curve:
    """Return a curve of 1 - eta = 0.5 n^power for harmonic chains."""
    scenes = (Scene(potential="harmonic", particles=n, velocity=0.1) for n in lengths)
    found = (Answer({"restitution": 1.0 - 0.5 * n**power}) for n in lengths)
    points = [MeasuredPoint(s, None, answer) for s, answer in zip(scenes, found, strict=True)]
    return replace(Curve.of(points, "particles", "dissipation"), errors=np.zeros(len(points)))


def test_ranges_with_too_few_points_are_left_out():
    fits = chains([1, 2, 3, 10], -1.0).over([(1, 3), (5, 20)], Curve.power_law)
    assert [(fit.first, fit.last) for fit in fits] == [(1.0, 3.0)]


def test_minimum_of_a_parabola_in_the_logarithm():
    x = np.geomspace(0.1, 10.0, 9)
    y = 0.7 + 0.2 * np.log(x / 0.83) ** 2
    low = find_minimum(x, y)
    assert low.place == pytest.approx(0.83, rel=1e-9)
    assert low.value == pytest.approx(0.7, rel=1e-9)


def test_error_of_a_minimum_is_what_more_points_change():
    x = np.geomspace(0.1, 10.0, 9)
    exact = find_minimum(x, 0.7 + 0.2 * np.log(x / 0.83) ** 2)
    assert exact.place_error < 1e-9
    # A cubic term shifts the minimum of the parabola through five points.
    skew = find_minimum(x, 0.7 + 0.2 * np.log(x / 0.83) ** 2 + 0.03 * np.log(x / 0.83) ** 3)
    assert 1e-3 < skew.place_error < 0.25 * (x[5] - x[3])


def test_other_ranges_can_have_a_fixed_exponent():
    of = partial(Curve.power_law, exponent=-0.5)
    (fit,) = chains([1, 2, 4, 8], -0.5).over([(1, 8)], of)
    assert fit.prefactor == pytest.approx(0.5)
    assert fit.exponent == -0.5


def test_curve_without_a_minimum_has_none():
    x = np.geomspace(0.1, 10.0, 9)
    assert np.isnan(find_minimum(x, -x).place)


def test_bars_of_the_points_are_in_that_of_the_fit():
    x = np.array([1.0, 2.0, 4.0, 8.0])
    y = 3.0 * x**-0.5
    # There is no scatter. With ln x spaced by ln 2, the weights of the fit are (-3, -1, 1, 3)/(10
    # ln 2), and an error of 1 % in a point changes the power by 0.01 times its weight.
    fit = fit_power_law(x, y, errors=0.01 * y * np.array([1.0, 0.0, 0.0, 1.0]))
    assert fit.exponent_error == pytest.approx(0.01 * 6.0 / (10.0 * np.log(2.0)))
    mean = fit_power_law(x, y, exponent=-0.5, errors=0.01 * y)
    assert mean.prefactor_error == pytest.approx(0.01 * 3.0)
