import numpy as np
import pytest

from chaincor.analysis.collision_frames import find_moving_start, find_start

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
    assert find_start(v, EXACT[: v.size]) == (kind, speed)


def test_rounded_velocities_are_equal_within_their_rounding():
    v = np.array([-0.333333, -0.333333, -0.333334, -0.333333])
    assert find_start(v, np.full(4, 5e-7))[0] == "incoming"
    assert find_start(v, EXACT)[0] == "late"


@pytest.mark.parametrize(
    ("velocities", "at_wall", "kind"),
    [
        ([-0.7, -0.4, -0.4], False, "moving"),
        ([-0.7, -0.4, -0.4], True, "moving"),
        ([0.7, -0.4, -0.4], True, "turned"),
        # A particle away from the wall cannot just have been reflected. If the momentum has
        # changed, the particle was reflected earlier.
        ([0.7, -0.4, -0.4], False, "late"),
        ([0.6, -0.4, -0.4], True, "late"),
    ],
)
def test_a_chain_with_inner_motion_is_known_by_its_momentum(velocities, at_wall, kind):
    masses = np.array([1.0, 2.0, 2.0])
    assert find_moving_start(np.array(velocities), masses, 0.46, 1e-15, at_wall) == kind
