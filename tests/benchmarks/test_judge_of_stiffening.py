"""Test bonds that stiffen like powers of the strain against a judge."""

import math

import numpy as np
import pytest

from benchmarks.judge.stiffening import Case, draw, judge, try_case
from chaincor import collide
from chaincor.workflows.engines.reference import hard_sphere

# An integrator of another kind computed these restitutions; the last digits are rounded.
KNOWN = [
    (Case("power", 4.0, 1e18, 1.0, 20, 0.1), 0.8393228),
    (Case("power", 4.0, 1e16, 1.0, 5, 0.1), 0.997003),
    (Case("formula", 4.0, 1.0, 1e-8, 3, 0.1), 0.999699),
    (Case("one-sided", 2.5, 0.4, 0.0, 18, 0.15), 0.845564),
    (Case("two-sided", 4.0, 1.0, 0.0, 5, 0.1), 0.9970034776),
]


@pytest.mark.parametrize("case", [case for case, _ in KNOWN[:2]], ids=["20", "5"])
def test_a_bond_that_stiffens_like_a_power_is_no_hard_sphere(case):
    assert hard_sphere.deviation(case.scene().problem) == math.inf


@pytest.mark.parametrize(("case", "right"), KNOWN, ids=lambda each: getattr(each, "kind", ""))
def test_the_judge_knows_the_published_values(case, right):
    value, error = judge(case)
    assert error < 1e-8
    assert abs(value - right) <= 5e-7  # the shortest has six digits


@pytest.mark.slow  # compiles a loop for each bond
@pytest.mark.parametrize("case", [case for case, _ in KNOWN], ids=lambda case: case.kind)
def test_known_bonds_are_within_their_bars(case):
    found = collide(case.scene())
    value, error = judge(case)
    assert abs(found.restitution - value) <= found.restitution_error + 3.0 * error
    assert found.restitution_error <= case.tolerance


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_no_random_bond_is_outside_its_bar(seed):
    verdict, text = try_case(draw(np.random.default_rng([5, seed])))
    assert verdict != "outside", text
