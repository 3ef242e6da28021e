"""Test error bars of chains at rest at neighbouring speeds, against runs 1000 times tighter."""

import numpy as np
import pytest

from benchmarks.bars.plain_scenes import compare_group

# Both runs round, so the benchmark also ignores smaller errors.
_ROUNDING = 2e-13


@pytest.mark.slow
@pytest.mark.parametrize("particles", [8, 14, 20])
def test_error_bars_of_medium_chains_hold(particles):
    random, judged = np.random.default_rng([53, particles]), []
    while len(judged) < 300:  # groups that rounding decides are empty
        judged += compare_group(random, [particles])
    outside = [(scene, bar, error) for scene, bar, error in judged if error > bar + _ROUNDING]
    assert outside == []
