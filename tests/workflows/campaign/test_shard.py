"""Test that the parts of a sweep for job arrays are disjoint, complete and equal in size."""

from collections import Counter
from pathlib import Path

import pytest

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign import points as sweep_points
from chaincor.workflows.campaign.axes import Spaced, ValuesAxis, spaced
from chaincor.workflows.campaign.cells import WINDOW, Cells, scattered
from chaincor.workflows.campaign.points import SweepPoints
from chaincor.workflows.errors import SweepError

LENGTHS = [{"particles": n} for n in (10, 20, 50, 100)]
SPEEDS = [{"speed": 0.01 * k} for k in range(1, 26)]
TOLERANCES = [{"tolerance": t} for t in (1e-4, 1e-6)]
# The axis that sets the length is neither the first nor the last.
SCENES = SweepPoints({"potential": "lj"}, [SPEEDS, LENGTHS, TOLERANCES], Path())


def shard(points, number, count):
    cells = Cells(points, number, count)
    return [points[k] for k in cells.numbers(0, len(cells))]


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
    # There are 25 different collisions of each length, which are dealt to the 5 parts.
    for number in range(1, 6):
        part = shard(SCENES, number, 5)
        assert Counter(scene.particles for scene in part) == {10: 10, 20: 10, 50: 10, 100: 10}


def test_every_part_has_slow_and_fast_chains():
    # If points were assigned in their order, each of the five parts would have a single speed.
    points = SweepPoints({}, [LENGTHS, SPEEDS[:5]], Path())
    for number in range(1, 6):
        assert len({scene.speed for scene in shard(points, number, 5)}) > 1


def test_tolerances_of_one_collision_stay_together():
    for number in range(1, 8):
        part = shard(SCENES, number, 7)
        assert len({scene.collision_sha256 for scene in part}) * 2 == len(part)


def test_a_sweep_without_axes_is_one_point():
    assert shard(SweepPoints({"particles": 7}, [], Path()), 1, 2) == [Scene(particles=7)]
    assert shard(SweepPoints({"particles": 7}, [], Path()), 2, 2) == []


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


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 16, 17, 1000])
def test_scattering_is_a_permutation(size):
    assert sorted(scattered(k, size) for k in range(size)) == [*range(size)]


def test_equal_values_of_an_axis_are_one_collision():
    points = SweepPoints({}, [[{"speed": 0.1}, {"speed": 0.2}, {"speed": 0.1}], LENGTHS], Path())
    parts = [Cells(points, number, 3) for number in (1, 2, 3)]
    assert sum(map(len, parts)) == 8
    assert sum(part.number_of_points for part in parts) == 12
    keys = [{points[k].sha256 for k in part.numbers(0, len(part))} for part in parts]
    assert sum(map(len, keys)) == len(set.union(*keys)) == 8


def test_a_sweep_of_any_size_is_divided_without_its_points():
    speeds = ValuesAxis("speed", spaced(0.01, 1.0, 10**9, log=True))
    points = SweepPoints({}, [speeds, LENGTHS, TOLERANCES], Path())
    parts = [Cells(points, number, 10**6) for number in (1, 77, 10**6)]
    assert [len(part) for part in parts] == [4000] * 3
    assert parts[0].number_of_points == 8000
    found = [{*part.numbers(0, 50)} for part in parts]
    assert len(set.union(*found)) == 300
    first = next(Cells(points).windows())
    assert len(first) == 2 * WINDOW
    assert {point.fields["particles"] for point in first} == {100}, "long chains come first"
    assert len({point.fields["speed"] for point in first}) == WINDOW


@pytest.mark.parametrize("log", [False, True])
def test_long_ranges_have_the_ends_and_the_numbers_of_short_ones(log):
    short = spaced(0.01, 0.7, 1001, log=log)
    long = spaced(0.01, 0.7, 1001 * 10_000 - 9_999, log=log)
    assert isinstance(long, Spaced)
    assert (long[0], long[-1]) == (pytest.approx(0.01, rel=1e-15), 0.7)
    # Every 10000th value of the long range is compared; the power has a rounding error of some
    # 1e-16.
    assert long[::10_000] == pytest.approx(short, rel=1e-14)


def test_mistakes_are_found_before_a_large_sweep_begins():
    speeds = ValuesAxis("speed", spaced(0.01, 1.0, 10**9, log=False))
    points = SweepPoints({}, [[{"particles": 5}, {"particles": "many"}], speeds], Path())
    with pytest.raises(SceneError, match=r"point 1000000001 \(particles = 'many'"):
        points.check()
    slow = SweepPoints({}, [ValuesAxis("speed", spaced(1.0, -1.0, 10**9, log=False))], Path())
    with pytest.raises(SceneError, match=r"point 1000000000 \(speed = -1.0"):
        slow.check()
