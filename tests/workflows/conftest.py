"""Collisions that cost nothing, for tests of what is done with them."""

from collections.abc import Callable

import numpy as np
import pytest

from lammps_inputs.scene import DEFAULT_TOLERANCE, Scene
from workflows.attempt import Attempt
from workflows.collision import collide
from workflows.result import Collision, ErrorBar


@pytest.fixture(scope="session")
def _template() -> Collision:
    return collide(Scene(potential="harmonic", particles=2, engine="reference"))


@pytest.fixture(scope="session")
def make_attempt(_template: Collision) -> Callable[..., Attempt]:
    """Return a function that makes an attempt with a result, without computing it."""
    from dataclasses import replace

    def make(scene: Scene, restitution: float = 0.5, error: float | None = None) -> Attempt:
        tolerance = None if scene.explicit else scene.tolerance or DEFAULT_TOLERANCE
        if error is None and tolerance is not None:
            error = 0.5 * tolerance
        collision = replace(
            _template,
            restitution=restitution,
            restitution_error=error,
            error_parts=ErrorBar(step=error, table=0.0, rounding=0.0),
            tolerance=tolerance,
            tolerance_met=None if tolerance is None else error <= tolerance,
            potential=scene.label,
            particles=scene.particles,
            engine=scene.engine,
            velocity=scene.impact_velocity,
            scene_sha256=scene.sha256,
            contact_times=np.array([0.0, restitution]),
        )
        return Attempt(scene, collision, None, "here")

    return make
