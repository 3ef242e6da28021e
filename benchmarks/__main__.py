"""
Run the regular benchmarks, and append their ratios to a dated CSV.

    make bench        (or python -m benchmarks [--no-record])

Each ratio compares two programs or methods, which are measured in the same run: an event-driven run
and a bare `run N` of LAMMPS; the errors of the stock wall and the event wall in the same time;
LAMMPS at 1e-10 and heyoka or SciPy's DOP853; the reference engine at 1e-11 and heyoka or DOP853;
the loops of the reference engine and loops in C. Ratios are written to
``benchmarks/history/<date>.csv``. A ratio that is much worse than in the previous file is reported
as a regression. All benchmarks take three minutes of processor time.
"""

import argparse
import csv
import datetime
import platform
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.peers import c_loops, equal_time, event_overhead, lammps_engine, reference_engine
from chaincor.workflows.versions import versions

HISTORY = Path(__file__).parent / "history"
# On a busy machine, repeated ratios agree within a factor of 1.5. Ratios of errors depend on a time
# step from a list, and the choice may change to a neighbouring time step. A neighbouring time step
# changes a ratio by a factor of 20 if order 8 only begins to converge (lj at 1 v*).
WORSE = 1.5
WORSE_ERRORS = 30.0
# Integrators of other authors. Larger ratios of their time to ours are better.
PEERS = ("heyoka", "heyoka_products", "dop853")

# Ratios by name. Smaller ratios are better, except those for which :func:`is_gain` is true.
Figures = dict[str, float]
# Names and ratios, each yielded as soon as it is measured.
FigureStream = Iterator[tuple[str, float]]


def measure_overhead() -> FigureStream:
    """Yield the shortest time of event-driven runs, divided by that of bare runs, for each bond."""
    for particles, timestep in event_overhead.SIZES:
        for fields in event_overhead.BONDS:
            *_, ratio, _ = event_overhead.measure(fields, particles, timestep, 5)
            name = " ".join(str(value) for value in fields.values())
            yield f"event over bare run, n {particles}, {name}", ratio


def measure_equal_time() -> FigureStream:
    """Yield the stock wall's error divided by the event wall's, in equal and fourfold time."""
    results = []
    for fields in equal_time.SCENES:
        result = equal_time.compare(fields)
        results.append(result)
        for factor, ratio in result.ratios.items():
            yield f"gain over the stock recipe at {factor} times its time, {result.name}", ratio
    for factor in equal_time.WANTED:
        mean = equal_time.geometric_mean(results, factor)
        yield f"gain over the stock recipe at {factor} times its time, geometric mean", mean


def measure_lammps_peers() -> FigureStream:
    """Yield the time of LAMMPS divided by that of its peers, at 1e-10."""
    for name, value in lammps_engine.compare().items():
        if "_over_" in name:
            yield name.replace("_", " "), value


def measure_reference_peers() -> FigureStream:
    """Yield times of peers divided by the reference engine's at 1e-11, and of our loops by C's."""
    for row in reference_engine.compare_integrators(0.4):
        for task in reference_engine.TASKS:
            for scheme, ending in (("order8", "8"), ("extrapolated14", "x14")):
                if row["integrator"] in PEERS:
                    name = f"{row['integrator']} over in-house {scheme}, {task}"
                    yield name, float(row[f"{task}_over_{ending}"])
    with tempfile.TemporaryDirectory() as folder:
        in_c, ours = c_loops.compile_c(Path(folder)), c_loops.compile_ours()
        for particles in (100, 1000):
            row = c_loops.compare_loops(particles, in_c, ours)
            for part in ("force", "stage"):
                yield f"in-house {part} loop over C, n {particles}", row[f"{part}_ratio"]


BENCHMARKS: dict[str, Callable[[], FigureStream]] = {
    "event overhead": measure_overhead,
    "stock recipe": measure_equal_time,
    "lammps peers": measure_lammps_peers,
    "in-house peers": measure_reference_peers,
}


def is_gain(name: str) -> bool:
    """Return whether a larger ratio is better."""
    return name.startswith("gain") or name.split(" over ")[0] in PEERS


def regressions(figures: Figures, before: Figures) -> list[str]:
    """Return one line for each ratio that became clearly worse."""
    lines = []
    for name, value in figures.items():
        if name not in before:
            continue
        worse = before[name] / value if is_gain(name) else value / before[name]
        if worse > (WORSE_ERRORS if name.startswith("gain") else WORSE):
            lines.append(f"{name}: {value:.3g}, was {before[name]:.3g}")
    return lines


def read_last(folder: Path) -> Figures:
    """Return the ratios in the newest file; for each name, the last ratio."""
    files = sorted(folder.glob("*.csv"))
    if not files:
        return {}
    with files[-1].open(newline="") as stream:
        return {row["figure"]: float(row["value"]) for row in csv.DictReader(stream)}


def record(figures: dict[str, Figures], folder: Path) -> Path:
    """Append the ratios to today's file."""
    folder.mkdir(exist_ok=True)
    now = datetime.datetime.now(datetime.UTC)
    path = folder / f"{now.date().isoformat()}.csv"
    fresh = not path.exists()
    found = versions()
    with path.open("a", newline="") as stream:
        writer = csv.writer(stream)
        if fresh:
            writer.writerow(["time", "benchmark", "figure", "value", "machine", "lammps", "numba"])
        for benchmark, values in figures.items():
            writer.writerows(
                (now.isoformat(timespec="seconds"), benchmark, name, f"{value:.4g}",
                 platform.machine(), found["lammps"], found["numba"])
                for name, value in values.items()
            )  # fmt: skip
    return path


def main() -> None:
    """Run all benchmarks, record them, and fail on a regression."""
    parser = argparse.ArgumentParser(description="the standing benchmarks")
    parser.add_argument("--no-record", action="store_true", help="print only")
    arguments = parser.parse_args()
    before = read_last(HISTORY)
    figures: dict[str, Figures] = {}
    started = time.perf_counter()
    for number, (benchmark, measure) in enumerate(BENCHMARKS.items(), start=1):
        elapsed = time.perf_counter() - started
        print(f"[{elapsed:3.0f} s] {benchmark} ({number} of {len(BENCHMARKS)})", flush=True)
        figures[benchmark] = {}
        for name, value in measure():
            figures[benchmark][name] = value
            was = f"   (before: {before[name]:.3g})" if name in before else ""
            print(f"  {value:10.3g}  {name}{was}", flush=True)
    print(f"[{time.perf_counter() - started:3.0f} s] done")
    if not arguments.no_record:
        print(f"recorded in {record(figures, HISTORY)}")
    flat = {name: value for values in figures.values() for name, value in values.items()}
    worse = regressions(flat, before)
    if worse:
        raise SystemExit("worse than before:\n  " + "\n  ".join(worse))


if __name__ == "__main__":
    main()
