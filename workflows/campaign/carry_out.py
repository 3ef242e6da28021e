"""Carrying out many collisions: tasks to workers, what comes of them to whoever takes it."""

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

# A full disk or no memory costs the collision that met it, not the others.
MACHINE_FAILURES = (OSError, MemoryError)
# Tasks handed out for each worker: one to run, and one to begin without waiting for the results.
TASKS_PER_WORKER = 2
# Seconds in which new processes are hardly up.
SOONER_HERE = 3.0


class Asked(NamedTuple):
    """One collision that is asked for."""

    place: int  #: Where it stands among all that are.
    scene: Scene  #: What collides.
    cost: float  #: Seconds that it is expected to take.


# What one worker carries out.
Task = list[Asked]
# Is given scenes and returns what came of each: a result, the error that it failed with, or None
# where it has to be carried out alone.
Work = Callable[[list[Scene]], Sequence[Any]]
# What came of some collisions.
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
    Carry out collisions, those that go together first, then the longest.

    `in_flight` tasks are handed out at a time, to an executor that an error shuts down at once.
    `take` gets results as they come, and at an interrupt what was finished; what it raises ends
    everything. `is_wanted` says of each scene of a task, just before it is handed out, whether it
    is still wanted. `advance` is told the expected seconds of each collision that is done.
    Collisions that their task did not settle are carried out next, each by itself.

    Raises whatever is no named failure of a collision: an error of the program, of a user's own
    bond, of `take`; and SchedulerError, MissingLibraryError or WorkerStartError if no collision can
    be carried out any more.
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
                queue.extendleft(unsettled)  # what takes long is not left for the end
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
    """Order by cost, which is not known better than to a factor of two."""
    alone = len(task) == 1
    return alone, -round(math.log2(max(task[0].cost, 1e-9))) if alone else 0


def _ended(future: Future, task: Task) -> tuple[Done, list[Task]]:
    """Return what came of a task, and which of its collisions it did not settle."""
    try:
        found = future.result()
    except CancelledError:
        raise SchedulerError(
            "the cluster dropped a collision that was handed to it; what is finished is in the "
            "store: run the same command again"
        ) from None
    except (WorkerDiedError, *MACHINE_FAILURES) as error:
        # Of several, the one that it is about will tell.
        found = [error if len(task) == 1 else None] * len(task)
    pairs = list(zip(task, found, strict=True))
    unsettled = [[asked] for asked, each in pairs if each is None]
    return [pair for pair in pairs if pair[1] is not None], unsettled


class SerialExecutor(Executor):
    """An executor that carries out each task in this thread, as it is handed over."""

    def submit(self, function: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """Call the function and return a future that is done."""
        future: Future = Future()
        try:
            future.set_result(function(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def workers_for(tasks: Sequence[Task], workers: int) -> Iterator[tuple[Executor, int]]:
    """Yield who carries out some tasks, and how many at a time: processes if they are worth it."""
    if workers < 2 or sum(asked.cost for task in tasks for asked in task) < SOONER_HERE:
        yield SerialExecutor(), 1
        return
    with ProcessPool(workers) as pool:
        yield pool, TASKS_PER_WORKER * workers
