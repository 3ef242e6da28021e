"""Build the result of a collision from the run of an engine and its error bar."""

import time
from typing import Any, cast

from chaincor.analysis.observables import OF_RUNS
from chaincor.analysis.run_record import RunRecord
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.bounded_run import BoundedRun
from chaincor.workflows.accuracy.solvers import ADAPTIVE_STEPS, solver_of_outcome
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import modal
from chaincor.workflows.engines.replay import Replay
from chaincor.workflows.result import Collision
from chaincor.workflows.versions import versions


def result_of(
    scene: Scene, bounded_run: BoundedRun, started: float, energies: Array | None = None
) -> Collision:
    """
    Return the result of a collision from its `bounded_run`.

    `started` is the value of ``time.perf_counter`` at which the work began. `energies` contains the
    mode energies, of shape (n,), if they are known already.
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
        known_energies=energies,
    )
    values: dict[str, Any] = {each.name: each.compute(record) for each in OF_RUNS}
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
