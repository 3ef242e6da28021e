"""Compositions: symmetric, of weight one, and of the order they claim on a pendulum."""

import math

import numpy as np
import pytest

from chaincor.workflows.engines.compositions import COMPOSITIONS

each = pytest.mark.parametrize("scheme", COMPOSITIONS.values(), ids=COMPOSITIONS)


@each
def test_palindromes_of_weight_one(scheme):
    assert scheme.weights == scheme.weights[::-1]
    # The centre is 1 minus the rest; adding the terms in another order costs a unit per term.
    assert math.fsum(scheme.weights) == pytest.approx(1.0, abs=scheme.stages * 2.3e-16)


@each
@pytest.mark.parametrize("power", [3, 5, 7])
def test_odd_powers_of_the_weights_cancel(scheme, power):
    # Necessary for a symmetric composition of order 4, 6, 8: sums of w^3, w^5, w^7 vanish. The
    # published weights have 26 digits; doubles leave a few units of 1e-16 a term.
    if power < scheme.order:
        assert math.fsum(w**power for w in scheme.weights) == pytest.approx(0.0, abs=1e-14)
    else:
        assert abs(math.fsum(w**power for w in scheme.weights)) > 1e-4


def test_stages():
    assert {name: c.stages for name, c in COMPOSITIONS.items()} == {
        "verlet": 1,
        "order4": 5,
        "order6": 9,
        "order8": 17,
    }


def pendulum(scheme, steps, duration=6.0):
    """Return the angle of a pendulum that starts at rest at one radian."""
    angle, speed, force = 1.0, 0.0, -math.sin(1.0)
    for _ in range(steps):
        for weight in scheme.weights:
            h = weight * duration / steps
            speed += 0.5 * h * force
            angle += h * speed
            force = -math.sin(angle)
            speed += 0.5 * h * force
    return angle


@each
def test_order_on_a_pendulum(scheme):
    # Steps large enough that the error stays above rounding, 1e-13, also at order 8.
    steps = np.unique(np.geomspace(12, 36, 7).astype(int))
    truth = pendulum(COMPOSITIONS["order8"], 400)
    errors = [abs(pendulum(scheme, int(n)) - truth) for n in steps]
    slope = np.polyfit(np.log(6.0 / steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(scheme.order, abs=0.5)
