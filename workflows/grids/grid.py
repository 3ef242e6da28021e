"""A folder for each point of a sweep, a manifest, and a script that submits them all."""

import csv
import io
import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Literal

from chaincor.analysis.atomic_write import made_folder, write_whole
from chaincor.lammps_inputs.errors import ChaincorError, InputError, one_line
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_file import read_from_anywhere
from chaincor.lammps_inputs.script_plan import NO_WISHES, JobWishes
from chaincor.workflows.campaign.points import value_of
from chaincor.workflows.job import job_files, write_files

MANIFEST = "manifest.csv"
# File of the requested scene, beside the scene with the chosen numerics.
ASKED = "asked.toml"
_SAFE = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-")
_LONGEST_NAME = 100


Scheduler = Literal["slurm", "pbs", "bash"]

_HEADS = {
    "slurm": "#SBATCH --job-name=chaincor\n#SBATCH --array=1-{count}\n#SBATCH --ntasks=1\n",
    "pbs": "#PBS -N chaincor\n#PBS -J 1-{count}\n#PBS -l select=1:ncpus=1\n",
    "bash": "",
}
# PBS knows no array of one job.
_HEAD_OF_ONE = {"pbs": "#PBS -N chaincor\n#PBS -l select=1:ncpus=1\n"}
# Schedulers run a copy of the script from a spool folder, so its own place does not tell where the
# jobs are. Each place that may hold them is tried.
_PLACES = {
    "slurm": (
        '"${SLURM_SUBMIT_DIR:-.}"',
        '"$(scontrol show job "${SLURM_JOB_ID:-0}" 2> /dev/null |\n'
        "        sed -n 's/^ *Command=\\(.*\\)\\/.*/\\1/p')\"",
    ),
    "pbs": ('"${PBS_O_WORKDIR:-.}"',),
    "bash": (),
}
_COMMON = """\
# Jobs that have their result are left alone. Jobs that were stopped continue from their last
# restart file. LMP is the command that runs LAMMPS, RESTART the number of contacts between two
# restart files, JOBS the folder of the jobs if it was moved.
set -u
folders=(
{folders}
)
found=
for place in "${{JOBS:-}}" "$(dirname "$0")" {places} {written}; do
    if [ -n "$place" ] && [ -f "$place/manifest.csv" ] && [ -d "$place/${{folders[0]}}" ]; then
        found=$place
        break
    fi
done
if [ -z "$found" ] || ! cd "$found"; then
    echo "the folder of the jobs is not found: set JOBS to the folder of manifest.csv" >&2
    exit 1
fi
run_job() {{
    local resume=()
    cd "$1" || return 1
    grep -qs '^restitution_error = ' log.lammps && return 0
    # Of a run that was stopped, not of one that failed.
    if [ -s chain.state ] && [ -s chain.restart ] && ! grep -qs '^ERROR' screen.txt; then
        resume=(-var resume 1)
    fi
    ${{LMP:-lmp}} -in in.chain -var restart "${{RESTART:-20}}" \\
        ${{resume[@]+"${{resume[@]}}"}} > screen.txt 2>&1
}}
"""
_TAILS = {
    "slurm": 'run_job "${folders[$((SLURM_ARRAY_TASK_ID - 1))]}"\n',
    "pbs": 'run_job "${folders[$((${PBS_ARRAY_INDEX:-1} - 1))]}"\n',
    "bash": """\
# WORKERS jobs at a time; one that fails does not stop the others.
export -f run_job
printf '%s\\0' "${folders[@]}" |
    xargs -0 -n 1 -P "${WORKERS:-1}" "$BASH" -c 'run_job "$1" || exit 1' run_job || exit 1
""",
}


def write_grid(
    scenes: Sequence[Scene],
    axes: Sequence[str],
    folder: Path,
    scheduler: Scheduler,
    *,
    site: str = "",
    replace_existing: bool = False,
    wishes: JobWishes = NO_WISHES,
) -> dict[str, str]:
    """
    Write a job for each scene, a manifest and a script that runs them.

    `axes` are the fields that differ between points; `site` are the user's own lines for the
    script. Points without a job are in the manifest with the reason. The manifest is written last,
    so a folder without one is no grid. Jobs are restartable and have guards, whatever the `wishes`.
    Returns for each folder the reason why it has no job, empty if it has one. Raises InputError if
    there is a grid already or the folder cannot be written.
    """
    if any(scene.bond.only_pushes for scene in scenes):
        raise InputError(
            "the sweep has beads, whose jobs print nothing by which `chaincor collect` knows them. "
            "Write their jobs one by one, or run the sweep with `chaincor sweep`"
        )
    names = [folder_name(scene, axes, number) for number, scene in enumerate(scenes, 1)]
    script_name = f"submit.{scheduler}"
    present = [name for name in (MANIFEST, script_name, *names) if (folder / name).exists()]
    if present and not replace_existing:
        raise InputError(
            f"the folder {str(folder)!r} has {', '.join(present[:3])} already. Give another "
            "folder, or write the jobs anew with --force"
        )
    refusals: dict[str, str] = {}
    rows = []
    with _written_whole(folder):
        (folder / MANIFEST).unlink(missing_ok=True)
        for number, (scene, name) in enumerate(zip(scenes, names, strict=True), 1):
            refusals[name] = _write_point(scene, folder / name, wishes)
            values = [value_of(scene, axis) for axis in axes]
            rows.append([number, name, *values, refusals[name]])
        written = [name for name, refusal in refusals.items() if not refusal]
        script = folder / script_name
        script.write_text(submit_script(scheduler, written, site, folder), encoding="utf-8")
        script.chmod(0o755)
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerows([["number", "folder", *axes, "refusal"], *rows])
        write_whole(folder / MANIFEST, text.getvalue())
    return refusals


@contextmanager
def _written_whole(folder: Path) -> Iterator[None]:
    """Make the folder of a grid, and remove it if the grid cannot be written."""
    try:
        with made_folder(folder, whole=True):
            yield
    except OSError as error:
        raise InputError(
            f"cannot write the jobs into {str(folder)!r}: {error.strerror}; give another folder"
        ) from None


def _write_point(scene: Scene, job: Path, wishes: JobWishes) -> str:
    """Write one job, and return the reason of a failure, empty after success."""
    try:
        files = job_files(scene, replace(wishes, restartable=True, guards=True))
    except ChaincorError as error:
        return one_line(error)
    for old in ("log.lammps", "log.motion", "screen.txt", "chain.restart", "chain.state"):
        (job / old).unlink(missing_ok=True)  # files of an older job would pass for results
    asked = read_from_anywhere(scene).to_toml()
    write_files(files | {ASKED: asked}, job, replace_existing=True)
    return ""


def folder_name(scene: Scene, axes: Sequence[str], number: int) -> str:
    """Return the folder name of a point: its number and the values of its axes."""
    parts = [f"{number:04d}"]
    for axis in axes:
        value = value_of(scene, axis)
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
        parts.append(f"{axis}={text}" if axis != "potential" else text)
    safe = ["".join(c if c in _SAFE or c in "=_" else "-" for c in part) for part in parts]
    return "_".join(safe)[:_LONGEST_NAME]


def submit_script(
    scheduler: Scheduler, folders: Sequence[str], site: str = "", written: Path | None = None
) -> str:
    """
    Return a script that runs the jobs in some folders beside it.

    `site` are the user's own lines, such as ``#SBATCH --time=1:00:00`` or ``module load lammps``,
    at the place where a scheduler reads its options. `written` is the folder of the jobs. The
    script searches it last, after JOBS, its own folder and the folder of submission.
    """
    count = len(folders)
    head = (_HEAD_OF_ONE if count == 1 else {}).get(scheduler, _HEADS[scheduler])
    quoted = "\n".join(f"    {shlex.quote(folder)}" for folder in folders)
    common = _COMMON.format(
        folders=quoted,
        places=" ".join(_PLACES[scheduler]),
        written="" if written is None else shlex.quote(str(written.resolve())),
    )
    site = site if not site or site.endswith("\n") else f"{site}\n"
    return f"#!/bin/bash\n{head.format(count=count)}{site}{common}{_TAILS[scheduler]}"
