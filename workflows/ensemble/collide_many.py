"""Many collisions at once: warm chains of many seeds, or any list of scenes."""

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.at_once.many import ManyMeetings
from chaincor.workflows.collision import MOST_SECONDS
from chaincor.workflows.durations import format_duration
from chaincor.workflows.ensemble.groups import Group, group_scenes, shared_fields
from chaincor.workflows.ensemble.result import Ensemble, Sample
from chaincor.workflows.errors import CostError, WorkerDiedError
from chaincor.workflows.given import workers_given
from chaincor.workflows.processes.in_flight import as_they_end
from chaincor.workflows.processes.pool import ProcessPool
from chaincor.workflows.processes.progress import Advance, progress_bar
from chaincor.workflows.store.attempt import Attempt, Failure, carry_out, host_name
from chaincor.workflows.versions import versions

# Collisions one by one that are done sooner here than new processes start.
_FEW = 8


def collide_many(
    scenes: Scene | Sequence[Scene],
    samples: int | None = None,
    *,
    velocities: ArrayLike | None = None,
    workers: int | None = None,
    progress: bool = False,
    most_seconds: float = MOST_SECONDS,
) -> Ensemble:
    """
    Carry out many collisions.

    Parameters
    ----------
    scenes : Scene or sequence of Scene
        A warm scene, of which so many seeds are drawn as there are `samples`: its own and those
        that follow it. Or the scenes themselves, which may differ in anything. With the in-house
        engine a tolerance down to 1e-8 and a hard, rigid wall, warm chains that differ in seed and
        speed alone are carried out together, in compiled loops; all others one by one, in worker
        processes: a script that asks for those needs the usual ``if __name__ == "__main__":``.
    samples : int, optional
        Only with one scene.
    velocities : array_like of shape (samples,), optional
        Impact velocity of each sample in place of the scene's; only with one scene.
    workers : int, optional
        Threads, or processes; as many as there are cores by default.
    progress : bool
        Whether to show a progress bar, where there is a terminal.
    most_seconds : float
        How long all may be expected to take.

    Returns
    -------
    Ensemble
        The numbers, which do not depend on `workers`. Collisions without one are samples that say
        why.

    Raises
    ------
    InputError
        If there is nothing to draw, or each sample would write to the same file.
    CostError
        If it is expected to take longer than `most_seconds`; nothing was begun.
    MissingLibraryError, WorkerStartError
        If no collision at all can be run.
    """
    try:
        return _collide_many(scenes, samples, velocities, workers, progress, most_seconds)
    except KeyboardInterrupt as interrupt:
        raise interrupt.with_traceback(None) from None


def _collide_many(
    scenes: Scene | Sequence[Scene],
    samples: int | None,
    velocities: ArrayLike | None,
    workers: int | None,
    progress: bool,
    most_seconds: float,
) -> Ensemble:
    started = time.perf_counter()
    workers = workers_given(workers)
    groups = group_scenes(scenes, samples, velocities)
    count = sum(len(group.seeds) for group in groups)
    shared = shared_fields(groups)
    _refuse_endless(groups, workers, most_seconds)
    found: list[Sample | None] = [None] * count
    costs = sum(group.expected * len(group.seeds) for group in groups)
    with progress_bar(progress, count, costs) as advance:
        alone: list[tuple[int, Group, int]] = []
        for group in groups:
            if group.together:
                left = _meet_together(group, found, workers, advance)
            else:
                left = list(range(len(group.seeds)))
            alone += [(group.places[k], group, k) for k in left]
        _collide_alone(alone, found, workers, advance)
    assert all(sample is not None for sample in found)
    first = groups[0].scene
    return Ensemble(
        samples=tuple(sample for sample in found if sample is not None),
        scene=shared,
        tolerance=first.asked_tolerance,
        workers=workers,
        seconds_total=time.perf_counter() - started,
        versions=versions(),
    )


def _refuse_endless(groups: Sequence[Group], workers: int, most_seconds: float) -> None:
    seconds = sum(group.expected * len(group.seeds) for group in groups) / workers
    if seconds > most_seconds:
        raise CostError(
            f"{sum(len(group.seeds) for group in groups)} collisions would take about "
            f"{format_duration(seconds)} with {workers} workers; expected at most "
            f"{format_duration(most_seconds)}: take fewer samples or particles, or allow more "
            "(--most-hours, or most_seconds in Python)"
        )


def _meet_together(
    group: Group, found: list[Sample | None], workers: int, advance: Advance
) -> list[int]:
    """Carry out a group in compiled loops; return which of it must be collided by themselves."""
    meetings = ManyMeetings(group.scene)
    # Compiling, and what is worked out once, is not for threads at once.
    meetings.meet(group.starts(slice(0, 1)), group.velocities[:1])
    count = len(group.seeds)
    share = min(meetings.share(float(np.median(group.velocities))), -(-count // workers))
    left: list[int] = []

    def meet(begin: int) -> tuple[int, list[Sample | None]]:
        part = slice(begin, min(begin + share, count))
        return begin, _samples(group, part, meetings)

    with ThreadPoolExecutor(workers) as threads:
        try:
            for begin, samples in _completed(threads, meet, range(0, count, share), workers):
                for k, sample in enumerate(samples, begin):
                    if sample is None:
                        left.append(k)
                    else:
                        found[group.places[k]] = sample
                        advance(group.expected)
        except BaseException:
            meetings.stop()
            raise
    return sorted(left)


def _samples(group: Group, part: slice, meetings: ManyMeetings) -> list[Sample | None]:
    velocities = group.velocities[part]
    met = meetings.meet(group.starts(part), velocities)
    bars = met.step_error + met.rounding
    samples: list[Sample | None] = []
    for k, seed in enumerate(group.seeds[part]):
        if not met.met[k]:
            samples.append(None)
            continue
        eta = float(met.restitution[k])
        samples.append(
            Sample(
                seed=seed,
                velocity=float(velocities[k]),
                restitution=eta,
                restitution_error=float(bars[k]),
                kinematic_restitution=math.sqrt(eta),
                contacts=int(met.contacts[k]),
                last_contact_time=float(met.last_contact_times[k]),
                ending="proved" if met.proved[k] else "argued",
                scheme=meetings.scheme,
                timestep=float(met.timesteps[k]),
                tolerance_met=True,
            )
        )
    return samples


def _collide_alone(
    tasks: list[tuple[int, Group, int]],
    found: list[Sample | None],
    workers: int,
    advance: Advance,
) -> None:
    """Carry out collisions by themselves."""
    quick = all(group.together for _, group, _ in tasks) and len(tasks) <= _FEW
    if workers == 1 or len(tasks) == 1 or quick:
        for place, group, k in tasks:
            found[place] = _sample(carry_out(group.scene_of(k)), group, k)
            advance(group.expected)
        return
    with ProcessPool(min(workers, len(tasks))) as pool:
        scenes = (group.scene_of(k) for _, group, k in tasks)
        for number, future in as_they_end(pool, carry_out, scenes, 2 * workers):
            place, group, k = tasks[number]
            found[place] = _sample(_attempt(future, group, k), group, k)
            advance(group.expected)


def _attempt(future: Future, group: Group, k: int) -> Attempt:
    try:
        return future.result()
    except WorkerDiedError as error:
        return Attempt(group.scene_of(k), None, Failure.from_error(error), host_name())


def _sample(attempt: Attempt, group: Group, k: int) -> Sample:
    seed, velocity = group.seeds[k], float(group.velocities[k])
    result = attempt.collision
    if result is None:
        assert attempt.failure is not None
        return Sample(seed, velocity, reason=attempt.failure.message)
    return Sample(
        seed=seed,
        velocity=velocity,
        restitution=result.restitution,
        restitution_error=result.restitution_error,
        kinematic_restitution=result.kinematic_restitution,
        contacts=result.contacts,
        last_contact_time=result.last_contact_time,
        ending=result.ending,
        scheme=result.scheme,
        timestep=result.timestep,
        tolerance_met=result.tolerance_met,
        reason=result.reason,
    )


def _completed(
    executor: Executor, function: Callable[[int], Any], arguments: range, workers: int
) -> Any:
    """Yield what a function returns, as it comes; what is not begun is dropped at an interrupt."""
    pending: set[Future] = set()
    left = iter(arguments)
    try:
        while True:
            while len(pending) < 2 * workers and (argument := next(left, None)) is not None:
                pending.add(executor.submit(function, argument))
            if not pending:
                return
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    finally:
        for future in pending:
            future.cancel()
