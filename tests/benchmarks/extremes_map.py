"""
The map of the extremes: is every answer right, or a clear refusal?

    python -m tests.benchmarks.extremes_map [-o FOLDER] [--workers 2] [--quick]
        [--picture docs/images/extremes_map.png]

Potential x speed x number of particles x engine. What is finished is kept in FOLDER/cells.jsonl, a
line each, so that the same command goes on where it was stopped. (A results store does not serve:
it keeps neither the judges, which are not scenes, nor time-outs.)

Every cell is asked for eta to 1e-6, within 60 s of processor time, or 300 s from 1000 particles on.
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
spheres answered, and composed steps for what Dormand and Prince's answered. Where the limit of hard
spheres cannot be stepped at all (n above 100, or log bonds beyond the range of numbers), it is
judged by eta = 1 and counted apart.
"""

import argparse
import json
import math
import re
import signal
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lammps_inputs.errors import ChaincorError
from lammps_inputs.scene import Scene
from workflows.errors import BarrierError, CrossingError, RunError, WorkerDiedError
from workflows.pool import ProcessPool

TOLERANCE = 1e-6
# Of processor time, for each answer and each judge; and for chains of 1000 and more.
SECONDS, LONG_SECONDS = 60.0, 300.0
LONG = 1000
# Two runs of the judge at these accuracies; the difference is the error of the finer. Where it is
# not sure enough, long chains that break amplify errors, up to a million times: then the next two.
JUDGE_ACCURACIES = ((1e-9, 1e-10), (1e-12, 1e-13))
JUDGE_STEP_GOALS = (1e-8, 1e-10)
SUREST_JUDGE = 1e-8
# Runs notice at the end of a step what stops them; bonds swing with periods of about 5.
SAME_TIME = 1.0
LONGEST_STEPPED_SPHERES = 100

POTENTIALS: dict[str, dict[str, Any]] = {
    "harmonic": {"potential": "harmonic"},
    "lj": {"potential": "lj"},
    "toda 1": {"potential": "toda", "toda_b": 1.0},
    "toda 10": {"potential": "toda", "toda_b": 10.0},
    "toda 100": {"potential": "toda", "toda_b": 100.0},
    "log": {"potential": "log"},
} | {
    f"power {order}": {
        "potential": "power",
        "power_order": order,
        "power_c": 1.0 if order % 2 == 0 else -1.0,
    }
    for order in range(3, 10)
}
SPEEDS = (1e-12, 1e-8, 1e-4, 1e-2, 0.4, 1.0, 3.0, 10.0, 100.0, 1e3)
SIZES = (1, 2, 3, 10, 100, 1000)
ENGINES = ("reference", "lammps")
# LAMMPS takes ten seconds for a cell of 1000 particles: one bond of each kind does there.
LAMMPS_LONGEST = 100
LAMMPS_LONG = ("harmonic", "lj", "toda 10", "log", "power 3", "power 4")
# What can be afforded of longer chains, in-house.
LONG_CELLS = (
    *(("harmonic", 10_000, speed) for speed in (1e-12, 0.4, 1e3)),
    *((name, 10_000, 0.01) for name in ("lj", "toda 10", "log", "power 4")),
    *((name, size, 1e3) for name in ("lj", "toda 100", "log") for size in (10_000, 100_000)),
)


class UnsureError(Exception):
    """The judge's own runs do not agree on what stops them."""


@dataclass(frozen=True)
class Cell:
    """A collision: name of the potential, particles, speed (v*; velocity of a harmonic chain)."""

    potential: str
    particles: int
    speed: float

    def scene(self, engine: str) -> Scene:
        """Return the scene for an engine."""
        key = "velocity" if self.potential == "harmonic" else "speed"
        return Scene(
            **POTENTIALS[self.potential],
            **{key: self.speed},
            particles=self.particles,
            engine=engine,
            tolerance=TOLERANCE,
        )


@dataclass(frozen=True)
class Found:
    """What an engine, or the judge, says about a cell; the fields are those of a line."""

    potential: str
    particles: int
    speed: float
    by: str  # reference, lammps or judge
    seconds: float
    restitution: float | None = None
    error: float | None = None
    met: bool = False
    scheme: str = ""
    crossed: bool = False
    failure: str | None = None  # name of the error's class
    named: bool = True  # whether it is one of ours
    message: str = ""

    @property
    def cell(self) -> Cell:
        """The cell."""
        return Cell(self.potential, self.particles, self.speed)


def answer(cell: Cell, engine: str) -> dict[str, Any]:
    """Ask an engine, with warnings as errors."""
    from workflows.collision import collide

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
    from workflows.convergence import eta_of, run_in_house
    from workflows.engines import stiff
    from workflows.step_guess import guess_step

    scene = cell.scene("reference")
    rounding = 1e-14 * cell.particles

    def compare(runs: list) -> dict[str, Any]:
        coarse, fine = (eta_of(scene, run) for run in runs)
        return {
            "restitution": fine,
            "error": abs(fine - coarse) + rounding,
            "scheme": runs[-1].scheme,
            "crossed": runs[-1].crossed,
        }

    if scheme == "adaptive8":
        steps = [guess_step(scene, "order8", goal) for goal in JUDGE_STEP_GOALS]
        return compare([run_in_house(scene, "order8", step) for step in steps])
    for accuracies in JUDGE_ACCURACIES:
        try:
            said = compare([stiff.run(scene, accuracy) for accuracy in accuracies])
        except (CrossingError, BarrierError) as fact:
            confirm(scene, accuracies[-1], fact)
            raise
        if said["error"] <= SUREST_JUDGE:
            break
    return said


def confirm(scene: Scene, accuracy: float, fact: RunError) -> None:
    """See that a more exact run is stopped by the same at the same time; a judge must be sure."""
    from workflows.engines import stiff

    try:
        stiff.run(scene, 0.1 * accuracy)
    except type(fact) as again:
        if abs(time_of(again) - time_of(fact)) < SAME_TIME:
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


def all_cells(quick: bool) -> Iterator[tuple[Cell, str]]:
    """Return the cells and engines of the map, or of its bounded version."""
    sizes, speeds = SIZES, SPEEDS
    if quick:
        sizes, speeds = (1, 3, 10), (1e-12, 1e-4, 0.4, 3.0, 100.0, 1e3)
    for size in sizes:
        for name in POTENTIALS:
            for speed in speeds:
                yield Cell(name, size, speed), "reference"
                if size <= LAMMPS_LONGEST or name in LAMMPS_LONG:
                    yield Cell(name, size, speed), "lammps"
    if not quick:
        for long_cell in LONG_CELLS:
            yield Cell(*long_cell), "reference"


def seconds_for(cell: Cell) -> float:
    """Return how long an answer may take."""
    return LONG_SECONDS if cell.particles >= LONG else SECONDS


class Map:
    """
    What was found, in memory and in a file that grows.

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


def needs_judge(found: Found) -> bool:
    """Return whether a cell is judged by a run, not by the limit of hard spheres."""
    return found.scheme != "hard-sphere" or found.particles <= LONGEST_STEPPED_SPHERES


# Refusals that state a fact of the motion, and words that say what would do.
FACTS = (CrossingError.__name__, BarrierError.__name__)
REMEDY = re.compile(r"\b(use|lower|take|ask for|choose|give)\b")
# One letter for each verdict, so that nobody has to tell colours apart.
LETTERS = {
    "ToleranceError": "d",
    "RunError": "s",
    "CrossingError": "x",
    "BarrierError": "b",
    "TimestepError": "t",
    "UnfinishedCollisionError": "u",
}


@dataclass(frozen=True)
class Verdict:
    """Colour of a cell, the letter that tells it apart, and why."""

    colour: str
    letter: str
    why: str


def verdict(found: Found, judged: Found | None) -> Verdict:
    """Judge what an engine said."""
    if found.failure is not None:
        return _verdict_on_refusal(found, judged)
    assert found.restitution is not None
    bar = found.error
    if not math.isfinite(found.restitution) or bar is None or not math.isfinite(bar):
        return Verdict("red", "N", f"eta {found.restitution}, bar {bar}")
    if found.met != (bar <= TOLERANCE) or not (found.met or found.message):
        return Verdict("red", "L", f"says {found.met}, bar {bar:.2g}")
    by_limit = not needs_judge(found) if judged is None else found.scheme == "hard-sphere"
    if by_limit and (judged is None or judged.failure is not None):
        truth, doubt, letter = 1.0, 0.0, "o"
    elif judged is None:
        return Verdict("unverified", "?", "not judged yet")
    elif judged.failure is not None:
        if judged.failure in FACTS:
            return Verdict("red", "F", f"answered, though {judged.message}")
        return Verdict("unverified", "?", f"judge: {judged.failure}: {judged.message}")
    else:
        assert judged.restitution is not None
        assert judged.error is not None
        truth, doubt, letter = judged.restitution, judged.error, ""
        if doubt > SUREST_JUDGE:
            return Verdict("unverified", "?", f"the judge is sure to {doubt:.1g} only")
    away = abs(found.restitution - truth)
    if away > bar + doubt:
        return Verdict("red", "X", f"{away:.2g} from the judge, bar {bar:.2g} + {doubt:.1g}")
    if found.met:
        return Verdict("green", letter, "")
    return Verdict("amber", "w", found.message)


def _verdict_on_refusal(found: Found, judged: Found | None) -> Verdict:
    said = f"{found.failure}: {found.message}"
    if found.failure == "TimeOut":
        return Verdict("red", "T", said)
    if not found.named or "\n" in found.message or not REMEDY.search(found.message):
        return Verdict("red", "E", said)
    if found.failure in FACTS and judged is None:
        return Verdict("unverified", "?", f"not judged yet: {said}")
    if found.failure in FACTS and judged is not None:
        confirmed = judged.failure == found.failure or judged.crossed
        if judged.failure in ("TimeOut", "TimestepError", UnsureError.__name__):
            return Verdict("unverified", "?", f"judge: {judged.failure}; {said}")
        if not confirmed:
            return Verdict("red", "U", f"{said}; the judge says {judged.restitution}")
    return Verdict("amber", LETTERS.get(str(found.failure), "e"), said)


def verdicts(found: Map, cells: Iterable[tuple[Cell, str]]) -> dict[tuple[Cell, str], Verdict]:
    """Return the verdict on every cell that was computed."""
    return {
        (cell, engine): verdict(found.found[cell, engine], found.found.get((cell, "judge")))
        for cell, engine in cells
        if (cell, engine) in found.found
    }


def report(found: Map, judged: dict[tuple[Cell, str], Verdict]) -> str:
    """Return counts for each engine, and each cell that is red or unverified."""
    lines = []
    for engine in ENGINES:
        some = [each for (_, by), each in judged.items() if by == engine]
        colours = Counter(each.colour for each in some)
        letters = Counter(each.letter for each in some if each.colour == "amber")
        limits = sum(each.colour == "green" and each.letter == "o" for each in some)
        lines.append(
            f"{engine}: {len(some)} cells: "
            + ", ".join(f"{colours[c]} {c}" for c in ("green", "amber", "red", "unverified"))
            + f"; green by the limit of hard spheres: {limits}; amber: {dict(letters)}"
        )
    for (cell, engine), each in judged.items():
        if each.colour in ("red", "unverified"):
            name = f"{cell.potential} n={cell.particles} {cell.speed:g} {engine}"
            lines.append(f"{each.colour} {each.letter} {name}: {each.why}")
    seconds = sum(each.seconds for each in found.found.values())
    return "\n".join([*lines, f"processor time: {seconds / 60.0:.1f} min"])


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
    judged = verdicts(found, cells)
    print(report(found, judged))
    if arguments.picture:
        from tests.benchmarks.extremes_picture import draw

        draw(judged, arguments.picture)
    raise SystemExit(any(each.colour == "red" for each in judged.values()))


if __name__ == "__main__":
    main()
