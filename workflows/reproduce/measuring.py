"""Compute the points of a plan by LAMMPS, the reference engine and the echo method."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from chaincor.analysis.slow_chains.harmonic import collide_long_chains
from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, Scene
from chaincor.workflows.accuracy.solvers import LAMMPS
from chaincor.workflows.accuracy.step_guess import frequency_ratio
from chaincor.workflows.campaign.into_store import collide_into_store
from chaincor.workflows.reproduce.measurements import Answer, MeasuredPoint, Measurements
from chaincor.workflows.reproduce.plan import ReproductionPlan, Study
from chaincor.workflows.validation.comparison import SHARPER, judging_scene

# A runner is a function that returns results for scenes, in the same order.
MeasurementRunner = Callable[[Sequence[Scene]], Sequence[Answer]]


def measure(
    plan: ReproductionPlan, planned: tuple[Study, ...], run: MeasurementRunner
) -> Measurements:
    """Compute the points of all studies in one call to `run`; a failed scene gets no result."""
    for_lammps = dict.fromkeys(scene for study in planned for scene in study.scenes)
    reference = {scene: _reference_twin(scene) for scene in for_lammps}
    for scene in (scene for study in planned for scene in study.reference):
        reference.setdefault(scene, scene.replace(wall=None, engine="reference"))
    wanted = list(dict.fromkeys([*for_lammps, *reference.values()]))
    answers = dict(zip(wanted, run(wanted), strict=True))
    echoed = by_echo([scene for study in planned for scene in study.echoed])

    def point(scene: Scene) -> MeasuredPoint:
        if scene not in reference:
            return MeasuredPoint(scene, None, echoed[scene])
        by_lammps = answers[scene] if scene in for_lammps else None
        return MeasuredPoint(scene, by_lammps, answers[reference[scene]])

    points = {study.key: tuple(map(point, study.all_scenes)) for study in planned}
    return Measurements(plan, planned, points)


def _reference_twin(scene: Scene) -> Scene:
    """
    Return the scene with which the reference engine checks a scene for LAMMPS.

    The tolerance is a tenth of LAMMPS's tolerance. If the bonds are too stiff for LAMMPS, the
    report shows the result of the reference engine, and the tolerance is the scene's own.
    """
    share = 1.0 if frequency_ratio(scene.problem) > LAMMPS.sharpest else SHARPER
    return judging_scene(scene, share * (scene.tolerance or DEFAULT_TOLERANCE))


def by_echo(scenes: Sequence[Scene]) -> dict[Scene, Answer]:
    """
    Collide long harmonic chains by the echo method.

    The contacts do not depend on the length of a chain until an echo from the free end arrives.
    """
    by_length = {scene.particles: scene for scene in scenes}
    started = time.process_time()
    chains = list(collide_long_chains(by_length))
    seconds = (time.process_time() - started) / max(len(chains), 1)
    return {
        by_length[chain.particles]: Answer(
            {
                "restitution": chain.restitution,
                "restitution_error": chain.restitution_error,
                "tolerance_met": True,
                "contacts": chain.contacts,
                "last_contact_time": chain.last_contact_time,
                "scheme": "echo",
                "seconds_total": seconds,
                "versions": {},
            }
        )
        for chain in chains
    }


def run_into_store(path: Path, workers: int, progress: bool = True) -> MeasurementRunner:
    """Return a runner that stores every result and never computes a stored scene again."""

    def run(scenes: Sequence[Scene]) -> list[Answer]:
        rows = collide_into_store(scenes, path, workers=workers, arrays=True, progress=progress)
        return [
            Answer(
                row.result or {},
                row.arrays,
                None if row.failure is None else f"{row.failure.name}: {row.failure.message}",
            )
            for row in rows
        ]

    return run
