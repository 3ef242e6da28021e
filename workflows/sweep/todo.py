"""What a store leaves to be computed of a sweep."""

from collections.abc import Iterable
from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.standing import Standing


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
    there, `retry_failed` what would fail again. What is there without the arrays, or is to be
    recomputed, is asked for as exactly as before, or more.
    """
    todo, found, known_failures = [], 0, 0
    wanted = _tightest(scenes)
    for scene, standing in zip(wanted, store.standings(wanted), strict=True):
        if standing is not None and not recompute:
            if standing.answers(scene, arrays=arrays):
                found += 1
                continue
            if standing.would_fail(scene) and not retry_failed:
                known_failures += 1
                continue
        todo.append(scene if standing is None else _as_exactly(scene, standing))
    return SweepPlan(tuple(todo), found, known_failures)


def _as_exactly(scene: Scene, standing: Standing) -> Scene:
    """
    Return a scene, asked for at least as exactly as the result that is there.

    A looser run could not take its place, neither for missing arrays nor to recompute it.
    """
    asked = scene.asked_tolerance
    if asked is None or standing.restitution is None or standing.tolerance is None:
        return scene
    return scene if asked <= standing.tolerance else scene.replace(tolerance=standing.tolerance)


def _tightest(scenes: Iterable[Scene]) -> list[Scene]:
    """Return each collision once, as exactly as it is asked for anywhere."""
    chosen: dict[str, Scene] = {}
    for scene in scenes:
        other = chosen.get(scene.collision_sha256)
        if other is None or (scene.asked_tolerance or 0.0) < (other.asked_tolerance or 0.0):
            chosen[scene.collision_sha256] = scene
    return list(chosen.values())
