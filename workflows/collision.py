"""Run one scene or many scenes and return the results, with or without a store."""

from collections.abc import Iterable
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, overload

from chaincor.lammps_inputs.errors import ChaincorError, InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.plan import refuse_too_costly
from chaincor.workflows.accuracy.plans import plans
from chaincor.workflows.campaign.carry_out import TASKS_PER_WORKER, Done, carry_out, workers_for
from chaincor.workflows.campaign.given_executor import tasks_to
from chaincor.workflows.campaign.progress import progress_bar
from chaincor.workflows.campaign.tasks import requests_of, tasks_of
from chaincor.workflows.campaign.work import MOST_SECONDS, collide_one, collide_scenes
from chaincor.workflows.given import scenes_given, with_short_errors, workers_given
from chaincor.workflows.outputs import refuse_shared_outputs, refuse_unusable_outputs
from chaincor.workflows.result import Collision
from chaincor.workflows.showing.table import ResultTable

if TYPE_CHECKING:
    from distributed import Client

    from chaincor.workflows.store.results_store import Store
    from chaincor.workflows.store.row import Row

__all__ = ["MOST_SECONDS", "collide"]


@overload
def collide(
    scene: Scene,
    tolerance: float | None = None,
    *,
    most_seconds: float = MOST_SECONDS,
    workers: int | None = None,
    progress: bool = True,
) -> Collision: ...


@overload
def collide(
    scene: Iterable[Scene],
    tolerance: float | None = None,
    *,
    most_seconds: float = MOST_SECONDS,
    workers: int | None = None,
    executor: "Executor | Client | None" = None,
    progress: bool = True,
) -> list[Collision]: ...


@overload
def collide(
    scene: Iterable[Scene],
    tolerance: float | None = None,
    *,
    store: "Store | Path | str",
    arrays: bool = False,
    most_seconds: float = MOST_SECONDS,
    workers: int | None = None,
    executor: "Executor | Client | None" = None,
    progress: bool = True,
) -> list["Row"]: ...


@with_short_errors
def collide(
    scene: Scene | Iterable[Scene],
    tolerance: float | None = None,
    *,
    store: "Store | Path | str | None" = None,
    arrays: bool = False,
    most_seconds: float = MOST_SECONDS,
    workers: int | None = None,
    executor: "Executor | Client | None" = None,
    progress: bool = True,
) -> Collision | list[Collision] | list["Row"]:
    """
    Compute one collision or several collisions.

    A scene with explicit numerics is run with these numerics; its error bar comes from runs at half
    the step and at two other steps. Other scenes are run with the cheapest numerics that usually
    meet the tolerance; their error bars come from runs at other steps.

    Parameters
    ----------
    scene : Scene or iterable of Scene
        Bodies, engine and numerics. Several scenes run in worker processes if together they take
        longer than a few seconds, or if their results go into a store. A script then needs the
        usual ``if __name__ == "__main__":``.
    tolerance : float, optional
        Absolute tolerance of eta; replaces the tolerance of the scene.
    store : Store or path, optional
        Store for the results, as in ``chaincor sweep``. Stored results are not computed again.
    arrays : bool
        Whether contacts, mode energies and final states are written to the store.
    most_seconds : float
        Time limit of each collision. A collision that is expected to take longer is not started. At
        the limit, a collision returns its most accurate result so far, or fails if it has no result
        yet.
    workers : int, optional
        Number of worker processes for several scenes; by default one per core.
    executor : concurrent.futures.Executor or distributed.Client, optional
        Executor or Dask client that computes several scenes, in place of new processes; it stays
        open. `workers` is then the number of workers in the executor, needed if the executor does
        not know this number. Threads compute only one collision at a time.
    progress : bool
        Whether to show a progress bar for several scenes, on a terminal or in a notebook.

    Returns
    -------
    Collision, list of Collision or list of Row
        The result, or a list of results in the order of the scenes. A notebook shows the list as a
        table. If a collision misses its tolerance, `tolerance_met` is False and `reason` states
        why. With a store, the list contains rows of the store. In the row of a failed collision,
        `result` is None and `failure` states the reason.

    Raises
    ------
    InputError
        If `scene` is not a scene, if a tolerance is given together with explicit numerics, or if
        outputs cannot be written.
    CostError
        If the collision is expected to exceed `most_seconds`, or reached this limit without a
        result.
    StoreError, StoreWriteError
        If the store cannot be used or written. Results that are already stored are kept.
    SchedulerError
        If the executor accepts no tasks or has lost its workers.
    RunError
        If there is no trustworthy result; each cause has its own subclass. Without a store, the
        first failure stops all scenes.

    Examples
    --------
    >>> from chaincor import Scene, collide
    >>> result = collide(Scene(potential="harmonic", particles=10, engine="reference"))
    >>> round(result.restitution, 4), result.contacts, result.ending
    (0.9071, 9, 'proved')
    """
    scenes = scenes_given(scene)
    if executor is not None and isinstance(scene, Scene):
        raise InputError("the option executor needs several scenes. Give a list of scenes")
    given_workers, workers = workers, min(workers_given(workers), len(scenes))
    if arrays and store is None:
        raise InputError(
            "the option `arrays` has no effect without a store: a result always "
            "contains its arrays. Give a store, or omit `arrays`"
        )
    if tolerance is not None:
        scenes = [each.replace(tolerance=tolerance) for each in scenes]
    refuse_shared_outputs(scenes)
    for each in scenes:
        refuse_unusable_outputs(each)
    planned = plans(scenes)
    for each, its_plan in zip(scenes, planned, strict=True):
        refuse_too_costly(each, its_plan, most_seconds)
    if isinstance(scene, Scene) and store is None:
        return collide_one(scenes[0], most_seconds, planned[0])
    if store is not None:
        # The database library is imported only if results go into a store.
        from chaincor.workflows.campaign.into_store import collide_into_store

        return collide_into_store(
            scenes,
            store,
            workers=(workers or None) if executor is None else given_workers,
            executor=executor,
            arrays=arrays,
            progress=progress,
        )
    tasks = tasks_of(
        requests_of(scenes, stored=False, planned_before=planned),
        TASKS_PER_WORKER * (given_workers or workers),
    )
    found: list[Collision | None] = [None] * len(scenes)
    failed: list[Exception] = []

    def take(done: Done) -> None:
        """Store results in the order of their scenes, and raise the first failure."""
        for asked, each in done:
            if not isinstance(each, Exception):
                found[asked.place] = each
            elif not failed:
                failed.append(each)
                each.__notes__ = [f"scene {asked.place + 1} of {len(scenes)}: {asked.scene!r}"]
                # Hide the traceback of expected errors.
                raise each.with_traceback(None) if isinstance(each, ChaincorError) else each

    seconds = sum(asked.cost for task in tasks for asked in task)
    with (
        progress_bar(progress, len(scenes), seconds) as advance,
        workers_for(tasks, workers) if executor is None else tasks_to(executor, given_workers) as (
            chosen,
            in_flight,
        ),
    ):
        carry_out(tasks, collide_scenes, chosen, take, in_flight=in_flight, advance=advance)
    return ResultTable(result for result in found if result is not None)
