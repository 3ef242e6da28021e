"""Test the frames for pictures, and the animation of `run --animate`."""

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.pictures import recording
from chaincor.workflows.pictures.recording import record_motion


@pytest.mark.parametrize("fields", [{"potential": "harmonic"}, {"potential": "lj", "speed": 0.8}])
def test_frames_are_regular_and_end_as_the_collision_does(fields):
    scene = Scene(particles=8, engine="reference", **fields)
    outcome = record_motion(scene, 0.25)
    frames = outcome.frames
    assert np.diff(frames.times)[:-1] == pytest.approx(0.25, abs=1e-9)
    exact = collide(scene, tolerance=1e-8)
    # The motion has a tolerance of 1e-6. The mean velocity does not change after the last contact,
    # so that the last frame gives eta.
    assert (frames.velocities[-1].mean() / scene.impact_velocity) ** 2 == pytest.approx(
        exact.restitution, abs=3e-6
    )


@pytest.mark.slow
def test_run_writes_a_moving_picture(tmp_path, chaincor, monkeypatch):
    # Three pictures test the same as a hundred in a thirtieth of the time.
    monkeypatch.setattr(recording.write_animation, "__defaults__", (3,))
    file = tmp_path / "motion.gif"
    scene = ("--particles", "5", "--engine", "reference")
    status, _, err = chaincor("run", *scene, "--animate", file)
    assert status == 0, err
    assert file.read_bytes().startswith(b"GIF89a")


def test_another_ending_is_refused_before_anything_runs(chaincor):
    status, _, err = chaincor("run", "--animate", "motion.avi")
    assert status == 2
    assert "Give a name that ends in .gif or .mp4" in err
