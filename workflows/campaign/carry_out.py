"""Carrying out many collisions: tasks to workers, what comes of them to whoever takes it."""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Self

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


Work = Callable[[Any], Sequence[Any]]


@dataclass(frozen=True)
class Task:
    """
    Collisions that one worker carries out.

    Attributes
    ----------
    places : sequence of int
        Where their scenes stand among all that are asked for.
    scenes : sequence of Scene
        What collides.
    costs : sequence of float
        Seconds that each is expected to take.
    work : callable
        Is given the scenes and returns what came of each: a result, the error that it failed with,
        or None where it has to be carried out alone.
    """

    places: Sequence[int]
    scenes: Sequence[Scene]
    costs: Sequence[float]
    work: Work

    def part(self, chosen: Sequence[int]) -> Self:
        """Return a task for some of the collisions, counted from 0."""
        return replace(
            self,
            places=[self.places[k] for k in chosen],
            scenes=[self.scenes[k] for k in chosen],
            costs=[self.costs[k] for k in chosen],
        )


@dataclass(frozen=True)
class Done:
    """What came of collision `k` of a task: a result, or the error that it failed with."""

    task: Task
    k: int
    found: Any

    @property
    def place(self) -> int:
        """Where its scene stands among all that were asked for."""
        return self.task.places[self.k]

    @property
    def scene(self) -> Scene:
        """What collided."""
        return self.task.scenes[self.k]


class Sink(ABC):
    """Who takes what comes of collisions."""

    def is_wanted(self, task: Task) -> Sequence[bool]:
        """Say of each collision of a task whether it is still to be carried out."""
        return [True] * len(task.places)

    @abstractmethod
    def take(self, done: Sequence[Done]) -> None:
        """Take what has come; an error raised here ends everything."""


def carry_out(
    tasks: Sequence[Task],
    executor: Executor,
    sink: Sink,
    *,
    in_flight: int,
    advance: Advance = lambda _: None,
    left: list[Task] | None = None,
) -> None:
    """
    Carry out collisions: those that go together first, then the longest.

    Parameters
    ----------
    tasks : sequence of Task
        What is to be done.
    executor : concurrent.futures.Executor
        Who does it. At an interrupt, or an error, it is shut down at once.
    sink : Sink
        Who takes the results, as they come, and what was finished when an interrupt came.
    in_flight : int
        How many tasks are handed out at a time.
    advance : callable
        Is told the expected seconds of each collision that is done.
    left : list of Task, optional
        Where collisions go that their task did not settle. By default they are carried out alone,
        next.

    Raises
    ------
    SchedulerError, MissingLibraryError, WorkerStartError
        If no collision can be carried out any more.
    Exception
        Whatever is no named failure of a collision: an error of the program, or of a user's own
        bond; and what `sink` raises.
    """
    queue = deque(sorted(tasks, key=_turn))
    pending: dict[Future, Task] = {}
    try:
        while queue or pending:
            while queue and len(pending) < in_flight:
                task = _still_wanted(queue.popleft(), sink, advance)
                if task.places:
                    pending[executor.submit(task.work, task.scenes)] = task
            done: list[Done] = []
            over = wait(pending, return_when=FIRST_COMPLETED).done if pending else set()
            for future in over:
                ended, alone = _ended(future, pending[future])
                done += ended
                if left is None:
                    queue.extendleft(alone)  # what takes long by itself is not left for the end
                else:
                    left += alone
            sink.take(done)
            for future in over:
                del pending[future]
            for each in done:
                advance(each.task.costs[each.k])
    except BaseException:
        over = {future for future in pending if future.done()}
        executor.shutdown(wait=False, cancel_futures=True)
        sound = (f for f in over if not f.cancelled() and f.exception() is None)
        sink.take([each for future in sound for each in _ended(future, pending[future])[0]])
        raise


def _turn(task: Task) -> tuple[bool, int]:
    """Order by cost, which is not known better than to a factor of two."""
    alone = len(task.places) == 1
    return alone, -round(math.log2(max(task.costs[0], 1e-9))) if alone else 0


def _still_wanted(task: Task, sink: Sink, advance: Callable[[float], None]) -> Task:
    wanted = sink.is_wanted(task)
    if all(wanted):
        return task
    for cost, is_wanted in zip(task.costs, wanted, strict=True):
        if not is_wanted:
            advance(cost)
    return task.part([k for k, is_wanted in enumerate(wanted) if is_wanted])


def _ended(future: Future, task: Task) -> tuple[list[Done], list[Task]]:
    """Return what came of a task, and which of its collisions have to be carried out alone."""
    try:
        found = future.result()
    except CancelledError:
        raise SchedulerError(
            "the cluster dropped a collision that was handed to it; what is finished is in the "
            "store: run the same command again"
        ) from None
    except (WorkerDiedError, *MACHINE_FAILURES) as error:
        # Of several, the one that it is about will tell.
        found = [error] if len(task.places) == 1 else [None] * len(task.places)
    done = [Done(task, k, each) for k, each in enumerate(found) if each is not None]
    return done, [task.part([k]) for k, each in enumerate(found) if each is None]


class Here(Executor):
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
    if workers < 2 or sum(sum(task.costs) for task in tasks) < SOONER_HERE:
        yield Here(), 1
        return
    with ProcessPool(workers) as pool:
        yield pool, TASKS_PER_WORKER * workers
