"""Test that both plans have the scenes for the paper's figures."""

from itertools import product

import pytest

from chaincor.workflows.reproduce.paper import studies
from chaincor.workflows.reproduce.plan import FULL, PAPER_SIZE_SPEEDS, QUICK


@pytest.mark.parametrize("plan", [QUICK, FULL], ids=lambda plan: plan.name)
def test_plan_covers_the_figures(plan):
    assert len(plan.curve_speeds) >= 25
    assert (plan.curve_speeds[0], plan.curve_speeds[-1]) == (0.01, 10.0)
    assert max(plan.sizes) >= 1000
    assert max(max(sizes) for sizes in plan.far_sizes.values()) >= 10_000
    assert {2, 19, 20, 100, 500} <= set(plan.harmonic_sizes)
    by_key = {study.key: study.all_scenes for study in studies(plan)}
    lengths = {(s.speed, s.particles) for s in by_key["sizes"]}
    assert lengths >= set(product(PAPER_SIZE_SPEEDS, plan.sizes))
    harmonic = {s.particles for s in by_key["harmonic_sizes"]}
    assert harmonic == {*plan.harmonic_sizes, *plan.harmonic_far_sizes}
    for scenes in by_key.values():
        assert len(set(scenes)) == len(scenes)


def test_every_increase_exceeds_its_error_bar():
    # At low speed, the increase is about 0.5 u, 1.9 u^2 and 5 u^3 (n = 100). The tolerance is at
    # most 2 % of the increase.
    for order, factor in ((3, 0.4), (4, 1.9), (5, 5.0)):
        for plan in (QUICK, FULL):
            smallest = factor * min(plan.increase_speeds[order]) ** (order - 2)
            assert plan.increase_tolerances[order] <= 0.02 * smallest
