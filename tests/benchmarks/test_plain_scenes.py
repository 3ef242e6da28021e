"""Test error bars of unstrained chains against runs whose tolerance is 1000 times smaller."""

import numpy as np
import pytest

from benchmarks.bars.plain_scenes import compare_group

# Rounding errors of the two runs are below this limit.
_ROUNDING = 2e-13


@pytest.mark.slow
@pytest.mark.parametrize("particles", [8, 14, 20])
def test_error_bars_of_medium_chains_hold(particles):
    random, judged = np.random.default_rng([53, particles]), []
    while len(judged) < 300:  # if rounding decides the contacts, the group is empty
        judged += compare_group(random, [particles])
    outside = [(scene, bar, error) for scene, bar, error in judged if error > bar + _ROUNDING]
    assert outside == []
