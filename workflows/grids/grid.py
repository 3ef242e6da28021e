"""Write a job for each point of a sweep, a manifest, and a script that submits all jobs."""

import csv
import io
import itertools
import warnings
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from chaincor.analysis.atomic_write import made_folder, write_whole
from chaincor.analysis.output_paths import resolve_folder
from chaincor.lammps_inputs.errors import ChaincorError, InputError, one_line
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_file import read_from_anywhere
from chaincor.lammps_inputs.script import SCRIPT_FILE, TABLE_FILE
from chaincor.lammps_inputs.script_plan import NO_WISHES, JobWishes
from chaincor.workflows.accuracy.step_guess import foresee_frequency_ratio
from chaincor.workflows.campaign.points import value_of
from chaincor.workflows.campaign.pool import ProcessPool
from chaincor.workflows.errors import UnsureJobWarning
from chaincor.workflows.given import workers_given
from chaincor.workflows.grids.submission import BY_BASH, Submission
from chaincor.workflows.job import job_files

MANIFEST = "manifest.csv"
# This file contains the requested scene. Another file contains the scene with the chosen numerics.
ASKED = "asked.toml"
_SAFE = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-")
_LONGEST_NAME = 100
# Folder for the bond tables, which several jobs share.
TABLES = "tables"
# Number of jobs that a process creates at a time. Processes are used only for grids with at least
# _LEAST_FOR_PROCESSES jobs, because a process needs a second to start but only 15 ms for a job.
_PART = 32
_LEAST_FOR_PROCESSES = 128
# Files that an earlier run of the job, or a job with its own table, may have left.
_OLD = ("log.lammps", "log.motion", "screen.txt", "chain.restart", "chain.state", TABLE_FILE)


def write_grid(
    scenes: Sequence[Scene],
    axes: Sequence[str],
    folder: Path,
    submission: Submission = BY_BASH,
    *,
    replace_existing: bool = False,
    wishes: JobWishes = NO_WISHES,
) -> dict[str, str]:
    """
    Write a job for each scene, a manifest, and a script that runs the jobs.

    `axes` are the fields in which the points differ. If a point has no job, the manifest gives the
    reason. The manifest is written last, so a folder without a manifest is no complete grid.
    Whatever the `wishes`, jobs are restartable and have guards. Bond tables are in one folder,
    where similar jobs share them. Return, for each folder, the reason why it has no job; the reason
    is empty if it has one. Raise InputError if the folder has a grid already or cannot be written.
    """
    scenes = list(scenes)
    if any(scene.bond.only_pushes for scene in scenes):
        raise InputError(
            "the sweep has beads, and `chaincor collect` cannot identify the output of such jobs. "
            "Write these jobs one by one, or run the sweep with `chaincor sweep`"
        )
    names = [folder_name(scene, axes, number) for number, scene in enumerate(scenes, 1)]
    place = resolve_folder(folder)
    scripts = [path.name for path in place.glob(f"submit*.{submission.scheduler}")]
    present = [name for name in (MANIFEST, *scripts, *names) if (place / name).exists()]
    if present and not replace_existing:
        raise InputError(
            f"the folder {str(folder)!r} has {', '.join(present[:3])} already. Give another "
            "folder, or write the jobs anew with --force"
        )
    refusals: dict[str, str] = {}
    rows = []
    wishes = replace(wishes, restartable=True, guards=True)
    with _written_whole(folder):
        for old in (MANIFEST, *scripts):
            (folder / old).unlink(missing_ok=True)
        tables = SharedTables(folder / TABLES)
        made = zip(scenes, names, _make_jobs(scenes, wishes), strict=True)
        for number, (scene, name, job) in enumerate(made, 1):
            for doubt in job.doubts:
                warnings.warn(doubt, UnsureJobWarning, stacklevel=2)
            if not job.refusal:
                _write_job(scene, folder / name, job.files, tables)
            refusals[name] = job.refusal
            values = [value_of(scene, axis) for axis in axes]
            rows.append([number, name, *values, refusals[name]])
        written = [name for name, refusal in refusals.items() if not refusal]
        for script_name, text in submission.scripts(written, folder).items():
            script = folder / script_name
            script.write_text(text, encoding="utf-8")
            script.chmod(0o755)
        listed = io.StringIO()
        writer = csv.writer(listed, lineterminator="\n")
        writer.writerows([["number", "folder", *axes, "refusal"], *rows])
        write_whole(folder / MANIFEST, listed.getvalue())
    return refusals


@contextmanager
def _written_whole(folder: Path) -> Iterator[None]:
    """Create the folder of a grid, and remove it if the grid cannot be written."""
    try:
        with made_folder(folder, whole=True):
            yield
    except OSError as error:
        raise InputError(
            f"cannot write the jobs into {str(folder)!r}: {error.strerror}; give another folder"
        ) from None


class SharedTables:
    """Folder for the bond tables of a grid; equal tables are written once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: dict[str, str] = {}

    def take_from(self, files: dict[str, str]) -> dict[str, str]:
        """
        Move the table of a job into the folder, and return the other files.

        The script then reads the shared table. If a user's template refers to the table in another
        way, the table stays in the job.
        """
        script, quoted = files[SCRIPT_FILE], f'"./{TABLE_FILE}"'
        if TABLE_FILE not in files or script.count(TABLE_FILE) != script.count(quoted):
            return files
        kept = {name: text for name, text in files.items() if name != TABLE_FILE}
        place = f'"../{TABLES}/{self._name_of(files[TABLE_FILE])}"'
        return kept | {SCRIPT_FILE: script.replace(quoted, place)}

    def _name_of(self, table: str) -> str:
        if table not in self._names:
            name = self._names[table] = f"{len(self._names) + 1}.table"
            self._folder.mkdir(exist_ok=True)
            (self._folder / name).write_text(table, encoding="utf-8")
        return self._names[table]


class _Job(NamedTuple):
    """Files of a point's job, or the reason why the point has no job."""

    files: dict[str, str]  #: Contents of the files by name; empty without a job.
    refusal: str  #: Reason why there is no job; empty if there is one.
    doubts: list[str]  #: Warnings about the job.


def _make_jobs(scenes: Sequence[Scene], wishes: JobWishes) -> Iterator[_Job]:
    """Yield the job for each scene; worker processes create the jobs if there are many."""
    parts = [scenes[k : k + _PART] for k in range(0, len(scenes), _PART)]
    if len(scenes) < _LEAST_FOR_PROCESSES:
        yield from itertools.chain.from_iterable(_make_part(part, wishes) for part in parts)
        return
    workers = min(workers_given(None), len(parts))
    with ProcessPool(workers) as pool:
        pending = deque(pool.submit(_make_part, part, wishes) for part in parts[: 2 * workers])
        for part in [*parts[2 * workers :], *[None] * len(pending)]:
            yield from pending.popleft().result()
            if part is not None:
                pending.append(pool.submit(_make_part, part, wishes))


def _make_part(scenes: Sequence[Scene], wishes: JobWishes) -> list[_Job]:
    """Return the jobs for some scenes, without writing files."""
    # Computing the frequency ratios of all scenes together takes much less time than one by one.
    foresee_frequency_ratio(each.problem for each in scenes)
    return [_make_job(scene, wishes) for scene in scenes]


def _make_job(scene: Scene, wishes: JobWishes) -> _Job:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", UnsureJobWarning)
        try:
            files = job_files(scene, wishes, shared_table=True)
        except ChaincorError as error:
            return _Job({}, one_line(error), [])
    return _Job(files, "", [str(each.message) for each in found])


def _write_job(scene: Scene, job: Path, files: dict[str, str], tables: SharedTables) -> None:
    """Write the files of a job, and remove those of an older job."""
    job.mkdir(parents=True, exist_ok=True)
    for old in _OLD:
        # without this, files of an older job would be taken for results
        (job / old).unlink(missing_ok=True)
    files = tables.take_from(files) | {ASKED: read_from_anywhere(scene).to_toml()}
    for name, text in files.items():
        (job / name).write_text(text, encoding="utf-8")


def folder_name(scene: Scene, axes: Sequence[str], number: int) -> str:
    """Return the name of a point's folder: the number of the point and its values on the axes."""
    parts = [f"{number:04d}"]
    for axis in axes:
        value = value_of(scene, axis)
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
        parts.append(f"{axis}={text}" if axis != "potential" else text)
    safe = ["".join(c if c in _SAFE or c in "=_" else "-" for c in part) for part in parts]
    return "_".join(safe)[:_LONGEST_NAME]
