"""Compute the collisions that a store lacks."""

import itertools
import random
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.carry_out import (
    SOONER_HERE,
    TASKS_PER_WORKER,
    CollisionRequest,
    Done,
    SerialExecutor,
    Task,
    carry_out,
)
from chaincor.workflows.campaign.cells import WINDOW, Cells
from chaincor.workflows.campaign.forecast import forecast_cells
from chaincor.workflows.campaign.given_executor import tasks_to
from chaincor.workflows.campaign.points import Point, scene_of
from chaincor.workflows.campaign.pool import ProcessPool
from chaincor.workflows.campaign.progress import PointProgress, progress_bar
from chaincor.workflows.campaign.tasks import (
    request_facts,
    requests_of,
    tasks_of,
    tightest,
    turn,
    with_batches,
    with_facts,
)
from chaincor.workflows.campaign.work import collide_to_rows
from chaincor.workflows.given import workers_given
from chaincor.workflows.outputs import refuse_unusable_outputs
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.row import Row

if TYPE_CHECKING:
    from distributed import Client

# Number of points that a worker prepares in one task.
_DESCRIBED = 2048
# Largest number of windows, of `WINDOW` points each, that are prepared in advance.
_MOST_PREPARED = 12


@dataclass
class Tally:
    """Counts and times of a sweep so far."""

    #: Number of collisions that were computed and gave a result.
    computed: int = 0
    failed: int = 0  #: Number of collisions that failed.
    inexact: int = 0  #: Number of computed collisions that miss their tolerance.
    #: Number of results that were found in the store, including those of simultaneous sweeps.
    found: int = 0
    #: Number of earlier failures that were not repeated, because the scene would fail again.
    known_failures: int = 0
    seconds: float = 0.0  #: Wall-clock time.
    #: Time of the integrations that gave the results.
    integration_seconds: float = 0.0
    busy_seconds: float = 0.0  #: Total time of the computed collisions.


class IntoStore:
    """
    Computation of the collisions that a store lacks.

    The collisions are given as scenes, or as the cells of a sweep, which are created a window at a
    time. If scenes in a window differ only in their tolerance, the tightest tolerance counts.

    If `arrays` is true, contacts, mode energies and final states are stored too. If `details` is
    false, rows have only their columns. If `recompute` is true, stored results are computed again.
    If `retry_failed` is true, failed collisions are computed again. If a stored result is computed
    again, on request or because it lacks arrays, the new result is at least as accurate.
    `keep_jobs` is a folder for the LAMMPS jobs.
    """

    def __init__(
        self,
        store: Store,
        scenes: Iterable[Scene] | Cells,
        *,
        arrays: bool = False,
        details: bool = True,
        recompute: bool = False,
        retry_failed: bool = False,
        keep_jobs: Path | None = None,
    ) -> None:
        self._store, self._arrays, self._details = store, arrays, details
        self._recompute, self._retry_failed, self._keep_jobs = recompute, retry_failed, keep_jobs
        self.tally = Tally()  #: Counts so far.
        self._version, self._shared = store.version(), False
        # Workers send arrays only if they are requested, or if a new result may replace a row that
        # has arrays. Arrays take most of the time of a transfer.
        self._sends_arrays = arrays or store.has_arrays()
        self._cells: Cells | None = None
        self._windows: Iterator[list[Point]] = iter(())
        if not isinstance(scenes, Cells):
            self._first = self.missing(requests_of(scenes))
            return
        self._cells = scenes
        if len(self._cells) > WINDOW:
            self._cells.points.check()
        self._windows = self._cells.windows()
        self._first = []
        for points in self._windows:
            if missing := self.missing(requests_of(points)):
                self._first = missing
                break

    @property
    def todo(self) -> list[Scene | Point]:
        """
        Collisions to compute, each once.

        If there are very many, these are only the first ones.
        """
        return [asked.scene for asked in self._first]

    def run(
        self, executor: Executor, *, in_flight: int | Callable[[], int], progress: bool = False
    ) -> Tally:
        """
        Compute the missing collisions, and write each result as soon as it is finished.

        Raise the errors of :func:`~chaincor.workflows.campaign.carry_out.carry_out`, and
        StoreWriteError. After an error, finished results are in the store.
        """
        started = time.perf_counter()
        self._store.check_writable()
        points, seconds = self._expected
        most = in_flight if callable(in_flight) else lambda: in_flight
        with progress_bar(progress, points, seconds) as advance:
            carry_out(
                self._tasks(executor, most(), seconds, advance),
                partial(collide_to_rows, details=self._details, arrays=self._sends_arrays),
                executor,
                self._take,
                in_flight=most,
                is_wanted=None if self._recompute else self._is_wanted,
                advance=advance,
            )
        self.tally.seconds = time.perf_counter() - started
        return self.tally

    def run_by_processes(self, workers: int, progress: bool) -> Tally:
        """Compute the missing collisions in at most `workers` new processes of this machine."""
        workers = min(workers, len(self._first))
        with ProcessPool(workers) as pool:
            return self.run(pool, in_flight=TASKS_PER_WORKER * workers, progress=progress)

    @property
    def is_short(self) -> bool:
        """Whether the missing collisions take less time than the start of new processes."""
        return self._expected[1] < SOONER_HERE

    @cached_property
    def _expected(self) -> tuple[int, float]:
        """Number of collisions and their expected total time, in seconds."""
        if self._cells is None or len(self._cells) <= WINDOW:
            return len(self._first), sum(asked.cost for asked in with_batches(self._first))
        forecast = forecast_cells(self._cells)
        return forecast.points, forecast.seconds

    def _tasks(
        self, executor: Executor, parts: int, seconds: float, advance: PointProgress
    ) -> Iterator[Task | None]:
        """Yield tasks, and None while workers still prepare the points of the next window."""
        yield from _in_turn(self._first, parts, seconds)
        preparing: deque[tuple[list[Point], list[Future]]] = deque()
        # While one window is computed, other windows are prepared. Preparing a window takes up to
        # two tasks.
        most = min(2 + parts // 4, _MOST_PREPARED)
        while True:
            while len(preparing) < most and (points := next(self._windows, None)):
                groups = (points[k : k + _DESCRIBED] for k in range(0, len(points), _DESCRIBED))
                preparing.append(
                    (points, [executor.submit(request_facts, each) for each in groups])
                )
            if not preparing:
                return
            points, futures = preparing[0]
            while not all(future.done() for future in futures):
                yield None
            preparing.popleft()
            facts = itertools.chain.from_iterable(future.result() for future in futures)
            missing = self.missing(with_facts(points, facts))
            if found := len(points) - len(missing):
                advance(0.0, found)
            yield from _in_turn(missing, parts, seconds)

    def missing(self, described: Sequence[CollisionRequest]) -> list[CollisionRequest]:
        """Return the collisions that must be computed, and count the others."""
        wanted = tightest(described)
        standings = self._store.standings_of([asked.collision_sha256 for asked in wanted])
        missing = []
        for asked, standing in zip(wanted, standings, strict=True):
            if standing is not None and not self._recompute:
                if standing.answers(asked, arrays=self._arrays):
                    self.tally.found += 1
                    continue
                if standing.would_fail(asked) and not self._retry_failed:
                    self.tally.known_failures += 1
                    continue
            missing.append(asked if standing is None else _as_exactly(asked, standing))
        return missing if self._keep_jobs is None else _keeping_jobs(missing, self._keep_jobs)

    def _is_wanted(self, asked: Sequence[CollisionRequest]) -> Sequence[bool]:
        """Return, for each collision, whether no other sweep has stored it in the meantime."""
        # After another program has written to the store, each collision is looked up again before
        # it is computed.
        self._shared = self._shared or self._store.version() != self._version
        if not self._shared:
            return [True] * len(asked)
        standings = self._store.standings_of([each.collision_sha256 for each in asked])
        wanted = [
            standing is None or not standing.answers(each, arrays=self._arrays)
            for each, standing in zip(asked, standings, strict=True)
        ]
        self.tally.found += wanted.count(False)
        return wanted

    def _take(self, done: Done) -> None:
        """Write finished results in one transaction, and count them."""
        rows = [
            each if isinstance(each, Row) else Row.of(each).of_scene(scene_of(asked.scene))
            for asked, each in done
        ]
        if rows:
            self._store.write(rows, arrays=self._arrays, replace=self._recompute)
        for row in rows:
            if not row.has_result:
                self.tally.failed += 1
                continue
            self.tally.computed += 1
            self.tally.inexact += row.columns["tolerance_met"] is False
            self.tally.integration_seconds += row.columns["seconds"]
            self.tally.busy_seconds += row.columns["seconds_total"]


def collide_into_store(
    scenes: Sequence[Scene],
    store: Store | Path | str,
    *,
    workers: int | None = None,
    executor: "Executor | Client | None" = None,
    arrays: bool = False,
    progress: bool = True,
) -> list[Row]:
    """
    Return the rows of many collisions, in the given order, and compute those that a store lacks.

    See :func:`chaincor.workflows.collision.collide`.
    """
    with open_store(store) as opened:
        store_missing(
            scenes, opened, workers=workers, executor=executor, arrays=arrays, progress=progress
        )
        rows = opened.find_all(scenes, arrays=arrays)
    assert all(row is not None for row in rows)
    return [row for row in rows if row is not None]


def open_store(store: Store | Path | str) -> AbstractContextManager[Store]:
    """Return a context with a store, which closes the store only if a path was given."""
    return nullcontext(store) if isinstance(store, Store) else Store(store)


def store_missing(
    scenes: Sequence[Scene],
    store: Store,
    *,
    workers: int | None = None,
    executor: "Executor | Client | None" = None,
    arrays: bool = False,
    progress: bool = True,
) -> None:
    """
    Compute the collisions that a store lacks, as :func:`collide_into_store`, without reading rows.

    Short sweeps by the reference engine run in this process, because new processes start slowly.
    """
    into = IntoStore(store, scenes, arrays=arrays)
    if not into.todo:
        return
    if executor is not None:
        with tasks_to(executor, workers) as (given, in_flight):
            into.run(given, in_flight=in_flight, progress=progress)
    elif into.is_short and all(scene.engine == "reference" for scene in scenes):
        into.run(SerialExecutor(), in_flight=1, progress=progress)
    else:
        into.run_by_processes(workers_given(workers), progress)


def _in_turn(asked: Sequence[CollisionRequest], parts: int, seconds: float) -> list[Task]:
    """Return tasks in the order in which they are computed: batches first, then the longest."""
    tasks = tasks_of(random.sample(asked, len(asked)), parts, seconds)
    # The order is random, so that two sweeps with the same store begin with different collisions.
    random.shuffle(tasks)
    # Workers begin with different bonds, because loops that one worker compiles serve all workers.
    firsts = {task[0].kind: task for task in tasks if task[0].kind is not None}
    return sorted(tasks, key=lambda task: (firsts.get(task[0].kind) is not task, *turn(task)))


def _as_exactly(asked: CollisionRequest, standing: Row) -> CollisionRequest:
    """
    Return a collision with a tolerance at least as tight as that of the stored result.

    A run with a looser tolerance could not replace the stored result.
    """
    own, known = asked.asked_tolerance, standing.columns["tolerance"]
    if own is None or known is None or not standing.has_result or own <= known:
        return asked
    if isinstance(asked.scene, Scene):
        scene: Scene | Point = asked.scene.replace(tolerance=known)
    else:
        scene = asked.scene._replace(fields=asked.scene.fields | {"tolerance": known})
    return asked._replace(scene=scene, asked_tolerance=known)


def _keeping_jobs(asked: Sequence[CollisionRequest], folder: Path) -> list[CollisionRequest]:
    """
    Return the collisions, with a folder for each LAMMPS job.

    Raise InputError if a folder cannot be used. Otherwise the collision would fail later.
    """
    kept = []
    for each in asked:
        scene = scene_of(each.scene)
        if scene.engine == "lammps":
            scene = scene.replace(save=folder / scene.sha256[:16])
            refuse_unusable_outputs(scene)
        kept.append(each._replace(scene=scene))
    return kept
