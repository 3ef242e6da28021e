"""Test pictures of a free target, of unequal masses and of soft bodies."""

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.pictures.recording import (
    follow_to_the_end,
    record_motion,
    write_animation,
)
from chaincor.workflows.pictures.watch import moments

TARGET = Scene(particles=4, masses=[1, 2], target_particles=3, speed=0.5, engine="reference")
SOFT = Scene(particles=4, contact="power", contact_stiffness=2.0, engine="reference")


def test_frames_show_both_bodies():
    frames = record_motion(TARGET, 0.25).frames
    u, v = frames.along_x()
    assert (frames.targets, u.shape) == (3, (len(frames.times), 7))
    # Particles are ordered from the target's far end. The two in contact are neighbours, at the
    # same initial position.
    assert u[0].tolist() == [0.0] * 7
    # Bonds and the contact conserve momentum, which is 6 v0.
    masses = TARGET.line.masses
    np.testing.assert_allclose(v @ masses, -6.0 * TARGET.impact_velocity, rtol=1e-12)
    assert frames.until(1.0).target_velocities.shape == (5, 3)


@pytest.mark.slow
def test_the_headings_end_with_the_restitution():
    for scene in (TARGET, SOFT):
        result = collide(scene, tolerance=1e-6)
        outcome = follow_to_the_end(result)
        *_, last = moments(scene, outcome, 80)
        heading, *rows = last.plain.splitlines()
        assert f"contacts {result.contacts:3d} " in heading
        assert f"translation {100.0 * result.restitution:5.1f} %" in heading
        assert any(row.startswith("█") for row in rows) == (scene is SOFT)
        drawn = rows[-1].count("●")
        assert drawn == (4 if scene is SOFT else 7)


@pytest.mark.slow
def test_a_moving_picture_of_both_bodies(tmp_path):
    result = collide(TARGET, tolerance=1e-4)
    write_animation(result, str(tmp_path / "m.gif"), 3)
    assert (tmp_path / "m.gif").read_bytes().startswith(b"GIF89a")
