"""Provide artificial collisions, which take no computing time."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from chaincor.analysis.error_bar import ErrorBar
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import CrossingError
from chaincor.workflows.result import Collision
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.row import Row


@pytest.fixture(scope="session")
def _template() -> Collision:
    return collide(Scene(potential="harmonic", particles=2, engine="reference"))


class Attempt(NamedTuple):
    """Scene and row for a store."""

    scene: Scene
    row: Row


@pytest.fixture(scope="session")
def make_collision(_template: Collision) -> Callable[..., Collision]:
    """Return a function that makes a result without computing it."""
    from dataclasses import replace

    def make(scene: Scene, restitution: float = 0.5, error: float | None = None) -> Collision:
        tolerance = scene.asked_tolerance
        if error is None and tolerance is not None:
            error = 0.5 * tolerance
        return replace(
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

    return make


@pytest.fixture(scope="session")
def make_attempt(make_collision: Callable[..., Collision]) -> Callable[..., Attempt]:
    """Return a function that makes a scene and its row, without computing it."""
    return lambda scene, *given, **also: Attempt(
        scene, Row.of(make_collision(scene, *given, **also))
    )


@pytest.fixture
def make_failure() -> Callable[..., Attempt]:
    """Return a function that makes an attempt without a result."""
    crossing = CrossingError("particles would cross")

    def make(scene: Scene, failure: Exception = crossing) -> Attempt:
        return Attempt(scene, Row.of(failure))

    return make


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    """Yield an empty store."""
    with Store(tmp_path / "results.sqlite") as opened:
        yield opened
