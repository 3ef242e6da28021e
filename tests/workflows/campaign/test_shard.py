"""Parts of a sweep for job arrays: disjoint, complete, alike."""

from collections import Counter
from pathlib import Path

import pytest

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign import points as sweep_points
from chaincor.workflows.campaign.points import SweepPoints, shard
from chaincor.workflows.errors import SweepError

LENGTHS = [{"particles": n} for n in (10, 20, 50, 100)]
SPEEDS = [{"speed": 0.01 * k} for k in range(1, 26)]
TOLERANCES = [{"tolerance": t} for t in (1e-4, 1e-6)]
# The axis that sets the length is neither the first nor the last.
SCENES = SweepPoints({"potential": "lj"}, [SPEEDS, LENGTHS, TOLERANCES], Path())


def test_points_are_those_of_nested_loops():
    expected = [
        Scene(potential="lj", **speed, **length, **tolerance)
        for speed in SPEEDS
        for length in LENGTHS
        for tolerance in TOLERANCES
    ]
    assert len(SCENES) == 200
    assert list(SCENES) == expected
    assert (SCENES[57], SCENES[-1], SCENES[3:5]) == (expected[57], expected[-1], (*expected[3:5],))


@pytest.mark.parametrize("count", [1, 3, 7, 150])
def test_parts_are_disjoint_and_complete(count):
    parts = [shard(SCENES, number, count) for number in range(1, count + 1)]
    together = Counter(scene.sha256 for part in parts for scene in part)
    assert together == Counter(scene.sha256 for scene in SCENES)


def test_every_part_has_its_share_of_long_chains():
    # 25 different collisions of each length over 5 parts, dealt out in turn.
    for number in range(1, 6):
        part = shard(SCENES, number, 5)
        assert Counter(scene.particles for scene in part) == {10: 10, 20: 10, 50: 10, 100: 10}


def test_every_part_has_slow_and_fast_chains():
    # Were points dealt out in their order, each of five parts would have one speed of five.
    points = SweepPoints({}, [LENGTHS, SPEEDS[:5]], Path())
    for number in range(1, 6):
        assert len({scene.speed for scene in shard(points, number, 5)}) > 1


def test_tolerances_of_one_collision_stay_together():
    for number in range(1, 8):
        part = shard(SCENES, number, 7)
        assert len({scene.collision_sha256 for scene in part}) * 2 == len(part)


def test_a_sweep_without_axes_is_one_point():
    assert shard(SweepPoints({"particles": 7}, [], Path()), 1, 2) == (Scene(particles=7),)
    assert shard(SweepPoints({"particles": 7}, [], Path()), 2, 2) == ()


def test_only_the_points_of_a_part_are_made(monkeypatch):
    made = []
    monkeypatch.setattr(sweep_points, "Scene", lambda **fields: made.append(fields))
    lengths = [{"particles": 2 + k} for k in range(100)]
    speeds = [{"speed": 1e-3 * (1 + k)} for k in range(100)]
    part = shard(SweepPoints({}, [lengths, speeds], Path()), 100, 100)
    assert len(part) == len(made) == 100
    assert len({fields["particles"] for fields in made}) == 100, "one of each length"


def test_a_point_that_is_no_scene_is_named():
    lengths = [{"particles": 5}, {"particles": "many"}, {"particles": 10**400}]
    points = SweepPoints({}, [lengths], Path())
    assert points[0].particles == 5
    with pytest.raises(SceneError, match=r"point 2 \(particles = 'many'\)"):
        shard(points, 1, 1)


@pytest.mark.parametrize(("number", "count"), [(0, 3), (4, 3)])
def test_parts_that_do_not_exist_are_refused(number, count):
    with pytest.raises(SweepError):
        shard(SCENES, number, count)
