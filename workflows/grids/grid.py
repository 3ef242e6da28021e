"""A folder for each point of a sweep, a manifest, and a script that submits them all."""

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from chaincor.analysis.atomic_write import write_whole
from chaincor.lammps_inputs.errors import ChaincorError, InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script_plan import NO_WISHES, JobWishes
from chaincor.workflows.campaign.points import value_of
from chaincor.workflows.grids.submit import Scheduler, submit_script
from chaincor.workflows.job import job_files

MANIFEST = "manifest.csv"
# The scene that was asked for lies beside the one that says with which numerics it is run.
ASKED = "asked.toml"
_SAFE = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-")
_LONGEST_NAME = 100


@dataclass(frozen=True)
class GridPoint:
    """A job of a grid."""

    folder: str  #: Its name.
    refusal: str = ""  #: Why no job could be written, in one line; empty where it was.


def write_grid(
    scenes: Sequence[Scene],
    axes: Sequence[str],
    folder: Path,
    scheduler: Scheduler,
    *,
    site: str = "",
    replace_existing: bool = False,
    progress: Callable[[int], None] = lambda _: None,
    wishes: JobWishes = NO_WISHES,
) -> list[GridPoint]:
    """
    Write a job for each scene, a manifest and a script that runs them; returns the points.

    `axes` are the fields that tell the points apart; `site` are lines of the user's own for the
    script. Points for which no job can be made are in the manifest with the reason. The manifest
    comes last: a folder without one is no grid. Jobs are restartable and have guards, whatever
    the `wishes`. Raises InputError if there is a grid already or the folder cannot be written.
    """
    if (folder / MANIFEST).exists() and not replace_existing:
        raise InputError(
            f"the folder {str(folder)!r} has a grid of jobs already; expected a new or empty "
            "folder: give another, or --force to write the jobs anew"
        )
    points, rows = [], []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / MANIFEST).unlink(missing_ok=True)
        for number, scene in enumerate(scenes, 1):
            point = _write_point(scene, axes, number, folder, wishes)
            points.append(point)
            rows.append([number, point.folder, *(value_of(scene, axis) for axis in axes)])
            rows[-1].append(point.refusal)
            progress(number)
        names = [point.folder for point in points if not point.refusal]
        script = folder / f"submit.{scheduler}"
        script.write_text(submit_script(scheduler, names, site), encoding="utf-8")
        script.chmod(0o755)
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerows([["number", "folder", *axes, "refusal"], *rows])
        write_whole(folder / MANIFEST, text.getvalue())
    except OSError as error:
        raise InputError(
            f"cannot write the jobs into {str(folder)!r}: {error.strerror}; give another folder"
        ) from None
    return points


def _write_point(
    scene: Scene, axes: Sequence[str], number: int, folder: Path, wishes: JobWishes
) -> GridPoint:
    name = folder_name(scene, axes, number)
    try:
        files = job_files(scene, replace(wishes, restartable=True, guards=True))
    except ChaincorError as error:
        return GridPoint(name, " ".join(str(error).split()))
    job = folder / name
    job.mkdir(exist_ok=True)
    for old in ("log.lammps", "log.motion", "screen.txt", "chain.restart", "chain.state"):
        (job / old).unlink(missing_ok=True)  # of an older job, which would be taken for its result
    for file, text in (files | {ASKED: scene.to_toml()}).items():
        (job / file).write_text(text, encoding="utf-8")
    return GridPoint(name)


def folder_name(scene: Scene, axes: Sequence[str], number: int) -> str:
    """Return a name that tells the point: its number and the values of its axes."""
    parts = [f"{number:04d}"]
    for axis in axes:
        value = value_of(scene, axis)
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
        parts.append(f"{axis}={text}" if axis != "potential" else text)
    safe = ["".join(c if c in _SAFE or c in "=_" else "-" for c in part) for part in parts]
    return "_".join(safe)[:_LONGEST_NAME]
