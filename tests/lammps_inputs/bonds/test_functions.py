"""Test the series against independent decimal arithmetic with 60 digits."""

import sys
from decimal import Decimal, localcontext

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.functions import expm1_minus_x, x_minus_log1p

# At |x| = 0.1, where the code changes from one form to the other, each form has an error of at most
# about 20 units in the last place.
TOLERANCE = 25.0 * sys.float_info.epsilon
MAGNITUDES = np.geomspace(1e-150, 0.9, 400)
ARGUMENTS = np.concatenate([MAGNITUDES, -MAGNITUDES, [0.1, -0.1, np.nextafter(0.1, 0.0)]])


def exact(function, x):
    with localcontext() as context:
        context.prec = 400  # x^2/2 of 1e-150 appears only after 300 digits of exp(x)
        value = function(Decimal(float(x)))
    return float(value)


@pytest.mark.parametrize(
    ("series", "definition"),
    [
        (x_minus_log1p, lambda x: x - (1 + x).ln()),
        (expm1_minus_x, lambda x: x.exp() - 1 - x),
    ],
)
def test_keeps_all_digits(series, definition):
    expected = np.array([exact(definition, x) for x in ARGUMENTS])
    assert series(ARGUMENTS) == pytest.approx(expected, rel=TOLERANCE, abs=0.0)


@pytest.mark.parametrize("series", [x_minus_log1p, expm1_minus_x])
def test_zero_shape_and_large_arguments(series):
    assert series(0.0) == 0.0
    assert series(np.zeros((2, 3))).shape == (2, 3)
    assert series(30.0) == pytest.approx(
        {"x_minus_log1p": 30.0 - np.log(31.0), "expm1_minus_x": np.exp(30.0) - 31.0}[
            series.__name__
        ],
        rel=1e-14,
    )
