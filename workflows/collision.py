"""One collision from a scene to its result: the function that everything else calls."""

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import overload

from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.thermal_state import GENERATOR
from chaincor.workflows.accuracy import meet
from chaincor.workflows.accuracy.answer import Answer, spread_of
from chaincor.workflows.accuracy.at_once.together import companies, meet_together
from chaincor.workflows.accuracy.error_bars import PROOF_SHARE, PROOF_STEPS, error_bar, proof_error
from chaincor.workflows.accuracy.expected_cost import expected_of_task, refuse_endless
from chaincor.workflows.accuracy.in_house_runs import eta_of
from chaincor.workflows.accuracy.scouting import scout, scouting_details
from chaincor.workflows.accuracy.step_guess import foresee_sharpness
from chaincor.workflows.accuracy.table_rows import with_rows
from chaincor.workflows.engines.in_house import stepping
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.time_limit import limited_to
from chaincor.workflows.given import scenes_given, workers_given
from chaincor.workflows.outputs import refuse_shared_outputs, refuse_unusable_outputs
from chaincor.workflows.processes.in_flight import as_they_end
from chaincor.workflows.processes.pool import ProcessPool
from chaincor.workflows.processes.progress import progress_bar
from chaincor.workflows.result import Collision
from chaincor.workflows.result_of import result_of

# A collision of a day is seldom meant.
MOST_SECONDS = 86400.0
# Seconds in which new processes are hardly up.
_SOONER_HERE = 3.0


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
    progress: bool = True,
) -> list[Collision]: ...


def collide(
    scene: Scene | Iterable[Scene],
    tolerance: float | None = None,
    *,
    most_seconds: float = MOST_SECONDS,
    workers: int | None = None,
    progress: bool = True,
) -> Collision | list[Collision]:
    """
    Carry out one collision, or several.

    With explicit numerics a scene is run as it says, and for the error bar again at half the
    step and at two others. Otherwise the numerics that usually meet the tolerance most cheaply are
    taken, and the result is proved by a second step.

    Parameters
    ----------
    scene : Scene or iterable of Scene
        What collides, with which engine. Scenes that take longer than a few seconds together are
        shared out among processes: a script that asks for those needs the usual
        ``if __name__ == "__main__":``.
    tolerance : float, optional
        Absolute error asked of eta; overrides the scene's.
    most_seconds : float
        How long each may take: what is expected to take longer is not begun, and what does is
        answered with the error reached by then, or stopped where there is no number yet.
    workers : int, optional
        Of several scenes: how many are carried out at a time; one a core by default.
    progress : bool
        Of several scenes: whether to show a progress bar, on a terminal or in a notebook.

    Returns
    -------
    Collision or list of Collision
        The result; of several scenes all, in their order. Where a tolerance could not be met,
        `tolerance_met` is False and `reason` says why.

    Raises
    ------
    InputError
        If this is no scene, a tolerance is given together with explicit numerics, or outputs have
        no place.
    CostError
        If it is expected to take longer than `most_seconds`, and nothing was begun, or if it took
        longer and has no number yet.
    RunError
        If no number that can be trusted came out; each cause has a name. Of several scenes the
        first one that fails stops all: `collide_many` and `run_scenes` go on.
    """
    try:
        if isinstance(scene, Scene):
            return _collide(scene, tolerance, most_seconds)
        return _collide_each(scenes_given(scene), tolerance, most_seconds, workers, progress)
    except KeyboardInterrupt as interrupt:
        # Where it happened to be says nothing, and a notebook takes seconds to show it.
        raise interrupt.with_traceback(None) from None


def _collide_each(
    scenes: list[Scene],
    tolerance: float | None,
    most_seconds: float,
    workers: int | None,
    progress: bool,
) -> list[Collision]:
    workers = min(workers_given(workers), len(scenes))
    if tolerance is not None:
        scenes = [scene.replace(tolerance=tolerance) for scene in scenes]
    refuse_shared_outputs(scenes)
    foresee_sharpness(scenes)
    for scene in scenes:
        refuse_unusable_outputs(scene)
        refuse_endless(scene, most_seconds)
    found: list[Collision | None] = [None] * len(scenes)
    tasks = companies(scenes, 2 * workers)
    costs = [0.0] * len(scenes)
    for places in tasks:
        expected = expected_of_task([scenes[place] for place in places])
        for place, cost in zip(places, expected, strict=True):
            costs[place] = cost
    with progress_bar(progress, len(scenes), sum(costs)) as advance:

        def keep(places: list[int], results: Iterable[Collision | None]) -> list[list[int]]:
            """Take results over; return which collisions are left to be carried out alone."""
            alone = []
            for place, result in zip(places, results, strict=True):
                found[place] = result
                if result is None:
                    alone.append([place])
                else:
                    advance(costs[place])
            return alone

        if workers < 2 or sum(costs) < _SOONER_HERE:
            while tasks:
                places = tasks.pop(0)
                with _named(places, scenes):
                    tasks = keep(places, _collide_task([scenes[k] for k in places])) + tasks
        else:
            with ProcessPool(workers) as pool:
                while tasks:
                    given = [[scenes[k] for k in places] for places in tasks]
                    left = []
                    for number, future in as_they_end(pool, _collide_task, given, 2 * workers):
                        with _named(tasks[number], scenes):
                            left += keep(tasks[number], future.result())
                    tasks = left
    return [result for result in found if result is not None]


def _collide_task(scenes: list[Scene]) -> Sequence[Collision | None]:
    if len(scenes) == 1:
        return [_collide(scenes[0], None, math.inf)]
    return collide_together(scenes)


@contextmanager
def _named(places: list[int], scenes: list[Scene]) -> Iterator[None]:
    """Say of which scene an error is, and of a named one nothing else."""
    try:
        yield
    except ChaincorError as error:
        first = places[0]
        error.__notes__ = [f"scene {first + 1} of {len(scenes)}: {scenes[first]!r}"]
        raise error.with_traceback(None) from None


def _collide(scene: Scene, tolerance: float | None, most_seconds: float) -> Collision:
    started = time.perf_counter()
    if tolerance is not None:
        scene = scene.replace(tolerance=tolerance)
    refuse_unusable_outputs(scene)
    refuse_endless(scene, most_seconds)
    asked = scene.asked_tolerance
    with limited_to(most_seconds):
        answer = _run_as_given(scene) if asked is None else meet.meet(scene, asked)
        answer = with_rows(scene, answer, asked)
    if scene.temperature is not None:
        gap = float(scene.line.strains[scene.line.gap])
        drawn = {"draw": {"generator": GENERATOR, "gap": gap}}
        answer = replace(answer, details=answer.details | drawn)
    result = result_of(scene, answer, started)
    if scene.arrays is not None:
        result.save_arrays(scene.arrays)
    return result


def collide_together(scenes: Sequence[Scene]) -> list[Collision | None]:
    """
    Carry out collisions of one kind at once, see ``accuracy.at_once.together``.

    Each result is what :func:`collide` gives, but for the seconds it took; None where it has to be
    asked.
    """
    started = time.perf_counter()
    answers = meet_together(scenes)
    whole = time.perf_counter() - started
    found: list[Collision | None] = []
    for scene, answered in zip(scenes, answers, strict=True):
        if answered is None:
            found.append(None)
            continue
        answer, energies = answered
        begun = time.perf_counter() - whole / len(scenes)
        found.append(result_of(scene, answer, begun, energies))
    return found


def _run_as_given(scene: Scene) -> Answer:
    numerics = Numerics.from_scene(scene)
    scouted = scout(scene)
    if scouted is not None:
        numerics = replace(numerics, bond_range=scouted.table_range(scene))
    timesteps = [numerics.timestep]
    if scene.error:
        timesteps += [share * numerics.timestep for share in PROOF_STEPS]
    if scene.engine == "lammps":
        outcome, *others = lammps.run_at_steps(scene, numerics, timesteps)
    else:
        outcome, *others = (stepping.run(scene, replace(numerics, timestep=h)) for h in timesteps)
    found = scouting_details(scouted)
    step = None
    if others:
        eta = eta_of(scene, outcome)
        step = proof_error(numerics.wall, [eta_of(scene, run) - eta for run in others])
        # Arrays err by as much more than they differ as eta does.
        share = PROOF_SHARE[numerics.wall]
        spreads = [spread_of(scene, outcome, run) for run in others]
        found["spread"] = {name: share * max(s[name] for s in spreads) for name in spreads[0]}
    return Answer(outcome, error_bar(outcome, scene, step), details=found)
