"""Who carries out the scenes of a plan: the processes of a sweep, into a store."""

from collections.abc import Sequence
from pathlib import Path

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.into_store import collide_into_store
from chaincor.workflows.reproduce.measurements import Answer, Runner


def run_into_store(path: Path, workers: int, progress: bool = True) -> Runner:
    """Return a runner that keeps every result, so that nothing finished is computed twice."""

    def run(scenes: Sequence[Scene]) -> list[Answer]:
        rows = collide_into_store(scenes, path, workers=workers, arrays=True, progress=progress)
        return [
            Answer(
                row.result,
                row.arrays,
                None if row.failure is None else f"{row.failure.name}: {row.failure.message}",
            )
            for row in rows
        ]

    return run
