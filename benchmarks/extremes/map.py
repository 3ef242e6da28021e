"""
The map of the extremes: is every answer right, or a clear refusal?

    python -m benchmarks.extremes.map [-o FOLDER] [--workers 2] [--quick]
        [--picture docs/images/extremes_map.png]

Potential x speed x number of particles x engine. Finished cells are kept in FOLDER/cells.jsonl, a
line each, so that the same command goes on where it was stopped. (A results store does not serve:
it keeps neither the judges, which are not scenes, nor time-outs.)

Every cell is asked for eta to 1e-6, within 60 s of processor time; 300 s from 1000 particles on,
and 1800 s from 10000 on.
Its verdict is by rule:

- *green*: the tolerance is claimed, and the judge is within the error bar;
- *amber*: the bar is wider than the tolerance, says so, and the judge is within it; or a named
  refusal of one line with a remedy. A refusal that states a fact of the motion (particles that
  meet, a bond over its barrier) must be confirmed by the judge;
- *red*: anything else: a bar that does not hold, an untrue refusal, an error without a name, a
  warning, a number that is not one, a dead process, a time-out;
- *unverified*: no judge yet, or one that ran out of time or is not sure to 1e-8.

The judge is a method of another kind than that of the answer, with tighter tolerances: Dormand and
Prince's order 8 for what composed or extrapolated Verlet steps, modes, LAMMPS or the limit of hard
spheres answered, and composed steps for what Dormand and Prince's answered. If the limit of hard
spheres cannot be stepped at all (n above 100, or log bonds beyond the range of numbers), the cell
is judged by eta = 1 and counted apart.
"""

import argparse
import json
import math
import re
import signal
import time
import warnings
from collections.abc import Callable, Iterable
from concurrent.futures import as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.extremes.cells import Cell, Found, all_cells
from benchmarks.extremes.verdicts import SUREST_JUDGE, UnsureError, needs_judge, report, verdicts
from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.pool import ProcessPool
from chaincor.workflows.errors import BarrierError, CrossingError, RunError, WorkerDiedError

# Seconds of processor time for each answer and each judge, from these numbers of particles on.
SECONDS = {1: 60.0, 1000: 300.0, 10_000: 1800.0}
# Two runs of the judge at these accuracies; the difference is the error of the finer. Long
# chains that break amplify errors up to a million times and take the next two accuracies.
JUDGE_ACCURACIES = ((1e-9, 1e-10), (1e-12, 1e-13))
JUDGE_STEP_GOALS = (1e-8, 1e-10)
# Runs notice at the end of a step what stops them; bonds swing with periods of about 5.
SAME_TIME = 1.0
# Hot chains forget their state: that a bond runs away late is sure, when is not.
SAME_SHARE = 0.1


def answer(cell: Cell, engine: str) -> dict[str, Any]:
    """Ask an engine, with warnings as errors."""
    from chaincor.workflows.collision import collide

    result = collide(cell.scene(engine))
    return {
        "restitution": result.restitution,
        "error": result.restitution_error,
        "met": bool(result.tolerance_met),
        "scheme": result.scheme,
        "crossed": result.crossed,
        "message": result.reason or "",
    }


def judge(cell: Cell, scheme: str) -> dict[str, Any]:
    """Answer by another method than `scheme`, twice, the second time more exactly."""
    from chaincor.workflows.accuracy.reference_runs import run_reference
    from chaincor.workflows.accuracy.step_guess import guess_step
    from chaincor.workflows.engines.reference import adaptive

    scene = cell.scene("reference")
    rounding = 1e-14 * cell.particles

    def compare(runs: list) -> dict[str, Any]:
        coarse, fine = (run.eta for run in runs)
        return {
            "restitution": fine,
            "error": abs(fine - coarse) + rounding,
            "scheme": runs[-1].scheme,
            "crossed": runs[-1].crossed,
        }

    if scheme == "adaptive8":
        steps = [
            guess_step(scene.problem, "order8", target_error) for target_error in JUDGE_STEP_GOALS
        ]
        return compare([run_reference(scene.problem, "order8", step) for step in steps])
    for accuracies in JUDGE_ACCURACIES:
        try:
            said = compare([adaptive.run(scene.problem, accuracy) for accuracy in accuracies])
        except (CrossingError, BarrierError) as fact:
            confirm(scene, accuracies[-1], fact)
            raise
        if said["error"] <= SUREST_JUDGE:
            break
    return said


def confirm(scene: Scene, accuracy: float, fact: RunError) -> None:
    """See that a more exact run is stopped by the same at the same time; a judge must be sure."""
    from chaincor.workflows.engines.reference import adaptive

    try:
        adaptive.run(scene.problem, 0.1 * accuracy)
    except type(fact) as again:
        same = max(SAME_TIME, SAME_SHARE * time_of(fact))
        if abs(time_of(again) - time_of(fact)) < same:
            return
    raise UnsureError(f"the judge is not sure: once {fact}")


def time_of(fact: RunError) -> float:
    """Return when it happened, which its message says."""
    found = re.search(r" time ([-+.0-9e]+[0-9])", str(fact))
    return math.nan if found is None else float(found[1])


def limited(seconds: float, cell: Cell, by: str, task: Callable, argument: str) -> Found:
    """Run a task in this process, which dies when it takes too much time."""
    # Compiled loops never look at Python's signal handlers: the default action ends the process.
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.setitimer(signal.ITIMER_REAL, 5.0 * seconds)
    started = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            said = task(cell, argument)
    except Exception as error:
        named = isinstance(error, ChaincorError)
        said = {"failure": type(error).__name__, "named": named, "message": str(error)}
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    return Found(**asdict(cell), by=by, seconds=time.process_time() - started, **said)


def died(cell: Cell, by: str, error: WorkerDiedError, limit: float) -> Found:
    """Say why there is no answer."""
    late = re.search("SIGPROF|SIGALRM", str(error)) is not None
    name = "TimeOut" if late else "WorkerDied"
    return Found(
        **asdict(cell), by=by, seconds=limit, failure=name, named=False, message=str(error)
    )


def seconds_for(cell: Cell) -> float:
    """Return how long an answer may take."""
    return max(seconds for size, seconds in SECONDS.items() if cell.particles >= size)


class Map:
    """
    Results, in memory and in a growing file.

    Parameters
    ----------
    path : pathlib.Path
        The file; what it holds is read, a line cut off at its end is dropped.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.found: dict[tuple[Cell, str], Found] = {}
        text = path.read_text() if path.exists() else ""
        if text and not text.endswith("\n"):
            path.write_text(text + "\n")
        for line in text.splitlines():
            try:
                self._keep(Found(**json.loads(line)))
            except ValueError:
                continue

    def _keep(self, found: Found) -> None:
        self.found[found.cell, found.by] = found

    def compute(self, tasks: Iterable[tuple[Cell, str, Callable, str, float]], workers: int) -> int:
        """Run the tasks that are not in the file; return how many."""
        todo = [task for task in tasks if (task[0], task[1]) not in self.found]
        with ProcessPool(workers) as pool, self.path.open("a") as file:
            pending = {
                pool.submit(limited, limit, cell, by, function, argument): (cell, by, limit)
                for cell, by, function, argument, limit in todo
            }
            for future in as_completed(pending):
                cell, by, limit = pending[future]
                try:
                    found = future.result()
                except WorkerDiedError as error:
                    found = died(cell, by, error, limit)
                self._keep(found)
                file.write(json.dumps(asdict(found)) + "\n")
                file.flush()
        return len(todo)

    def run(self, cells: Iterable[tuple[Cell, str]], workers: int) -> int:
        """Compute answers, then their judges; return how many were computed."""
        cells = list(cells)
        count = self.compute(
            ((cell, engine, answer, engine, seconds_for(cell)) for cell, engine in cells), workers
        )
        judged = {}
        for cell, engine in cells:
            if engine == "reference" and needs_judge(self.found[cell, engine]):
                judged[cell] = self.found[cell, engine].scheme
        return count + self.compute(
            ((cell, "judge", judge, scheme, seconds_for(cell)) for cell, scheme in judged.items()),
            workers,
        )


def main() -> None:
    """Compute what is missing of the map, print the counts, draw the picture."""
    parser = argparse.ArgumentParser(description="the map of the extremes")
    parser.add_argument("-o", "--output", type=Path, default=Path("extremes"))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="the bounded version")
    parser.add_argument("--picture", type=Path)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    found = Map(arguments.output / "cells.jsonl")
    cells = list(all_cells(arguments.quick))
    print(f"{found.run(cells, arguments.workers)} computed now", flush=True)
    judged = verdicts(found.found, cells)
    print(report(found.found, judged))
    if arguments.picture:
        from benchmarks.extremes.picture import draw

        draw(judged, arguments.picture)
    raise SystemExit(any(each.colour == "red" for each in judged.values()))


if __name__ == "__main__":
    main()
