"""
What a sweep costs beyond its collisions, and what a second process brings.

``python -m tests.benchmarks.sweep_overhead [SPEEDS]`` runs one set of collisions (3 potentials, 5
sizes from 10 to 200, SPEEDS speeds from 0.01 to 5 v*, tolerance 1e-6, LAMMPS; 67 speeds make 1005)
with one worker and with two, and prints both ratios. The machine must have two idle cores.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SWEEP = """
[scene]
tolerance = 1e-6
[axes]
potential = ["lj", "toda", "log"]
particles = [10, 20, 50, 100, 200]
speed = {{ from = 0.01, to = 5.0, points = {speeds}, spacing = "log" }}
"""


def measure(folder: Path, speeds: int, workers: int) -> dict[str, float]:
    """
    Run the sweep into a new store.

    Parameters
    ----------
    folder : pathlib.Path
        Where to write.
    speeds : int
        Speeds on the axis.
    workers : int
        Processes.

    Returns
    -------
    dict
        The summary that ``chaincor sweep --json`` prints.
    """
    sweep, store = folder / "sweep.toml", folder / f"{workers}.sqlite"
    sweep.write_text(SWEEP.format(speeds=speeds))
    store.unlink(missing_ok=True)
    command = [sys.executable, "-c", "from workflows.cli import main; main()", "sweep", str(sweep)]
    options = ["--store", str(store), "--workers", str(workers), "--json"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    # Fast log chains fail by name, which is exit status 1.
    done = subprocess.run(
        [*command, *options], env=environment, capture_output=True, text=True, check=False
    )
    return json.loads(done.stdout)


def main(speeds: int) -> None:
    """
    Measure and print.

    Parameters
    ----------
    speeds : int
        Speeds on the axis.
    """
    with tempfile.TemporaryDirectory() as name:
        measure(Path(name), 2, 2)  # compiles the in-house integrator, if that is to be done
        one, two = (measure(Path(name), speeds, workers) for workers in (1, 2))
    for workers, run in ((1, one), (2, two)):
        overhead = workers * run["seconds"] - run["busy_seconds"]
        print(
            f"{workers} workers: {run['computed']} collisions in {run['seconds']:.1f} s; beyond "
            f"the collisions {overhead:.1f} s, {overhead / run['integration_seconds']:.1%} of the "
            f"integration and {overhead / run['busy_seconds']:.1%} of the collisions"
        )
    print(f"parallel efficiency {one['seconds'] / (2.0 * two['seconds']):.3f}")
    slower = two["busy_seconds"] / one["busy_seconds"]
    print(f"of which the same collisions take {slower:.3f} times longer beside another process")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 67)
