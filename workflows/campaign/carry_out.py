"""Execution of many collisions: tasks go to workers, and results go to a callback."""

import itertools
import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from typing import Any, NamedTuple

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.pool import ProcessPool
from chaincor.workflows.campaign.progress import Advance
from chaincor.workflows.errors import SchedulerError, WorkerDiedError

# A full disk or lack of memory is the failure of one collision, not of the others.
MACHINE_FAILURES = (OSError, MemoryError)
# Submitted tasks per worker: one that runs, and one that begins without waiting.
TASKS_PER_WORKER = 2
# Seconds that new processes need to start.
SOONER_HERE = 3.0


class Asked(NamedTuple):
    """One requested collision."""

    place: int  #: Index among all requested collisions.
    scene: Scene  #: Scene of the collision.
    cost: float  #: Expected seconds.


# Collisions that one worker computes as one task.
Task = list[Asked]
# Function from scenes to one item per scene: a result, the error of a failure, or None if the scene
# must be computed alone.
Work = Callable[[list[Scene]], Sequence[Any]]
# Results of some collisions.
Done = list[tuple[Asked, Any]]


def carry_out(
    tasks: Sequence[Task],
    work: Work,
    executor: Executor,
    take: Callable[[Done], None],
    *,
    in_flight: int,
    is_wanted: Callable[[Sequence[Scene]], Sequence[bool]] | None = None,
    advance: Advance = lambda _: None,
) -> None:
    """
    Carry out collisions, batches first, then the longest.

    The executor has `in_flight` tasks at a time; an error shuts it down at once. `take` gets
    results as they come, and the finished ones after an interrupt. An error of `take` ends
    everything. `is_wanted` says whether a scene is still wanted just before its task is submitted.
    `advance` gets the expected seconds of each finished collision. Collisions that their task did
    not settle are carried out next, one by one.

    Raises every error that is no named failure of a collision: errors of the program, of a user's
    own bond, of `take`. Raises SchedulerError, MissingLibraryError or WorkerStartError if no
    further collision can be carried out.
    """
    queue = deque(sorted(tasks, key=_turn))
    pending: dict[Future, Task] = {}
    try:
        while queue or pending:
            while queue and len(pending) < in_flight:
                task = queue.popleft()
                if is_wanted is not None:
                    wanted = is_wanted([asked.scene for asked in task])
                    for asked in itertools.compress(task, [not each for each in wanted]):
                        advance(asked.cost)
                    task = [*itertools.compress(task, wanted)]
                if task:
                    pending[executor.submit(work, [asked.scene for asked in task])] = task
            done: Done = []
            over = wait(pending, return_when=FIRST_COMPLETED).done if pending else set()
            for future in over:
                ended, unsettled = _ended(future, pending[future])
                done += ended
                queue.extendleft(unsettled)  # long collisions should not come last
            take(done)
            for future in over:
                del pending[future]
            for asked, _ in done:
                advance(asked.cost)
    except BaseException:
        over = {future for future in pending if future.done()}
        executor.shutdown(wait=False, cancel_futures=True)
        sound = (f for f in over if not f.cancelled() and f.exception() is None)
        take([each for future in sound for each in _ended(future, pending[future])[0]])
        raise


def _turn(task: Task) -> tuple[bool, int]:
    """Return a random sort key of the cost, which is known to a factor of two only."""
    alone = len(task) == 1
    return alone, -round(math.log2(max(task[0].cost, 1e-9))) if alone else 0


def _ended(future: Future, task: Task) -> tuple[Done, list[Task]]:
    """Return the results of a task, and its unsettled collisions."""
    try:
        found = future.result()
    except CancelledError:
        raise SchedulerError(
            "the cluster dropped a collision that was handed to it; what is finished is in the "
            "store: run the same command again"
        ) from None
    except (WorkerDiedError, *MACHINE_FAILURES) as error:
        # If the task has several collisions, the failing one reports the error when it runs alone.
        found = [error if len(task) == 1 else None] * len(task)
    pairs = list(zip(task, found, strict=True))
    unsettled = [[asked] for asked, each in pairs if each is None]
    return [pair for pair in pairs if pair[1] is not None], unsettled


class SerialExecutor(Executor):
    """Executor that runs each task in the calling thread when it is submitted."""

    def submit(self, function: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """Call the function and return a finished future."""
        future: Future = Future()
        try:
            future.set_result(function(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def workers_for(tasks: Sequence[Task], workers: int) -> Iterator[tuple[Executor, int]]:
    """Yield an executor and its number of tasks at a time; processes if they save time."""
    if workers < 2 or sum(asked.cost for task in tasks for asked in task) < SOONER_HERE:
        yield SerialExecutor(), 1
        return
    with ProcessPool(workers) as pool:
        yield pool, TASKS_PER_WORKER * workers
