"""What a store leaves to be computed of a sweep."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.tolerance import asked_tolerance
from chaincor.workflows.store.results_store import Store


@dataclass(frozen=True)
class SweepPlan:
    """
    What a store leaves to be done.

    Attributes
    ----------
    todo : tuple of Scene
        Collisions to compute, each once.
    found : int
        Those that are answered.
    known_failures : int
        Those that failed by themselves before and would fail again.
    """

    todo: tuple[Scene, ...]
    found: int
    known_failures: int


def plan_sweep(
    store: Store,
    scenes: Iterable[Scene],
    *,
    arrays: bool = False,
    recompute: bool = False,
    retry_failed: bool = False,
) -> SweepPlan:
    """
    Find out which of many collisions have to be computed.

    Of scenes that differ only in their tolerance, the tightest counts. `recompute` adds what is
    there, `retry_failed` what would fail again.
    """
    todo, found, known_failures = [], 0, 0
    for scene in _tightest(scenes):
        standing = store.standing(scene)
        if standing is not None and not recompute:
            if standing.answers(scene, arrays=arrays):
                found += 1
                continue
            if standing.would_fail(scene) and not retry_failed:
                known_failures += 1
                continue
            if standing.answers(scene) and not scene.explicit and standing.tolerance is not None:
                # Only the arrays are missing: compute them for the result that is there.
                tolerance = min(standing.tolerance, asked_tolerance(scene) or math.inf)
                scene = scene.replace(tolerance=tolerance)
        todo.append(scene)
    return SweepPlan(tuple(todo), found, known_failures)


def _tightest(scenes: Iterable[Scene]) -> Iterable[Scene]:
    """Return each collision once, as exactly as it is asked for anywhere."""
    chosen: dict[str, Scene] = {}
    for scene in scenes:
        other = chosen.get(scene.collision_sha256)
        if other is None or (asked_tolerance(scene) or 0.0) < (asked_tolerance(other) or 0.0):
            chosen[scene.collision_sha256] = scene
    return chosen.values()
