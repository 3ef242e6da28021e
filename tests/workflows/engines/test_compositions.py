"""Test that compositions are symmetric, have weight one, and have their order on a pendulum."""

import math

import mpmath
import numpy as np
import pytest
from mpmath import mpf

from chaincor.lammps_inputs.schemes import COMPOSITIONS

each = pytest.mark.parametrize("scheme", COMPOSITIONS.values(), ids=COMPOSITIONS)


@each
def test_palindromes_of_weight_one(scheme):
    assert scheme.weights == scheme.weights[::-1]
    # The central weight is 1 minus the others. Summation in another order adds a rounding error per
    # term.
    assert math.fsum(scheme.weights) == pytest.approx(1.0, abs=len(scheme.weights) * 2.3e-16)


@each
@pytest.mark.parametrize("power", [3, 5, 7, 9])
def test_odd_powers_of_the_weights_cancel(scheme, power):
    # A symmetric composition of order 4, 6, 8, 10 requires that sums of w^3, w^5, w^7, w^9 vanish.
    # The published weights have 26 digits; rounding to doubles gives a few 1e-16 per term.
    if power < scheme.order:
        assert math.fsum(w**power for w in scheme.weights) == pytest.approx(0.0, abs=1e-14)
    else:
        assert abs(math.fsum(w**power for w in scheme.weights)) > 1e-4


def pendulum(scheme, steps, duration=6.0):
    """Return the angle of a pendulum that starts at rest at one radian."""
    # With 25 digits, rounding is far below the error at any order.
    angle, speed, force = mpf(1), mpf(0), -mpmath.sin(1)
    for _ in range(steps):
        for weight in scheme.weights:
            h = mpf(weight) * duration / steps
            speed += 0.5 * h * force
            angle += h * speed
            force = -mpmath.sin(angle)
            speed += 0.5 * h * force
    return angle


@each
def test_order_on_a_pendulum(scheme):
    # The reference has the highest order p and a third of the finest step. Its error is 3^-p, at
    # most 2e-4, times the smallest error here.
    counts = np.unique(np.geomspace(12, 36, 7).astype(int))
    with mpmath.workdps(25):
        reference_value = pendulum(max(COMPOSITIONS.values(), key=lambda one: one.order), 108)
        errors = [float(abs(pendulum(scheme, int(count)) - reference_value)) for count in counts]
    slope = np.polyfit(np.log(6.0 / counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(scheme.order, abs=0.5)
