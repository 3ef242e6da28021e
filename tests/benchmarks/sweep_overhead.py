"""
What a sweep costs beyond its collisions, and what a second process brings.

``python -m tests.benchmarks.sweep_overhead [SPEEDS [REPEATS]]`` runs one set of collisions (3
potentials, 5 sizes from 10 to 200, SPEEDS speeds from 0.01 to 5 v*, tolerance 1e-6, LAMMPS; 67
speeds make 1005) with one worker and with two in turn, REPEATS times, and prints

- the overhead: everything from the start of the command to its end in which workers were not busy
  with collisions, N workers x wall-clock time - time inside collisions, against the time of the
  integrations: in-house to scout and to choose the step, LAMMPS for the number and for its proof;
- the set-up inside collisions (instances, tables, certificates, error bars) against the same;
- the parallel efficiency, wall-clock time with one worker / (2 x that with two). Others on the
  machine spoil it; so beside it stands what does not change with them: the ratio of the shares
  of the time that workers were busy, times the ratio of the processor times of all processes.
"""

import contextlib
import json
import os
import resource
import sqlite3
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
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
# The proof of a number is a run at twice its step.
_PROOF = 0.5


@dataclass(frozen=True)
class Measurement:
    """
    One sweep into a new store.

    Attributes
    ----------
    workers, computed, failed : int
        Processes, and collisions with and without a result.
    wall, processor : float
        Seconds of the whole command: by the clock, and of all its processes together.
    collisions, integrations : float
        Seconds by the clock inside collisions, and of the integrations in them.
    """

    workers: int
    computed: int
    failed: int
    wall: float
    processor: float
    collisions: float
    integrations: float

    @property
    def overhead(self) -> float:
        """Time of the workers outside collisions, against that of the integrations."""
        return (self.workers * self.wall - self.collisions) / self.integrations

    @property
    def setup(self) -> float:
        """Time inside collisions that is no integration, against that of the integrations."""
        return self.collisions / self.integrations - 1.0

    @property
    def busy(self) -> float:
        """Share of the workers' time inside collisions."""
        return self.collisions / (self.workers * self.wall)


def measure(folder: Path, speeds: int, workers: int) -> Measurement:
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
    Measurement
        What it took.
    """
    sweep, store = folder / "sweep.toml", folder / f"{workers}.sqlite"
    sweep.write_text(SWEEP.format(speeds=speeds))
    store.unlink(missing_ok=True)
    command = [sys.executable, "-c", "from workflows.cli import main; main()", "sweep", str(sweep)]
    options = ["--store", str(store), "--workers", str(workers), "--json"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    processor, started = _processor_seconds(), time.perf_counter()
    # Fast log chains fail by name, which is exit status 1.
    done = subprocess.run(
        [*command, *options], env=environment, capture_output=True, text=True, check=False
    )
    wall, processor = time.perf_counter() - started, _processor_seconds() - processor
    summary = json.loads(done.stdout)
    with contextlib.closing(sqlite3.connect(store)) as connection:
        # The choice of the step is in-house integration throughout.
        (integrations,) = connection.execute(
            f"SELECT sum({1.0 + _PROOF} * seconds + json_extract(details, '$.choice.seconds')) "
            "FROM collisions WHERE restitution IS NOT NULL"
        ).fetchone()
    computed, failed = summary["computed"], summary["failed"]
    busy = summary["busy_seconds"]
    return Measurement(workers, computed, failed, wall, processor, busy, integrations)


def _processor_seconds() -> float:
    """Return the processor time of all processes that were started here and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main(speeds: int, repeats: int) -> None:
    """
    Measure and print.

    Parameters
    ----------
    speeds : int
        Speeds on the axis.
    repeats : int
        Pairs of sweeps.
    """
    with tempfile.TemporaryDirectory() as name:
        measure(Path(name), 2, 2)  # compiles the in-house integrator, if that is to be done
        for _ in range(repeats):
            one, two = (measure(Path(name), speeds, workers) for workers in (1, 2))
            for run in (one, two):
                print(
                    f"{run.workers} workers: {run.computed} collisions ({run.failed} failed) in "
                    f"{run.wall:.1f} s by the clock, {run.processor:.1f} s of processors; "
                    f"integrations {run.integrations:.1f} s; beyond the collisions "
                    f"{run.overhead:.1%} of that, set-up inside them {run.setup:.1%}"
                )
            print(
                f"parallel efficiency {one.wall / (2.0 * two.wall):.3f} by the clock, "
                f"{two.busy / one.busy * one.processor / two.processor:.3f} by busy shares and "
                "processor times",
                flush=True,
            )


if __name__ == "__main__":
    given = [int(argument) for argument in sys.argv[1:]]
    main(*(given + [67, 1][len(given) :]))
