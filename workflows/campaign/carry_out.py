"""Carry out many collisions: send tasks to workers, and pass results to a callback."""

import itertools
import queue
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager
from typing import Any, NamedTuple

from chaincor.lammps_inputs.errors import one_line
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.points import Point
from chaincor.workflows.campaign.pool import ProcessPool
from chaincor.workflows.campaign.progress import PointProgress
from chaincor.workflows.errors import SchedulerError, WorkerDiedError

# A full disk and a lack of memory raise these errors, which fail only the collision that is being
# computed.
MACHINE_FAILURES = (OSError, MemoryError)
# Each worker has one running task and one waiting task, which begins without a delay.
TASKS_PER_WORKER = 2
# New processes need this many seconds to start. Shorter work is done in this process.
SOONER_HERE = 3.0
# Seconds between two checks whether workers have prepared the next task.
_LOOK_SECONDS = 0.02


class CollisionRequest(NamedTuple):
    """One requested collision."""

    place: int  #: Index among all requested collisions.
    scene: Scene | Point  #: Scene of the collision, or the point of a sweep that describes it.
    cost: float  #: Expected time, in seconds.
    kind: Hashable = (
        #: Equal for collisions that can be computed in one batch; None if no batch is possible.
        None
    )
    collision_sha256: str = ""  #: Key of the row in a store; empty without a store.
    asked_tolerance: float | None = None  #: Tolerance of eta; None with explicit numerics.
    particles: int = 0  #: Number of particles of the chain.


# Collisions that one worker computes as one task.
Task = list[CollisionRequest]
# Function from scenes to one item per scene: a result, the error of a failure, or None if the scene
# must be computed alone.
Work = Callable[[list[Any]], Sequence[Any]]
# Results of some collisions.
Done = list[tuple[CollisionRequest, Any]]


def carry_out(
    tasks: Iterable[Task | None],
    work: Work,
    executor: Executor,
    take: Callable[[Done], None],
    *,
    in_flight: int | Callable[[], int],
    is_wanted: Callable[[Sequence[CollisionRequest]], Sequence[bool]] | None = None,
    advance: PointProgress = lambda *_: None,
) -> None:
    """
    Carry out collisions in the order of their tasks, which are created when needed.

    At most `in_flight` tasks are submitted at a time. If `tasks` yields None, workers still prepare
    the next task. Just before a task is submitted, `is_wanted` tells which of its collisions are
    still wanted. If collisions of a task get neither a result nor an error, they are carried out
    next, one by one.

    `take` is called with all results that have arrived since its last call, also after an
    interrupt. `advance` is called with the expected seconds and the number of finished collisions.
    An error, including one in `take`, shuts the executor down at once.

    Named failures of a collision are results. All other errors are raised: those of the program, of
    a user's own bond, and of `take`. Raise SchedulerError, MissingLibraryError or WorkerStartError
    if no further collision can be carried out.
    """
    source, again = iter(tasks), deque[Task]()
    pending: dict[Future, Task] = {}
    over: queue.SimpleQueue[Future] = queue.SimpleQueue()
    most = in_flight if callable(in_flight) else lambda: in_flight
    more = True
    try:
        while more or again or pending:
            preparing = False
            while len(pending) < most() and not preparing and (again or more):
                task = again.popleft() if again else next(source, [])
                preparing, more = task is None, more and (bool(again) or task != [])
                if task and is_wanted is not None:
                    task = _still_wanted(task, is_wanted, advance)
                if task:
                    future = executor.submit(work, [asked.scene for asked in task])
                    pending[future] = task
                    future.add_done_callback(over.put)
            ended = _ended_by_now(over, pending, preparing)
            done: Done = []
            for future in ended:
                found, unsettled = _ended(future, pending[future])
                done += found
                # computed next, because long collisions should not be started last
                again.extendleft(unsettled)
            take(done)
            for future in ended:
                del pending[future]
            if done:
                advance(sum(asked.cost for asked, _ in done), len(done))
    except BaseException:
        finished = {future for future in pending if future.done()}
        executor.shutdown(wait=False, cancel_futures=True)
        sound = (f for f in finished if not f.cancelled() and f.exception() is None)
        take([each for future in sound for each in _ended(future, pending[future])[0]])
        raise


def _still_wanted(
    task: Task,
    is_wanted: Callable[[Sequence[CollisionRequest]], Sequence[bool]],
    advance: PointProgress,
) -> Task:
    wanted = is_wanted(task)
    dropped = [*itertools.compress(task, [not each for each in wanted])]
    if dropped:
        advance(sum(asked.cost for asked in dropped), len(dropped))
    return [*itertools.compress(task, wanted)]


def _ended_by_now(
    over: "queue.SimpleQueue[Future]", pending: dict[Future, Task], preparing: bool
) -> list[Future]:
    """
    Return the tasks that have ended, after waiting for one.

    If workers still prepare tasks, wait only for a moment.
    """
    ended: list[Future] = []
    try:
        if pending or preparing:
            ended.append(over.get(timeout=_LOOK_SECONDS if preparing else None))
        while True:
            ended.append(over.get_nowait())
    except queue.Empty:
        return ended


def _ended(future: Future, task: Task) -> tuple[Done, list[Task]]:
    """Return the results of a task, and those of its collisions that must run again alone."""
    try:
        found = future.result()
    except CancelledError:
        raise SchedulerError(
            "the cluster dropped a collision. Run the same command again: finished results are in "
            "the store"
        ) from None
    except BrokenExecutor as error:
        raise SchedulerError(
            f"the executor lost its workers ({one_line(error)}). Repeat the call with a new "
            "executor: finished results are in the store, if there is one"
        ) from None
    except (WorkerDiedError, *MACHINE_FAILURES) as error:
        # If a task of several collisions fails, each collision runs again alone, and the one that
        # fails reports its error.
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
    """
    Yield an executor and its number of tasks at a time.

    The executor has processes only if these save time.
    """
    if workers < 2 or sum(asked.cost for task in tasks for asked in task) < SOONER_HERE:
        yield SerialExecutor(), 1
        return
    with ProcessPool(workers) as pool:
        yield pool, TASKS_PER_WORKER * workers
