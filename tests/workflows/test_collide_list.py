"""Test that collide returns results of several scenes in order, for every executor."""

import pytest

from chaincor.lammps_inputs.errors import InputError, SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign import carry_out
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import CostError, RunError
from tests.interrupting import interrupted

SCENES = [Scene(particles=n, engine="reference") for n in (7, 3, 5)]


@pytest.fixture(params=["here", "processes"])
def place(request, monkeypatch):
    if request.param == "processes":
        monkeypatch.setattr(carry_out, "SOONER_HERE", 0.0)


@pytest.mark.slow_cases
@pytest.mark.usefixtures("place")
def test_results_come_in_the_order_of_the_scenes():
    found = collide(iter(SCENES), 1e-5, workers=2)
    assert [result.particles for result in found] == [7, 3, 5]
    for result, scene in zip(found, SCENES, strict=True):
        assert result.restitution == collide(scene, 1e-5).restitution
        assert result.tolerance == 1e-5
        assert result.scene.sha256 == scene.replace(tolerance=1e-5).sha256


@pytest.mark.slow
@pytest.mark.usefixtures("place")
def test_those_of_a_kind_are_carried_out_together_and_are_what_they_are_alone():
    speeds = [0.1 + 0.01 * k for k in range(20)] + [1.5, 1.6]
    scenes = [Scene(particles=8, speed=speed, engine="reference") for speed in speeds]
    found = collide(scenes, workers=2)
    assert [result.speed for result in found] == pytest.approx(speeds)
    for scene, result in zip(scenes, found, strict=True):
        alone = collide(scene)
        assert result.restitution == alone.restitution
        assert result.contact_times.tolist() == alone.contact_times.tolist()


@pytest.mark.slow_cases
@pytest.mark.usefixtures("place")
def test_the_first_that_fails_is_named():
    # Particles of the harmonic chain cross in LAMMPS at this speed.
    scenes = [SCENES[1], Scene(potential="harmonic", particles=10, velocity=2.0)]
    with pytest.raises(RunError) as failed:
        collide(scenes, workers=2)
    assert failed.value.__notes__ == [f"scene 2 of 2: {scenes[1]!r}"]


@pytest.mark.slow_cases
def test_with_a_store_what_is_there_is_not_computed_again(tmp_path):
    path = tmp_path / "kept.sqlite"
    crossing = Scene(potential="harmonic", particles=5, velocity=0.9)
    first = collide([*SCENES, crossing], 1e-5, store=path, arrays=True, workers=1)
    for row, scene in zip(first, SCENES, strict=False):
        assert row.restitution == collide(scene, 1e-5).restitution
        assert len(row.arrays["velocities"]) == scene.particles
    assert (first[3].result, first[3].failure.name) == (None, "CrossingError")
    again = collide(SCENES[0], 1e-4, store=path, workers=1)
    assert [row.columns["finished"] for row in again] == [first[0].columns["finished"]]
    with pytest.raises(InputError, match="no effect without a store"):
        collide(SCENES, arrays=True)


def test_no_scene_at_all():
    assert collide([]) == []


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"particles": 5}, r"type dict was given instead of a scene\. .*Scene\(\*\*fields\)"),
        (
            "first.toml",
            r"type str was given instead of a scene. .* Scene.from_file\('first.toml'\)",
        ),
        (None, "None was given instead of a scene"),
        (5, "type int was given instead of a scene"),
        ([SCENES[0], {}], "type dict was given"),
        (Scene, r"the class Scene was given instead of a scene\. .* Scene\(\)"),
    ],
)
def test_what_is_no_scene_is_refused_in_one_line(given, message):
    with pytest.raises(InputError, match=message) as refused:
        collide(given)
    assert "\n" not in str(refused.value)


def test_what_cannot_be_is_refused_before_anything_runs(tmp_path):
    twice = SCENES[0].replace(arrays=tmp_path / "a.npz")
    with pytest.raises(InputError, match=r"in scenes 1 and 2\. Give each scene its own path"):
        collide([twice, twice])
    with pytest.raises(InputError, match="workers is 0"):
        collide(SCENES, workers=0)
    with pytest.raises(InputError, match="from 1 to 1000000"):
        collide(SCENES, workers=10**400)
    with pytest.raises(SceneError, match="tolerance is -1"):
        collide(SCENES, -1.0)
    with pytest.raises(CostError):
        collide([SCENES[0], Scene(particles=30000)], most_seconds=1.0)
    assert list(tmp_path.iterdir()) == []


# As in test_interrupted.py, the session imitates a notebook.
SESSION = """
import signal, traceback
from chaincor import Scene, collide

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    print("BEGINS", flush=True)
    try:
        collide([Scene(particles=30000, engine="reference")] * 3, workers=2)
    except KeyboardInterrupt as interrupt:
        frames = traceback.extract_tb(interrupt.__traceback__)
        print("FRAMES", len(frames), interrupt.__cause__, interrupt.__context__)
    small = [Scene(particles=n, tolerance=1e-4, engine="reference") for n in (3, 4)]
    print("GOES ON", len(collide(small)))
"""


@pytest.mark.slow
def test_stopping_ends_the_processes_and_the_session_goes_on(tmp_path):
    found = interrupted(tmp_path, SESSION, 5.0)
    assert found == "FRAMES 2 None None\nGOES ON 2\n"
