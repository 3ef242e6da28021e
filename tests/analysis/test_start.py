import numpy as np
import pytest

from chaincor.analysis.start import find_start

EXACT = np.full(4, 1e-17)


@pytest.mark.parametrize(
    ("velocities", "kind", "speed"),
    [
        ([-0.5, -0.5, -0.5, -0.5], "incoming", 0.5),
        ([0.5, -0.5, -0.5, -0.5], "reflected", 0.5),
        ([0.4, -0.5, -0.5, -0.5], "late", None),
        ([0.5, -0.4, -0.5, -0.5], "late", None),
        ([0.5, 0.5, 0.5, 0.5], "late", None),
        ([0.0, 0.0, 0.0, 0.0], "late", None),
        ([-0.25], "incoming", 0.25),
        ([0.25], "reflected", 0.25),
    ],
)
def test_first_frames(velocities, kind, speed):
    v = np.array(velocities)
    start = find_start(v, EXACT[: v.size])
    assert (start.kind, start.impact_velocity) == (kind, speed)


def test_rounded_velocities_are_equal_within_their_rounding():
    v = np.array([-0.333333, -0.333333, -0.333334, -0.333333])
    assert find_start(v, np.full(4, 5e-7)).kind == "incoming"
    assert find_start(v, EXACT).kind == "late"
