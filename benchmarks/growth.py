"""
Time and memory of both engines against the number of particles and the tolerance.

    python -m benchmarks.growth [-o docs/images] [--longest 2000] [--draw]

Each series runs in a separate process. All chains are lj chains at 0.4 v*: of 20 to `longest`
particles at a tolerance of 1e-6, and of 100 particles at tolerances from 1e-4 to 1e-12. The time is
the processor time of whole collisions, including set-up, tables and the runs for the error bar. The
memory is the increase of the peak memory of the process after a first collision of 20 particles.
LAMMPS runs chains of at most a tenth of `longest`. ``growth.csv`` contains the measurements, and
``growth.png`` shows them with fitted exponents. With `--draw`, only the figure is made.
"""

import argparse
import csv
import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from chaincor import Scene, collide
from chaincor.analysis.figures.style import BLUE, MARKERS, VERMILION, new_figure

SIZES = (20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000, 50000, 100000)
TOLERANCES = tuple(10.0**-k for k in range(4, 13))
ENGINES = {"reference": BLUE, "lammps": VERMILION}
# LAMMPS is slower, and its longest chain is shorter by this factor.
_LAMMPS_SHARE = 0.2
# Up to this length, a first collision compiles loops and reads tables, and is not timed.
_WARMED_UP_TO = 200
# Least measured time. The resolution of processor time is some milliseconds.
_LEAST_SECONDS = 0.4
# Shortest chain in the fit of the exponent. The time of shorter chains is mainly set-up.
_FITTED_FROM = 100


def measure(engine: str, axis: str, longest: int) -> None:
    """Run one series and print a JSON object for each point."""
    first = Scene(potential="lj", particles=20, engine=engine)
    collide(first, tolerance=1e-6)
    begun = _peak()
    sizes = [n for n in SIZES if n <= longest * (_LAMMPS_SHARE if engine == "lammps" else 1.0)]
    points = [(n, 1e-6) for n in sizes] if axis == "particles" else [(100, t) for t in TOLERANCES]
    for particles, tolerance in points:
        scene = first.replace(particles=particles)
        if particles <= _WARMED_UP_TO:
            collide(scene, tolerance=tolerance)
        runs, started = 0, time.process_time()
        while (used := time.process_time() - started) < _LEAST_SECONDS:
            result = collide(scene, tolerance=tolerance)
            runs += 1
        point = {
            "engine": engine,
            "axis": axis,
            "particles": particles,
            "tolerance": tolerance,
            "seconds": used / runs,
            "megabytes": (_peak() - begun) / 1024.0,
            "met": result.tolerance_met,
        }
        print(json.dumps(point), flush=True)


def _peak() -> int:
    """Return the largest resident memory of this process so far, in kB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def measure_all(longest: int) -> list[dict]:
    """Run all series, one process each."""
    rows = []
    for engine in ENGINES:
        for axis in ("particles", "tolerance"):
            command = [sys.executable, "-m", "benchmarks.growth", "--longest", str(longest)]
            command += ["--measure", engine, axis]
            done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
            rows += [json.loads(line) for line in done.stdout.splitlines()]
            print(done.stdout, end="", flush=True)
    return rows


def exponent(x: np.ndarray, y: np.ndarray) -> float:
    """Return the exponent of a power law, from a least-squares fit of logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def draw(rows: list[dict], path: Path) -> None:
    """Plot time and memory against the number of particles, and time against the tolerance."""
    figure, (times, memory, tolerances) = new_figure(1, 3, figsize=(9.6, 3.4))
    for (engine, colour), marker in zip(ENGINES.items(), MARKERS, strict=False):
        own = [row for row in rows if row["engine"] == engine]
        by_size = [row for row in own if row["axis"] == "particles"]
        by_tolerance = [row for row in own if row["axis"] == "tolerance"]
        sizes, seconds, megabytes = (
            np.array([row[key] for row in by_size]) for key in ("particles", "seconds", "megabytes")
        )
        fitted = sizes >= _FITTED_FROM
        power = exponent(sizes[fitted], seconds[fitted])
        style = {"color": colour, "marker": marker}
        times.loglog(sizes, seconds, label=rf"{engine}, $n^{{{power:.2f}}}$", **style)
        memory.semilogx(sizes, megabytes, label=engine, **style)
        asked, seconds = (
            np.array([row[key] for row in by_tolerance]) for key in ("tolerance", "seconds")
        )
        power = exponent(asked, seconds)
        label = rf"{engine}, $\epsilon^{{{power:.2f}}}$"
        tolerances.loglog(asked, seconds, label=label, **style)
    for axes in (times, memory):
        axes.set_xlabel("particles $n$")
    times.set_ylabel("processor time (s)")
    memory.set_ylabel("growth of the peak memory (MB)")
    tolerances.set_xlabel(r"tolerance $\epsilon$ of $\eta$")
    tolerances.invert_xaxis()
    for axes in (times, memory, tolerances):
        axes.legend()
    figure.savefig(path)


def main() -> None:
    """Measure, write and draw."""
    parser = argparse.ArgumentParser(description="growth of time and memory")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/images"))
    parser.add_argument("--longest", type=int, default=5000)
    parser.add_argument("--draw", action="store_true", help="draw growth.csv again")
    parser.add_argument("--measure", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.measure:
        measure(*given.measure, given.longest)
        return
    table = given.output / "growth.csv"
    if not given.draw:
        rows = measure_all(given.longest)
        with table.open("w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
    with table.open(newline="") as file:
        rows = [
            {key: value if key in ("engine", "axis", "met") else float(value)
             for key, value in row.items()}
            for row in csv.DictReader(file)
        ]  # fmt: skip
    draw(rows, given.output / "growth.png")


if __name__ == "__main__":
    main()
