"""
Map of the extremes: is every result right, or refused with a clear message?

    python -m benchmarks.extremes.map [-o FOLDER] [--workers 2] [--quick]
        [--picture docs/images/extremes_map.png]

A cell is a combination of potential, speed, number of particles and engine. Finished cells are
written to FOLDER/cells.jsonl, one per line. After an interruption, the same command continues.

In each cell eta is computed to 1e-6 within 60 s of processor time; the limit is 300 s from 1000
particles on, and 1800 s from 10000 on. These rules give the verdict:

- *green*: the error bar is within the tolerance, and the judge is within the error bar;
- *amber*: the error bar is wider than the tolerance, a message says so, and the judge is within the
  error bar; or the cell is refused by a named error in one line with a remedy. Some refusals state
  a fact about the motion (particles that pass each other, or a bond beyond its barrier). The judge
  must confirm such a fact;
- *red*: all other results: a wrong error bar, an untrue refusal, an error without a name, warnings,
  a result that is not a number, a dead process, or a time-out;
- *unverified*: there is no judge yet, or the judge ran out of time or is not accurate to 1e-8.

The judge uses another kind of method than the result, with tighter tolerances. Results of composed
or extrapolated Verlet steps, modes, LAMMPS or the limit of hard spheres are judged by the method of
Dormand and Prince of order 8. Results of Dormand and Prince's method are judged by composed steps.
Some results of the limit of hard spheres cannot be checked by steps (n above 100, or log bonds
beyond the range of doubles). They are compared with eta = 1 and counted separately.
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

# Limit of processor time for each result and each judge, by the least number of particles.
SECONDS = {1: 60.0, 1000: 300.0, 10_000: 1800.0}
# Accuracies of two runs by the judge. The difference between the runs is the error of the more
# accurate run. Long chains that break amplify errors up to a million times, and are run with the
# second pair.
JUDGE_ACCURACIES = ((1e-9, 1e-10), (1e-12, 1e-13))
JUDGE_STEP_GOALS = (1e-8, 1e-10)
# Largest difference of the times at which two runs are stopped. Runs detect the cause at the end of
# a step, and bonds oscillate with periods of about 5.
SAME_TIME = 1.0
# The same difference as a fraction of the time. In chaotic chains it is certain that a bond breaks
# late, but not when.
SAME_SHARE = 0.1


def answer(cell: Cell, engine: str) -> dict[str, Any]:
    """Compute a cell with an engine."""
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
    """Compute a cell by another method than `scheme`, at two accuracies."""
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
    """Check that a more accurate run is stopped for the same reason at the same time."""
    from chaincor.workflows.engines.reference import adaptive

    try:
        adaptive.run(scene.problem, 0.1 * accuracy)
    except type(fact) as again:
        same = max(SAME_TIME, SAME_SHARE * time_of(fact))
        if abs(time_of(again) - time_of(fact)) < same:
            return
    raise UnsureError(f"the judge is not sure: once {fact}")


def time_of(fact: RunError) -> float:
    """Return the time in the message of an error."""
    found = re.search(r" time ([-+.0-9e]+[0-9])", str(fact))
    return math.nan if found is None else float(found[1])


def limited(seconds: float, cell: Cell, by: str, task: Callable, argument: str) -> Found:
    """Run a task in this process, with warnings as errors; end the process after a time."""
    # Python's signal handlers do not run within compiled loops. The default action ends the
    # process.
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
    """Return the result of a cell whose process died."""
    late = re.search("SIGPROF|SIGALRM", str(error)) is not None
    name = "TimeOut" if late else "WorkerDied"
    return Found(
        **asdict(cell), by=by, seconds=limit, failure=name, named=False, message=str(error)
    )


def seconds_for(cell: Cell) -> float:
    """Return the limit of processor time."""
    return max(seconds for size, seconds in SECONDS.items() if cell.particles >= size)


class Map:
    """
    Results, in memory and in a growing file.

    Parameters
    ----------
    path : pathlib.Path
        File of the results. Existing results are read, and an incomplete last line is ignored.
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
        """Run the tasks that are not in the file; return their number."""
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
        """Compute results, then judge them; return the number of computations."""
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
    """Compute the missing cells, print the counts, and draw the map."""
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
