"""
The standing benchmarks, as ratios from one run, kept in a dated CSV.

    make bench        (or python -m tests.benchmarks [--no-record])

Measured side by side: a run with events against a bare `run N` of LAMMPS; the error of the event
wall against the stock recipe's in the same time; LAMMPS at 1e-10 against heyoka and SciPy's
DOP853; the in-house engine against both at 1e-11; its loops against C. Each figure goes into
``tests/benchmarks/history/<date>.csv``; a ratio that is much worse than in the file before is a
regression, and is said so.
"""

import argparse
import csv
import datetime
import platform
import tempfile
from collections.abc import Callable
from pathlib import Path

from tests.benchmarks import equal_time, event_overhead, lammps_peers, reference_peers
from workflows.versions import versions

HISTORY = Path(__file__).parent / "history"
# Repeated on a busy machine, ratios agree to a factor of 1.5; ratios of errors, to several.
WORSE = 1.5
WORSE_ERRORS = 10.0

# Name of a benchmark and its figures: ratios, of which less is better unless named "gain".
Figures = dict[str, float]


def measure_overhead() -> Figures:
    """Return event/bare for each bond at n = 100 and 1000."""
    figures = {}
    for particles, timestep in event_overhead.SIZES:
        for fields in event_overhead.BONDS:
            ratio, *_ = event_overhead.measure(fields, particles, timestep, 5)
            name = " ".join(str(value) for value in fields.values())
            figures[f"event over bare run, n {particles}, {name}"] = ratio
    return figures


def measure_equal_time() -> Figures:
    """Return error of the stock recipe over that of the event wall, at one and four times."""
    results = [equal_time.compare(fields) for fields in equal_time.SCENES]
    figures = {}
    for factor in equal_time.WANTED:
        for result in results:
            figures[f"gain over the stock recipe at {factor} times its time, {result.name}"] = (
                result.ratios[factor]
            )
        figures[f"gain over the stock recipe at {factor} times its time, geometric mean"] = (
            equal_time.geometric_mean(results, factor)
        )
    return figures


def measure_lammps_peers() -> Figures:
    """Return LAMMPS over its peers at 1e-10."""
    found = lammps_peers.compare()
    return {
        name.replace("_", " "): value
        for name, value in found.items()
        if name.startswith("lammps_over_")
    }


def measure_reference_peers() -> Figures:
    """Return peers over the in-house order 8 at 1e-11, and its loops over C."""
    figures = {}
    for row in reference_peers.compare_integrators(0.4):
        for name, value in row.items():
            if name.endswith("_over_8"):
                task = name.removesuffix("_over_8")
                figures[f"{row['integrator']} over in-house order8, {task}"] = float(value)
    with tempfile.TemporaryDirectory() as folder:
        c_loops, ours = reference_peers.compile_c(Path(folder)), reference_peers.compile_ours()
        for particles in (100, 1000):
            row = reference_peers.compare_loops(particles, c_loops, ours)
            for part in ("force", "stage"):
                figures[f"in-house {part} loop over C, n {particles}"] = row[f"{part}_ratio"]
    return figures


BENCHMARKS: dict[str, Callable[[], Figures]] = {
    "event overhead": measure_overhead,
    "stock recipe": measure_equal_time,
    "lammps peers": measure_lammps_peers,
    "in-house peers": measure_reference_peers,
}


def is_gain(name: str) -> bool:
    """Return whether more is better."""
    return name.startswith("gain") or " over in-house order8" in name


def regressions(figures: Figures, before: Figures) -> list[str]:
    """Return what got clearly worse, a line each."""
    lines = []
    for name, value in figures.items():
        if name not in before:
            continue
        worse = before[name] / value if is_gain(name) else value / before[name]
        if worse > (WORSE_ERRORS if name.startswith("gain") else WORSE):
            lines.append(f"{name}: {value:.3g}, was {before[name]:.3g}")
    return lines


def read_last(folder: Path) -> Figures:
    """Return the figures of the newest file, of which the last of each name counts."""
    files = sorted(folder.glob("*.csv"))
    if not files:
        return {}
    with files[-1].open(newline="") as stream:
        return {row["figure"]: float(row["value"]) for row in csv.DictReader(stream)}


def record(figures: dict[str, Figures], folder: Path) -> Path:
    """Append the figures to today's file."""
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
    for benchmark, measure in BENCHMARKS.items():
        print(f"{benchmark}", flush=True)
        figures[benchmark] = measure()
        for name, value in figures[benchmark].items():
            was = f"   (before: {before[name]:.3g})" if name in before else ""
            print(f"  {value:10.3g}  {name}{was}", flush=True)
    if not arguments.no_record:
        print(f"recorded in {record(figures, HISTORY)}")
    flat = {name: value for values in figures.values() for name, value in values.items()}
    worse = regressions(flat, before)
    if worse:
        raise SystemExit("worse than before:\n  " + "\n  ".join(worse))


if __name__ == "__main__":
    main()
