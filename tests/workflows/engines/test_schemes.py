"""Test the numbers of Verlet steps and the weights of extrapolated steps."""

from fractions import Fraction
from typing import get_args

import numpy as np
import pytest

from chaincor.lammps_inputs.schemes import COMPOSITIONS, StepSchemeName
from chaincor.workflows.engines.schemes import STEP_SCHEMES

EXTRAPOLATED = {name: each for name, each in STEP_SCHEMES.items() if each.extrapolated}


def test_every_scheme_that_numerics_can_name_is_there():
    names, further = map(get_args, get_args(StepSchemeName))
    assert set(COMPOSITIONS) == {*names}
    assert set(STEP_SCHEMES) == {*names, *further}


@pytest.mark.parametrize("name", EXTRAPOLATED)
def test_weights_cancel_every_even_power_below_the_order_and_no_more(name):
    weights, counts = EXTRAPOLATED[name].fractions
    order = int(name.removeprefix("extrapolated"))
    assert EXTRAPOLATED[name].order == order
    # The error of m Verlet steps is a series in (H/m)^2k. The sum of the weights is 1, and each
    # further weight cancels a power.
    assert len(counts) == order // 2
    for k in range(order // 2 + 1):
        terms = [
            Fraction(w) / Fraction(int(m)) ** (2 * k) for w, m in zip(weights, counts, strict=True)
        ]
        # Each weight is rounded to a double, by half a unit of the last digit.
        rounding = sum(abs(term) for term in terms) * Fraction(np.finfo(float).eps)
        left = abs(sum(terms) - (1 if k == 0 else 0))
        assert left <= rounding if k < order // 2 else left > 100 * rounding
