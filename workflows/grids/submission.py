"""Write scripts that submit the jobs of a grid to Slurm, PBS or bash."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

Scheduler = Literal["slurm", "pbs", "bash"]
SCHEDULERS: tuple[Scheduler, ...] = get_args(Scheduler)

_HEADS = {
    "slurm": "#SBATCH --job-name=chaincor\n#SBATCH --array=1-{count}{at_once}\n"
    "#SBATCH --ntasks=1\n",
    "pbs": "#PBS -N chaincor\n#PBS -J 1-{count}{at_once}\n#PBS -l select=1:ncpus=1\n",
    "bash": "",
}
# PBS does not support an array of one job.
_HEAD_OF_ONE = {"pbs": "#PBS -N chaincor\n#PBS -l select=1:ncpus=1\n"}
# Schedulers run a copy of the script in a spool folder, where there are no jobs. The script
# therefore tries each of these folders in which the jobs may be.
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
# If a job fails, the next job of its task still runs.
_TASK = """\
status=0
for job in "${{folders[@]:({task} - 1) * {jobs}:{jobs}}}"; do
    (run_job "$job") || status=1
done
exit $status
"""
_TASK_NUMBER = {"slurm": "SLURM_ARRAY_TASK_ID", "pbs": "${PBS_ARRAY_INDEX:-1}"}
_ALL = """\
# WORKERS jobs at a time; one that fails does not stop the others.
export -f run_job
printf '%s\\0' "${{folders[@]}}" |
    xargs -0 -n 1 -P "${{WORKERS:-{workers}}}" "$BASH" -c 'run_job "$1" || exit 1' run_job || exit 1
"""
# Largest number of tasks in an array: for Slurm from its usual MaxArraySize of 1001, for PBS from
# max_array_size.
_MOST_TASKS = {"slurm": 1000, "pbs": 10_000}


@dataclass(frozen=True)
class Submission:
    """Scheduler for a grid, and the division of its jobs into tasks."""

    scheduler: Scheduler = "bash"
    jobs_per_task: int = 1  #: Number of jobs that a task runs one after the other.
    at_once: int | None = None  #: Largest number of simultaneous tasks; None for no limit.
    site: str = ""  #: A user's own lines, which are written where a scheduler reads its options.

    def scripts(self, folders: Sequence[str], written: Path | None = None) -> dict[str, str]:
        """
        Return scripts that submit the jobs in some folders, by file name.

        Each script submits one job array. It searches for the jobs in the folder JOBS, in its own
        folder, in the folder from which it was submitted, and in `written`.
        """
        most = self.jobs_per_task * _MOST_TASKS.get(self.scheduler, max(len(folders), 1))
        parts = [folders[k : k + most] for k in range(0, len(folders), most)] or [folders]
        if len(parts) == 1:
            return {f"submit.{self.scheduler}": self._script(folders, written)}
        return {
            f"submit-{number}.{self.scheduler}": self._script(part, written)
            for number, part in enumerate(parts, 1)
        }

    def _script(self, folders: Sequence[str], written: Path | None) -> str:
        count = -(-len(folders) // self.jobs_per_task)
        head = (_HEAD_OF_ONE if count == 1 else {}).get(self.scheduler, _HEADS[self.scheduler])
        head = head.format(count=count, at_once="" if self.at_once is None else f"%{self.at_once}")
        common = _COMMON.format(
            folders="\n".join(f"    {shlex.quote(folder)}" for folder in folders),
            places=" ".join(_PLACES[self.scheduler]),
            written="" if written is None else shlex.quote(str(written.resolve())),
        )
        site = self.site if not self.site or self.site.endswith("\n") else f"{self.site}\n"
        if self.scheduler == "bash":
            tail = _ALL.format(workers=self.at_once or 1)
        else:
            tail = _TASK.format(task=_TASK_NUMBER[self.scheduler], jobs=self.jobs_per_task)
        return f"#!/bin/bash\n{head}{site}{common}{tail}"


BY_BASH = Submission()
