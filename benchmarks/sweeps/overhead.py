"""
Costs of a sweep beyond its integrations, and the gain of a second process.

``python -m benchmarks.sweeps.overhead [SPEEDS [REPEATS]]`` runs one set of collisions (3
potentials, 5 sizes from 10 to 200, SPEEDS speeds from 0.01 to 5 v*, tolerance 1e-6, LAMMPS; 67
speeds make 1005) with one worker and with two in turn, REPEATS times, and prints

- the set-up inside collisions: processor time that is not spent in integrations, with LAMMPS for
  the number and its proof or in-house to choose the step; on a sample, in one process;
- the overhead of store, scheduling and start: from the start of the command to its end, workers x
  wall-clock time - time inside collisions, against the time of the integrations in them;
- the parallel efficiency, wall-clock time with one worker / (2 x that with two). Others on the
  machine spoil it; so beside it stands what does not change with them: the ratio of the shares
  of the time that workers were busy, times the ratio of the processor times of all processes.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps.lammps_collision import ChainCollision
from chaincor.workflows.engines.reference import stepping

ROOT = Path(__file__).resolve().parents[2]
# Bonds that LAMMPS can follow at all these speeds: log ones get too short for it from 1.2 v* on,
# and particles with power bonds pass through each other.
SWEEP = """
[scene]
tolerance = 1e-6
[axes]
bond = [{{potential = "lj"}}, {{potential = "toda"}}, {{potential = "toda", toda_b = 100.0}}]
particles = [10, 20, 50, 100, 200]
speed = {{ from = 0.01, to = 5.0, points = {speeds}, spacing = "log" }}
"""


@dataclass(frozen=True)
class Measurement:
    """One sweep into a new store."""

    #: Processes, and collisions with and without a result.
    workers: int
    computed: int  #: See ``workers``.
    failed: int  #: See ``workers``.
    #: Seconds of the whole command: by the clock, and of all its processes together.
    wall: float
    processor: float  #: See ``wall``.
    collisions: float  #: Seconds by the clock inside collisions.

    @property
    def busy(self) -> float:
        """Share of the workers' time inside collisions."""
        return self.collisions / (self.workers * self.wall)


def measure(folder: Path, speeds: int, workers: int) -> Measurement:
    """Run the sweep into a new store."""
    sweep, store = folder / "sweep.toml", folder / f"{workers}.sqlite"
    sweep.write_text(SWEEP.format(speeds=speeds))
    store.unlink(missing_ok=True)
    command = [
        sys.executable,
        "-c",
        "from chaincor.workflows.cli import main; main()",
        "sweep",
        str(sweep),
    ]
    options = ["--store", str(store), "--workers", str(workers), "--json"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    processor, started = _processor_seconds(), time.perf_counter()
    # Collisions that fail by name make exit status 1.
    done = subprocess.run(
        [*command, *options], env=environment, capture_output=True, text=True, check=False
    )
    wall, processor = time.perf_counter() - started, _processor_seconds() - processor
    summary = json.loads(done.stdout)
    counts = summary["computed"], summary["failed"]
    return Measurement(workers, *counts, wall, processor, summary["busy_seconds"])


def setup_share() -> float:
    """Return processor time inside collisions that is no integration, over that of integrations."""
    integrating = 0.0

    def timed(function):
        def run(*arguments, **options):
            nonlocal integrating
            started = time.process_time()
            try:
                return function(*arguments, **options)
            finally:
                integrating += time.process_time() - started

        return run

    bonds: tuple[dict[str, Any], ...] = (
        {"potential": "lj"},
        {"potential": "toda"},
        {"potential": "toda", "toda_b": 100.0},
    )
    scenes = [
        Scene(**bond, particles=n, speed=speed, tolerance=1e-6)
        for bond in bonds
        for n in (10, 20, 50, 100, 200)
        for speed in (0.02, 0.1, 0.4, 0.9)
    ]
    for bond in bonds:
        collide(Scene(**bond, particles=10, speed=0.4))  # loads compiled code
    with (
        mock.patch.object(ChainCollision, "carry_out", timed(ChainCollision.carry_out)),
        mock.patch.object(stepping, "run", timed(stepping.run)),
    ):
        started = time.process_time()
        for scene in scenes:
            collide(scene)
        return (time.process_time() - started) / integrating - 1.0


def _processor_seconds() -> float:
    """Return the processor time of all processes that were started here and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main(speeds: int, repeats: int) -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as name:
        measure(Path(name), 2, 2)  # compiles the reference engine if needed
        setup = setup_share()
        print(f"set-up inside collisions: {setup:.1%} of the integrations")
        for _ in range(repeats):
            one, two = (measure(Path(name), speeds, workers) for workers in (1, 2))
            for run in (one, two):
                beyond = run.workers * run.wall - run.collisions
                print(
                    f"{run.workers} workers: {run.computed} collisions ({run.failed} failed) in "
                    f"{run.wall:.1f} s by the clock, {run.processor:.1f} s of processors; "
                    f"in collisions {run.collisions:.1f} s; beyond them {beyond:.1f} s, "
                    f"{beyond * (1.0 + setup) / run.collisions:.1%} of the integrations"
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
