"""Scripts that run a grid of jobs: an array of Slurm or PBS, or plain bash."""

import shlex
from collections.abc import Sequence
from typing import Literal

Scheduler = Literal["slurm", "pbs", "bash"]

_HEADS = {
    "slurm": "#SBATCH --job-name=chaincor\n#SBATCH --array=1-{count}\n#SBATCH --ntasks=1\n",
    "pbs": "#PBS -N chaincor\n#PBS -J 1-{count}\n#PBS -l select=1:ncpus=1\n",
    "bash": "",
}
# PBS knows no array of one job.
_HEAD_OF_ONE = {"pbs": "#PBS -N chaincor\n#PBS -l select=1:ncpus=1\n"}
_FOLDERS = {
    "slurm": 'cd "${SLURM_SUBMIT_DIR:-$(dirname "$0")}"',
    "pbs": 'cd "${PBS_O_WORKDIR:-$(dirname "$0")}"',
    "bash": 'cd "$(dirname "$0")"',
}
_COMMON = """\
# Jobs that have their result are left alone; those that were stopped go on from their last restart
# file. LMP is the command that runs LAMMPS, RESTART the contacts between two restart files.
set -u
{cd}
folders=(
{folders}
)
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


def submit_script(scheduler: Scheduler, folders: Sequence[str], site: str = "") -> str:
    """
    Return a script that runs the jobs in some folders beside it.

    `site` are lines of the user's own, such as ``#SBATCH --time=1:00:00`` or ``module load
    lammps``; they stand where a scheduler reads its options.
    """
    count = len(folders)
    head = (_HEAD_OF_ONE if count == 1 else {}).get(scheduler, _HEADS[scheduler])
    quoted = "\n".join(f"    {shlex.quote(folder)}" for folder in folders)
    common = _COMMON.format(cd=_FOLDERS[scheduler], folders=quoted)
    site = site if not site or site.endswith("\n") else f"{site}\n"
    return f"#!/bin/bash\n{head.format(count=count)}{site}{common}{_TAILS[scheduler]}"
