"""Parts of a sweep for job arrays: disjoint, complete, alike."""

from collections import Counter

import pytest

from lammps_inputs.scene import Scene
from workflows.errors import SweepError
from workflows.sweep_file import shard

SCENES = [
    Scene(particles=n, speed=0.01 * k, tolerance=t)
    for n in (10, 20, 50, 100)
    for k in range(1, 26)
    for t in (1e-4, 1e-6)
]


@pytest.mark.parametrize("count", [1, 3, 7, 150])
def test_parts_are_disjoint_and_complete(count):
    parts = [shard(SCENES, number, count) for number in range(1, count + 1)]
    together = Counter(scene.sha256 for part in parts for scene in part)
    assert together == Counter(scene.sha256 for scene in SCENES)


def test_every_part_has_its_share_of_long_chains():
    # 25 different collisions of each length over 5 parts, dealt out in turn.
    for number in range(1, 6):
        lengths = Counter(scene.particles for scene in shard(SCENES, number, 5))
        assert lengths == {10: 10, 20: 10, 50: 10, 100: 10}


def test_tolerances_of_one_collision_stay_together():
    for number in range(1, 8):
        part = shard(SCENES, number, 7)
        assert len({scene.collision_sha256 for scene in part}) * 2 == len(part)


def test_parts_do_not_depend_on_the_order_of_the_points():
    assert set(shard(SCENES[::-1], 2, 7)) == set(shard(SCENES, 2, 7))


@pytest.mark.parametrize(("number", "count"), [(0, 3), (4, 3)])
def test_parts_that_do_not_exist_are_refused(number, count):
    with pytest.raises(SweepError):
        shard(SCENES, number, count)
