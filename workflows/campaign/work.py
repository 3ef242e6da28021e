"""Carry out the collisions of a task inside a worker."""

import math
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, cast

import numpy as np

from chaincor.analysis.observables import OF_RUNS
from chaincor.analysis.run_record import RunRecord, missed_strain
from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.lammps_inputs.thermal_state import GENERATOR
from chaincor.workflows.accuracy.batching import batches, solve_batch
from chaincor.workflows.accuracy.bounded_run import BoundedRun
from chaincor.workflows.accuracy.plan import Plan
from chaincor.workflows.accuracy.plans import plans
from chaincor.workflows.accuracy.solve import run_as_planned
from chaincor.workflows.accuracy.solvers import ADAPTIVE_STEPS, solver_of_outcome
from chaincor.workflows.accuracy.table_rows import with_rows
from chaincor.workflows.campaign.carry_out import MACHINE_FAILURES
from chaincor.workflows.campaign.points import Point, scenes_of
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import modal
from chaincor.workflows.engines.replay import Replay
from chaincor.workflows.engines.time_limit import limited_to
from chaincor.workflows.errors import MissingLibraryError
from chaincor.workflows.result import Collision
from chaincor.workflows.store.row import Row
from chaincor.workflows.versions import versions

# By default, a collision is refused if it is expected to take longer than a day.
MOST_SECONDS = 86400.0
# A Dask worker may have several threads, but LAMMPS supports only one run at a time in a process.
_one_at_a_time = threading.Lock()


def collide_one(scene: Scene, most_seconds: float, planned: Plan) -> Collision:
    """Carry out a planned collision as in :func:`chaincor.workflows.collision.collide`."""
    started = time.perf_counter()
    asked = planned.tolerance
    with limited_to(most_seconds):
        answer = run_as_planned(planned)
        answer = with_rows(scene, answer, asked)
    if scene.temperature is not None:
        gap = float(scene.line.strains[scene.line.gap])
        drawn = {"draw": {"generator": GENERATOR, "gap": gap}}
        answer = replace(answer, details=answer.details | drawn)
    result = _result_of(scene, answer, started)
    if scene.arrays is not None:
        result.save_arrays(scene.arrays)
    return result


def _result_of(
    scene: Scene,
    bounded_run: BoundedRun,
    started: float,
    known: Mapping[str, Any] = MappingProxyType({}),
) -> Collision:
    """
    Return the result of a collision from its `bounded_run`.

    `started` is the value of ``time.perf_counter`` at which the work began. `known`
    contains observables that have been computed already, by name.
    """
    outcome, found = bounded_run.outcome, bounded_run.details
    record = RunRecord(
        scene=scene,
        outcome=outcome,
        bar=bounded_run.bar,
        restitution=outcome.eta,
        reason=bounded_run.reason,
        details=found,
        others=bounded_run.others,
        seconds_total=time.perf_counter() - started,
        versions=versions(),
        looks=modal.SAMPLE_INTERVAL if modal.supports(scene.problem) else None,
    )
    values: dict[str, Any] = {
        each.name: known[each.name] if each.name in known else each.compute(record)
        for each in OF_RUNS
    }
    return Collision(**values, replay=_replay(scene, outcome, found))


def _replay(scene: Scene, outcome: Outcome, found: dict[str, Any]) -> Replay:
    numerics, accuracy = outcome.numerics, 0.0
    if numerics is None and outcome.timestep is not None:
        scheme = cast(StepSchemeName, outcome.scheme)
        numerics = Numerics(scheme=scheme, timestep=outcome.timestep)
    solver = solver_of_outcome(outcome.engine, outcome.scheme)
    if solver is ADAPTIVE_STEPS and "choice" in found:
        accuracy = found["choice"]["tries"][-1]["accuracy"]
    return Replay(scene, solver, numerics, accuracy)


def collide_together(
    scenes: Sequence[Scene], planned: Sequence[Plan] | None = None
) -> list[Collision | None]:
    """
    Return the results of a batch; None for each scene that needs :func:`collide_one`.

    The chains differ only in their speed, and share some observables.
    """
    started = time.perf_counter()
    answers = solve_batch(planned or plans(scenes))
    each_took = (time.perf_counter() - started) / len(scenes)
    runs = [answer[0].outcome for answer in answers if answer is not None]
    steps, lows, highs = (
        np.array([getattr(run, name) for run in runs])
        for name in ("timestep", "bond_min", "bond_max")
    )
    missed = missed_strain(scenes[0].bond, scenes[0].line.lightest, steps, lows, highs)
    bond_errors, shared = iter(missed.tolist()), dict[str, Any]()
    results: list[Collision | None] = [None] * len(scenes)
    for place, answer in enumerate(answers):
        if answer is None:
            continue
        known = shared | {"mode_energies": answer[1], "bond_error": next(bond_errors)}
        began = time.perf_counter() - each_took
        result = results[place] = _result_of(scenes[place], answer[0], began, known)
        shared = shared or {e.name: getattr(result, e.name) for e in OF_RUNS if e.shared}
    return results


def collide_scenes(scenes: Sequence[Scene]) -> list[Collision | Exception | None]:
    """
    Carry out the collisions of one task inside a worker, in batches if possible.

    Named failures are returned in place of a result, and so are failures of the machine, such as a
    lack of memory or disk space. If a batch fails, each collision must be computed alone and gets
    its own error. Other errors, which come from the program or the user's own bond, are raised.

    Raise MissingLibraryError if no collision can be run on this machine.
    """
    found: list[Collision | Exception | None] = [None] * len(scenes)
    with _one_at_a_time:
        for places, planned in batches(scenes):
            chosen = [scenes[place] for place in places]
            met = [None] if len(chosen) == 1 else _try_together(chosen, planned)
            for place, scene, one, each in zip(places, chosen, planned, met, strict=False):
                found[place] = _try_one(scene, one) if each is None else each
    return found


def _try_together(scenes: Sequence[Scene], planned: Sequence[Plan]) -> Sequence[Collision | None]:
    """
    Return the results of a batch.

    The list is empty if the batch fails. Then each collision must be computed in its own task.
    """
    try:
        return collide_together(scenes, planned)
    except MissingLibraryError:
        raise
    except (ChaincorError, *MACHINE_FAILURES):
        return []


def _try_one(scene: Scene, planned: Plan) -> Collision | Exception:
    try:
        # The total cost of many collisions has already been checked. No single collision is
        # refused.
        return collide_one(scene, math.inf, planned)
    except MissingLibraryError:
        raise
    except (ChaincorError, *MACHINE_FAILURES) as error:
        return error


def collide_to_rows(
    scenes: Sequence[Scene | Point], *, details: bool = True, arrays: bool = True
) -> list[Row | None]:
    """Carry out collisions by :func:`collide_scenes`, and create the rows for a store."""
    made = scenes_of(scenes)
    rows = [
        None if each is None else Row.of(each, arrays=arrays).of_scene(scene)
        for each, scene in zip(collide_scenes(made), made, strict=True)
    ]
    return rows if details else [None if row is None else row.without_details() for row in rows]
