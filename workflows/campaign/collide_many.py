"""Carry out many collisions: a warm chain for many seeds, or any list of scenes."""

import math
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.plan import plan
from chaincor.workflows.accuracy.warm import WarmSolver, is_warm
from chaincor.workflows.campaign.carry_out import (
    MACHINE_FAILURES,
    TASKS_PER_WORKER,
    Done,
    carry_out,
    workers_for,
)
from chaincor.workflows.campaign.ensemble import Ensemble, Sample
from chaincor.workflows.campaign.groups import Group, group_scenes, shared_fields
from chaincor.workflows.campaign.progress import progress_bar
from chaincor.workflows.campaign.tasks import requests_of, tasks_of
from chaincor.workflows.campaign.work import MOST_SECONDS, collide_scenes
from chaincor.workflows.durations import format_duration
from chaincor.workflows.errors import CostError
from chaincor.workflows.given import with_short_errors, workers_given
from chaincor.workflows.versions import versions


@with_short_errors
def collide_many(
    scenes: Scene | Sequence[Scene],
    samples: int | None = None,
    *,
    velocities: ArrayLike | None = None,
    workers: int | None = None,
    executor: None = None,
    progress: bool = False,
    most_seconds: float = MOST_SECONDS,
) -> Ensemble:
    """
    Carry out many collisions.

    Parameters
    ----------
    scenes : Scene or sequence of Scene
        A warm scene, or a list of any scenes. A single scene is computed for `samples` seeds, which
        begin with its own seed. Warm chains that differ only in seed and speed are computed in
        batches by compiled loops, if the engine is the reference engine, the tolerance is at least
        1e-8, and the wall is hard and rigid. All other scenes are computed as by
        :func:`~chaincor.workflows.collision.collide`, in worker processes if they take longer than
        a few seconds. A script with worker processes needs the usual ``if __name__ ==
        "__main__":``.
    samples : int, optional
        Number of seeds; only for a single scene.
    velocities : array_like of shape (samples,), optional
        Impact velocity of each sample, instead of the scene's velocity; only for a single scene.
    workers : int, optional
        Number of threads or processes; by default the number of cores.
    executor : None
        Not supported, because threads of this process compute the batches of warm chains.
    progress : bool
        Whether to show a progress bar on a terminal.
    most_seconds : float
        Largest allowed sum of the collisions' expected times, in seconds.

    Returns
    -------
    Ensemble
        The samples, which do not depend on `workers`. If a sample has no result, its `reason` says
        why.

    Raises
    ------
    InputError
        If a single scene has no temperature, if all samples would write to the same file, or if an
        executor is given.
    CostError
        If the expected time exceeds `most_seconds`. Then no collision was started.
    MissingLibraryError, WorkerStartError
        If no collision can be run at all.

    Examples
    --------
    >>> from chaincor import Scene, collide_many
    >>> warm = Scene(particles=10, temperature=1e-4, engine="reference")
    >>> collide_many(warm, samples=20)
    <Ensemble of 20 collisions: mean eta 0.7617 +- 0.01, P(e > 1) 0 (0 to 0.161)>
    """
    started = time.perf_counter()
    if executor is not None:
        raise InputError(
            "collide_many takes no executor, because threads of this process compute its warm "
            "chains. Give workers instead, or call collide(scenes, executor=...)"
        )
    workers = workers_given(workers)
    groups = group_scenes(scenes, samples, velocities)
    count, seconds = sum(map(len, groups)), sum(len(each) * each.expected for each in groups)
    shared = shared_fields(groups)
    if seconds / workers > most_seconds:
        raise CostError(
            f"{count} collisions would take about {format_duration(seconds / workers)} with "
            f"{workers} workers, but {format_duration(most_seconds)} are allowed. Take "
            "fewer samples or particles, or allow more (--most-hours, or most_seconds in "
            "Python)"
        )
    found: list[Sample | None] = [None] * count  # in the order of the scenes
    alone: list[tuple[int, Scene]] = []

    def take(done: Done) -> None:
        for asked, each in done:
            place, scene = alone[asked.place]
            found[place] = Sample.of(scene, each)

    with progress_bar(progress, count, seconds) as advance:
        for group in groups:
            if not is_warm(plan(group.scene)):
                alone += zip(group.places, group, strict=True)
                continue
            for k, sample in enumerate(_collide_group(group, workers)):
                if sample is None:
                    alone.append((group.places[k], group[k]))
                else:
                    found[group.places[k]] = sample
                    advance(group.expected, 1)
        asked = requests_of((scene for _, scene in alone), stored=False)
        tasks = tasks_of(asked, TASKS_PER_WORKER * workers)
        with workers_for(tasks, min(workers, len(tasks))) as (chosen, in_flight):
            carry_out(tasks, collide_scenes, chosen, take, in_flight=in_flight, advance=advance)
    return Ensemble(
        samples=tuple(sample for sample in found if sample is not None),
        scene=shared,
        tolerance=groups[0].scene.asked_tolerance,
        workers=workers,
        seconds_total=time.perf_counter() - started,
        versions=versions(),
    )


def _collide_group(group: Group, workers: int) -> Iterator[Sample | None]:
    """Compute a group in compiled loops; yield each sample, or None if it must run alone."""
    tolerance = group.scene.asked_tolerance
    assert tolerance is not None
    warm_solver = WarmSolver(group.scene.problem, tolerance)
    # This call compiles the loops and computes shared values before threads start.
    warm_solver.solve(group[:1].starts(), group.velocities[:1])
    share = min(warm_solver.share(float(np.median(group.velocities))), -(-len(group) // workers))
    parts = (group[k : k + share] for k in range(0, len(group), share))
    with ThreadPoolExecutor(workers) as threads:
        try:
            for met in threads.map(partial(_samples, warm_solver), parts):
                yield from met
        except BaseException:
            warm_solver.batch.stopped = True  # tells the threads to leave their loops at once
            raise


def _samples(warm_solver: WarmSolver, group: Group) -> list[Sample | None]:
    try:
        met = warm_solver.solve(group.starts(), group.velocities)
    except MACHINE_FAILURES as error:
        # If a task of several collisions fails, each collision runs again alone, and the one that
        # fails reports its error.
        return [Sample.of(group[0], error) if len(group) == 1 else None] * len(group)
    bars = met.step_error + met.rounding
    samples: list[Sample | None] = [None] * len(group)
    for k in np.flatnonzero(met.met).tolist():
        eta = float(met.restitution[k])
        samples[k] = Sample(
            seed=group.seeds[k],
            velocity=float(group.velocities[k]),
            restitution=eta,
            restitution_error=float(bars[k]),
            kinematic_restitution=math.sqrt(eta),
            contacts=int(met.contacts[k]),
            last_contact_time=float(met.last_contact_time[k]),
            ending="proved" if met.proved[k] else "argued",
            scheme=warm_solver.scheme,
            timestep=float(met.timestep[k]),
            tolerance_met=True,
        )
    return samples
