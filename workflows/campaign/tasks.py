"""
Describe requested collisions, and divide them into tasks of about a second.

Each request has its expected time, its kind of batch and its key in the store. Sweeps, lists of
scenes, warm samples and forecasts use these tasks.
"""

import math
from collections import Counter
from collections.abc import Hashable, Iterable, Sequence

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.batching import LEAST_TOGETHER, TOGETHER_SHARE, batch_kind
from chaincor.workflows.accuracy.plan import Plan
from chaincor.workflows.accuracy.plans import plans
from chaincor.workflows.campaign.carry_out import CollisionRequest, Task
from chaincor.workflows.campaign.points import Point, scenes_of
from chaincor.workflows.store.row import row_key

# Fields of a collision request, other than its place and its scene.
Facts = tuple[float, Hashable, str, float | None, int]

# Expected seconds of a task. A task should take long compared with its transfer to a worker, but an
# interruption should lose little work.
_TASK_SECONDS = 1.0
# In a short sweep, the number of tasks is this multiple of the number in flight. Workers then end
# at about the same time, and simultaneous sweeps with the same store share the work.
_PARTS_EACH = 4
# Largest number of collisions in a task.
_MOST_TOGETHER = 4096


def requests_of(
    scenes: Iterable[Scene | Point],
    *,
    stored: bool = True,
    planned_before: Sequence[Plan] | None = None,
) -> list[CollisionRequest]:
    """
    Return requests for collisions with their expected times and, for a store, their keys.

    `planned_before` are the plans of the scenes, by default created here.

    Raise SceneError if a point has no valid scene, or if a scene for a store has no key.
    """
    given = list(scenes)
    return with_facts(given, request_facts(given, stored=stored, planned_before=planned_before))


def request_facts(
    scenes: Sequence[Scene | Point],
    *,
    stored: bool = True,
    planned_before: Sequence[Plan] | None = None,
) -> list[Facts]:
    """Return the result of `requests_of` without the scenes, to send it to another process."""
    made = scenes_of(scenes)
    return [
        (
            planned.seconds,
            _shared_kind(scene, planned),
            row_key(scene) if stored else "",
            scene.asked_tolerance,
            scene.particles,
        )
        for scene, planned in zip(made, planned_before or plans(made), strict=True)
    ]


def with_facts(scenes: Sequence[Scene | Point], facts: Iterable[Facts]) -> list[CollisionRequest]:
    """Return requests for collisions from scenes and the result of :func:`request_facts`."""
    both = enumerate(zip(scenes, facts, strict=True))
    return [CollisionRequest(place, scene, *known) for place, (scene, known) in both]


def _shared_kind(scene: Scene, planned: Plan) -> Hashable:
    """Return the kind of a batch in a form that is equal in all processes."""
    kind = batch_kind(scene, planned)
    if kind is None:
        return None
    bond = scene.potential if isinstance(scene.potential, str) else kind[0]
    return bond, repr(sorted(scene.bond_fields.items())), *kind[1:]


def with_batches(asked: Sequence[CollisionRequest], weight: float = 1.0) -> list[CollisionRequest]:
    """
    Return requests with shorter expected times if enough collisions can run in batches.

    If the collisions are a sample, each of them stands for `weight` collisions.
    """
    counts = Counter(each.kind for each in asked if each.kind is not None)
    few = {kind for kind, count in counts.items() if count * weight < LEAST_TOGETHER}
    return [
        each._replace(kind=None)
        if each.kind is None or each.kind in few
        else each._replace(cost=TOGETHER_SHARE * each.cost)
        for each in asked
    ]


def tasks_of(
    asked: Sequence[CollisionRequest], parts: int, whole: float | None = None
) -> list[Task]:
    """
    Divide collisions into tasks of about a second, with batches first, then the longest tasks.

    A task contains collisions that form one batch, or single collisions of similar cost. `whole` is
    the expected time of the whole sweep, in seconds, by default that of these collisions. If it is
    short, the sweep is divided into several tasks for each of the `parts` tasks in flight. Results
    do not depend on the division.
    """
    kinds: dict[Hashable, Task] = {}
    for each in with_batches(asked):
        kinds.setdefault(each.kind, []).append(each)
    alone = sorted(kinds.pop(None, []), key=lambda each: turn([each]))
    if whole is None:
        whole = sum(each.cost for task in (alone, *kinds.values()) for each in task)
    seconds = min(_TASK_SECONDS, whole / (_PARTS_EACH * max(parts, 1)))
    tasks = []
    for task in kinds.values():
        mean = sum(each.cost for each in task) / len(task)
        size = min(max(int(seconds / mean), LEAST_TOGETHER), _MOST_TOGETHER)
        tasks += [task[k : k + size] for k in range(0, len(task), size)]
    return tasks + _similar(alone, seconds)


def turn(task: Task) -> tuple[bool, int]:
    """
    Return a sort key: batches first, then the longest.

    Costs are known only within a factor of two.
    """
    alone = task[0].kind is None
    return alone, -round(math.log2(max(task[0].cost, 1e-9))) if alone else 0


def _similar(asked: Sequence[CollisionRequest], seconds: float) -> list[Task]:
    """Divide collisions into tasks of at most `seconds`; a longer collision is its own task."""
    tasks: list[Task] = []
    room = 0.0
    for each in asked:
        if each.cost > room or len(tasks[-1]) == _MOST_TOGETHER:
            tasks.append([])
            room = seconds
        tasks[-1].append(each)
        room -= each.cost
    return tasks


def tightest(asked: Iterable[CollisionRequest]) -> list[CollisionRequest]:
    """Return each collision once, with its tightest tolerance."""
    chosen: dict[str, CollisionRequest] = {}
    for each in asked:
        other = chosen.get(each.collision_sha256)
        if other is None or (each.asked_tolerance or 0.0) < (other.asked_tolerance or 0.0):
            chosen[each.collision_sha256] = each
    return list(chosen.values())
