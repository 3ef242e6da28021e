"""Who carries out the scenes of a plan: a store with its processes, or this process alone."""

from collections.abc import Sequence
from pathlib import Path

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.measurements import Answer, Runner
from chaincor.workflows.store.attempt import carry_out
from chaincor.workflows.sweep.execution import run_scenes


def run_into_store(path: Path, workers: int, progress: bool = True) -> Runner:
    """Return a runner that keeps every result, so that nothing finished is computed twice."""

    def run(scenes: Sequence[Scene]) -> list[Answer]:
        rows = run_scenes(scenes, path, workers=workers, arrays=True, progress=progress)
        return [
            Answer(
                row.result,
                row.arrays,
                None if row.failure is None else f"{row.failure.name}: {row.failure.message}",
            )
            for row in rows
        ]

    return run


def run_here(scenes: Sequence[Scene]) -> list[Answer]:
    """
    Carry out scenes one after the other, keeping nothing.

    Bonds may be Python objects, which a store cannot keep.
    """
    answers = []
    for attempt in map(carry_out, scenes):
        if attempt.collision is not None:
            answers.append(Answer(attempt.collision.to_dict(), attempt.collision.arrays()))
        else:
            assert attempt.failure is not None
            text = f"{attempt.failure.name}: {attempt.failure.message}"
            answers.append(Answer(None, {}, text))
    return answers
