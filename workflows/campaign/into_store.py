"""Computation of the collisions that a store lacks."""

import random
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.carry_out import TASKS_PER_WORKER, Done, carry_out
from chaincor.workflows.campaign.pool import ProcessPool
from chaincor.workflows.campaign.progress import progress_bar
from chaincor.workflows.campaign.work import collide_to_rows, tasks_of
from chaincor.workflows.given import workers_given
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.row import Row


@dataclass
class Tally:
    """Counts of a sweep so far."""

    #: Collisions that were computed with a result.
    computed: int = 0
    failed: int = 0  #: Collisions that failed.
    inexact: int = 0  #: Computed collisions that miss their tolerance.
    found: int = 0  #: Results found in the store, also from another sweep meanwhile.
    #: Earlier failures that were not repeated, because the scene itself is the reason.
    known_failures: int = 0
    seconds: float = 0.0  #: Wall-clock time.
    #: Time of the integrations that gave the numbers of the computed collisions.
    integration_seconds: float = 0.0
    busy_seconds: float = 0.0  #: Whole time of the computed collisions.


class IntoStore:
    """
    Collisions that a store lacks, and their computation into the store.

    If scenes differ only in their tolerance, the tightest counts. With `arrays`, contacts, mode
    energies and final states are stored too. Results without arrays, or to be recomputed, are
    requested at least as exactly as before. `recompute` repeats stored results, and `retry_failed`
    repeats failures.
    """

    def __init__(
        self,
        store: Store,
        scenes: Iterable[Scene],
        *,
        arrays: bool = False,
        recompute: bool = False,
        retry_failed: bool = False,
    ) -> None:
        self._store, self._arrays, self._recompute = store, arrays, recompute
        self.todo: list[Scene] = []  #: Collisions to compute, each once.
        self.tally = Tally()  #: Counts so far.
        wanted = tightest(scenes)
        for scene, standing in zip(wanted, store.standings(wanted), strict=True):
            if standing is not None and not recompute:
                if standing.answers(scene, arrays=arrays):
                    self.tally.found += 1
                    continue
                if standing.would_fail(scene) and not retry_failed:
                    self.tally.known_failures += 1
                    continue
            self.todo.append(scene if standing is None else _as_exactly(scene, standing))

    def run(self, executor: Executor, *, in_flight: int, progress: bool = False) -> Tally:
        """
        Compute the missing collisions, and write each result as soon as it is finished.

        Raises what :func:`~chaincor.workflows.campaign.carry_out.carry_out` does, and
        StoreWriteError. Finished results are in the store.
        """
        started = time.perf_counter()
        self._store.check_writable()
        tasks = tasks_of(self.todo, in_flight)
        # Two sweeps that share a store begin with different collisions.
        random.shuffle(tasks)
        # Workers begin with different bonds, because each worker compiles loops for all workers.
        firsts = {task[0].scene.label: task for task in tasks if len(task) > 1}
        tasks.sort(key=lambda task: firsts.get(task[0].scene.label) is not task)
        seconds = sum(asked.cost for task in tasks for asked in task)
        with progress_bar(progress, len(self.todo), seconds) as advance:
            carry_out(
                tasks,
                collide_to_rows,
                executor,
                self._take,
                in_flight=in_flight,
                is_wanted=None if self._recompute else self._is_wanted,
                advance=advance,
            )
        self.tally.seconds = time.perf_counter() - started
        return self.tally

    def run_by_processes(self, workers: int, progress: bool) -> Tally:
        """Compute the missing collisions in at most `workers` new processes of this machine."""
        workers = min(workers, len(self.todo))
        with ProcessPool(workers) as pool:
            return self.run(pool, in_flight=TASKS_PER_WORKER * workers, progress=progress)

    def _is_wanted(self, scenes: Sequence[Scene]) -> Sequence[bool]:
        """Return whether no other sweep has computed a collision meanwhile."""
        wanted = [
            standing is None or not standing.answers(scene, arrays=self._arrays)
            for scene, standing in zip(scenes, self._store.standings(scenes), strict=True)
        ]
        self.tally.found += wanted.count(False)
        return wanted

    def _take(self, done: Done) -> None:
        """Write finished results, and count them."""
        found = [
            (asked.scene, each if isinstance(each, Row) else Row.of(each)) for asked, each in done
        ]
        self._store.record(found, arrays=self._arrays, replace=self._recompute)
        for _, row in found:
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
    arrays: bool = False,
    progress: bool = True,
) -> list[Row]:
    """
    Return the rows of many collisions in their order, computing those that a store does not have.

    See :func:`chaincor.workflows.collision.collide`.
    """
    with nullcontext(store) if isinstance(store, Store) else Store(store) as opened:
        into = IntoStore(opened, scenes, arrays=arrays)
        if into.todo:
            into.run_by_processes(workers_given(workers), progress)
        rows = [opened.find(scene, arrays=arrays) for scene in scenes]
    assert all(row is not None for row in rows)
    return [row for row in rows if row is not None]


def _as_exactly(scene: Scene, standing: Row) -> Scene:
    """
    Return a scene with a tolerance at least as tight as the stored result.

    A looser run could not replace the stored result.
    """
    asked, known = scene.asked_tolerance, standing.columns["tolerance"]
    if asked is None or known is None or not standing.has_result or asked <= known:
        return scene
    return scene.replace(tolerance=known)


def tightest(scenes: Iterable[Scene]) -> list[Scene]:
    """Return each collision once, with its tightest tolerance."""
    chosen: dict[str, Scene] = {}
    for scene in scenes:
        other = chosen.get(scene.collision_sha256)
        if other is None or (scene.asked_tolerance or 0.0) < (other.asked_tolerance or 0.0):
            chosen[scene.collision_sha256] = scene
    return list(chosen.values())
