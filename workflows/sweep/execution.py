"""Running many collisions into a store: only what is missing, longest first, whole rows only."""

import dataclasses
import math
import random
import time
from collections import deque
from collections.abc import Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.at_once.together import companies
from chaincor.workflows.accuracy.expected_cost import expected_of_task
from chaincor.workflows.errors import SchedulerError, WorkerDiedError
from chaincor.workflows.given import scenes_given, workers_given
from chaincor.workflows.processes.pool import ProcessPool
from chaincor.workflows.processes.progress import progress_bar
from chaincor.workflows.store.attempt import (
    MACHINE_FAILURES,
    Attempt,
    Company,
    Failure,
    carry_out,
    carry_out_together,
    host_name,
)
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.stored_collision import StoredCollision
from chaincor.workflows.sweep.todo import SweepPlan, plan_sweep

# Tasks handed out for each worker: one to run, and one to begin without waiting for the store.
TASKS_PER_WORKER = 2


@dataclass(frozen=True)
class SweepSummary:
    """
    What a sweep did.

    Attributes
    ----------
    computed : int
        Collisions carried out now, with a result.
    failed : int
        Carried out now, without one.
    inexact : int
        Of those computed now: how many do not meet their tolerance.
    found : int
        Answered by the store as it was, or by another sweep meanwhile.
    known_failures : int
        Not tried again.
    seconds : float
        Wall-clock time.
    integration_seconds, busy_seconds : float
        Over the collisions computed now: time of the integrations that gave the numbers, and of
        everything else they needed.
    """

    computed: int = 0
    failed: int = 0
    inexact: int = 0
    found: int = 0
    known_failures: int = 0
    seconds: float = 0.0
    integration_seconds: float = 0.0
    busy_seconds: float = 0.0


def run_scenes(
    scenes: Iterable[Scene],
    store: Store | Path | str,
    *,
    workers: int | None = None,
    arrays: bool = False,
    progress: bool = True,
    recompute: bool = False,
    retry_failed: bool = False,
) -> list[StoredCollision]:
    """
    Return the results of many collisions, computing those that a store does not have.

    Parameters
    ----------
    scenes : iterable of Scene
        The collisions. A script that calls this needs the usual ``if __name__ == "__main__":``,
        because each worker is a fresh process.
    store : Store or path
        Where results are kept; a path is opened and closed here.
    workers : int, optional
        Processes; as many as there are cores by default.
    arrays : bool
        Whether contacts, mode energies and final states are wanted.
    progress : bool
        Whether to show a progress bar, where there is a terminal.
    recompute : bool
        Whether to compute also what is there.
    retry_failed : bool
        Whether to try also what would fail again.

    Returns
    -------
    list of StoredCollision
        In the order of the scenes; `result` is None and `failure` says why where there is none.

    Raises
    ------
    StoreError
        If the store cannot be used.
    StoreWriteError
        If results cannot be written any more; what is in the store is safe.
    WorkerStartError
        If no worker process can be started.
    """
    scenes = scenes_given(scenes)
    with nullcontext(store) if isinstance(store, Store) else Store(store) as opened:
        plan = plan_sweep(
            opened, scenes, arrays=arrays, recompute=recompute, retry_failed=retry_failed
        )
        if plan.todo:
            workers = min(workers_given(workers), len(plan.todo))
            with ProcessPool(workers) as pool:
                run_plan(
                    plan,
                    opened,
                    pool,
                    in_flight=TASKS_PER_WORKER * workers,
                    arrays=arrays,
                    progress=progress,
                    replace=recompute,
                )
        rows = [opened.find(scene, arrays=arrays) for scene in scenes]
    assert all(row is not None for row in rows)
    return [row for row in rows if row is not None]


def run_plan(
    plan: SweepPlan,
    store: Store,
    executor: Executor,
    *,
    in_flight: int,
    arrays: bool = False,
    progress: bool = False,
    replace: bool = False,
) -> SweepSummary:
    """
    Compute what a plan asks for, and write each result as soon as it is there.

    The executor gets `in_flight` tasks at a time and is shut down at once if the sweep is
    interrupted; `replace` lets results take the place of those that are as exact.

    Raises StoreWriteError, SchedulerError, what keeps any collision from being computed
    (MissingLibraryError, WorkerStartError), and whatever is no named failure: an error of the
    program, or of a user's own bond. What is finished is in the store.
    """
    started = time.perf_counter()
    store.check_writable()
    tasks, costs = _tasks(plan.todo, in_flight)
    queue = deque(tasks)
    pending: dict[Future, _Task] = {}
    summary = SweepSummary(found=plan.found, known_failures=plan.known_failures)
    with progress_bar(progress, len(plan.todo), sum(costs.values())) as advance:
        try:
            while queue or pending:
                while queue and len(pending) < in_flight:
                    task = queue.popleft()
                    if not replace:
                        # Another sweep may have computed some of it meanwhile.
                        left = []
                        for scene, standing in zip(task, store.standings(task), strict=True):
                            if standing is not None and standing.answers(scene, arrays=arrays):
                                summary = dataclasses.replace(summary, found=summary.found + 1)
                                advance(costs[scene.collision_sha256])
                            else:
                                left.append(scene)
                        task = tuple(left)
                    if len(task) > 1:
                        pending[executor.submit(carry_out_together, task)] = task
                    elif task:
                        pending[executor.submit(carry_out, *task)] = task
                done = wait(pending, return_when=FIRST_COMPLETED).done if pending else set()
                attempts = []
                for future in done:
                    ended, alone = _attempts_of(future, pending[future])
                    attempts += ended
                    # What takes long by itself is not left for the end.
                    queue.extendleft((scene,) for scene in alone)
                store.record(attempts, arrays=arrays, replace=replace)
                for future in done:
                    del pending[future]
                for attempt in attempts:
                    summary = _counted(summary, attempt)
                    advance(costs[attempt.scene.collision_sha256])
        except BaseException:
            # Whatever was finished when the interruption came is kept too.
            over = [future for future in pending if future.done()]
            executor.shutdown(wait=False, cancel_futures=True)
            attempts = []
            for future in over:
                if not future.cancelled() and future.exception() is None:
                    attempts += _attempts_in(future.result(), pending[future])
            store.record(attempts, arrays=arrays, replace=replace)
            raise
    return dataclasses.replace(summary, seconds=time.perf_counter() - started)


# What a worker is handed: one collision, or several of a kind that are carried out together.
_Task = tuple[Scene, ...]


def _tasks(todo: Sequence[Scene], in_flight: int) -> tuple[list[_Task], dict[str, float]]:
    """Return what to hand out, the longest first, and what each collision is expected to take."""
    alone: list[Scene] = []
    tasks: list[_Task] = []
    costs: dict[str, float] = {}
    for places in companies(todo, in_flight):
        scenes = [todo[place] for place in places]
        keys = [scene.collision_sha256 for scene in scenes]
        costs |= zip(keys, expected_of_task(scenes), strict=True)
        if len(scenes) == 1:
            alone += scenes
        else:
            tasks.append(tuple(scenes))
    # Two sweeps at once come to different ones first.
    random.shuffle(tasks)
    return tasks + [(scene,) for scene in _longest_first(alone, costs)], costs


def _longest_first(scenes: Sequence[Scene], costs: dict[str, float]) -> list[Scene]:
    """
    Order by cost, in random order where costs differ by less than a factor of two.

    Costs are not known better than that, and two sweeps that share their points and a store come
    to them in different orders, so that each finds much of its work done by the other.
    """
    shuffled = random.sample(scenes, len(scenes))
    return sorted(shuffled, key=lambda scene: -round(math.log2(costs[scene.collision_sha256])))


def _attempts_of(future: Future, task: _Task) -> tuple[list[Attempt], list[Scene]]:
    """Return what came of a task, and which of its collisions have to be carried out alone."""
    try:
        result = future.result()
    except CancelledError:
        raise SchedulerError(
            "the cluster dropped a collision that was handed to it; what is finished is in the "
            "store: run the same command again"
        ) from None
    except (WorkerDiedError, *MACHINE_FAILURES) as error:
        if len(task) > 1:
            return [], list(task)  # the one that it is about will tell
        return [Attempt(task[0], None, Failure.from_error(error), host_name())], []
    attempts = _attempts_in(result, task)
    ended = {attempt.scene.collision_sha256 for attempt in attempts}
    return attempts, [scene for scene in task if scene.collision_sha256 not in ended]


def _attempts_in(result: Attempt | Company, task: _Task) -> list[Attempt]:
    return [result] if isinstance(result, Attempt) else result.attempts(task)


def _counted(summary: SweepSummary, attempt: Attempt) -> SweepSummary:
    collision = attempt.collision or attempt.kept
    if collision is None:
        return dataclasses.replace(summary, failed=summary.failed + 1)
    return dataclasses.replace(
        summary,
        computed=summary.computed + 1,
        inexact=summary.inexact + (collision.tolerance_met is False),
        integration_seconds=summary.integration_seconds + collision.seconds,
        busy_seconds=summary.busy_seconds + collision.seconds_total,
    )
