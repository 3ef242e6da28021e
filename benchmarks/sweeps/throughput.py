"""
Speed of sweeps in the reference engine: batches of cold chains and single collisions.

    python -m benchmarks.sweeps.throughput [--count 10000] [--alone 1000] [--rounds 2]
        [--potential lj toda] [--particles 20 100] [--speeds 0.01 0.5] [--tolerance 1e-6]
        [--workers 2] [--before PATH]

Speeds are random and log-uniform. Three kinds of sweeps alternate, each in a separate process with
a new store: `together` runs batches, as sweeps do, `alone` runs each collision separately, and
`before` is an older version of the project at PATH. Workers have started and loaded their code
before the time is measured. Prints the number of collisions per second of elapsed time, the
processor time per collision in all processes, and ratios to `together`. The last column is the
number of results that differ from `together` at the same speed in any bit.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from unittest import mock

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
# Number of results that are compared.
_COMPARED = 200


def measure(given: argparse.Namespace) -> None:
    """Run one sweep, and print its times; an older version of the project also runs this."""
    from chaincor import Scene
    from chaincor.workflows.campaign import work
    from chaincor.workflows.campaign.into_store import IntoStore
    from chaincor.workflows.campaign.pool import ProcessPool
    from chaincor.workflows.store.results_store import Store

    low, high = np.log(given.speeds)
    speeds = np.exp(np.random.default_rng(1).uniform(low, high, given.count))
    common = {"particles": given.particles[0], "engine": "reference", "tolerance": given.tolerance}
    scenes = [Scene(potential=given.potential[0], speed=s, **common) for s in speeds.tolist()]
    warm = [Scene(potential=given.potential[0], speed=0.1 + 1e-4 * k, **common) for k in range(64)]
    if given.measure == "alone":
        each = mock.patch.object(work, "batches", _each_alone)
        each.start()
    workers = given.workers
    with tempfile.TemporaryDirectory() as folder, Store(Path(folder) / "a.sqlite") as store:
        with ProcessPool(workers) as pool:
            IntoStore(store, warm).run(pool, in_flight=2 * workers)
            cpu, started = _processor_seconds(), time.perf_counter()
            IntoStore(store, scenes).run(pool, in_flight=2 * workers)
            wall, cpu = time.perf_counter() - started, _processor_seconds() - cpu
        rows = [store.find(scene) for scene in scenes[:_COMPARED]]
    etas = [[row.restitution, row.restitution_error] for row in rows]
    print(json.dumps({"wall": wall, "processor": cpu, "etas": etas}))


def _each_alone(scenes: list) -> list[list[int]]:
    return [[place] for place in range(len(scenes))]


def _processor_seconds() -> float:
    """Return the processor time of this process and its running child processes."""
    own = resource.getrusage(resource.RUSAGE_SELF)
    ticks = os.sysconf("SC_CLK_TCK")
    total = own.ru_utime + own.ru_stime
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[1]) == os.getpid():
            total += (int(fields[11]) + int(fields[12])) / ticks
    return total


def _run(way: str, potential: str, particles: int, count: int, given: argparse.Namespace) -> dict:
    root = given.before if way == "before" else ROOT
    command = [sys.executable, str(Path(__file__).resolve()), "--measure", way]
    command += ["--potential", potential, "--particles", str(particles), "--count", str(count)]
    command += ["--speeds", *map(str, given.speeds), "--tolerance", str(given.tolerance)]
    command += ["--workers", str(given.workers)]
    environment = os.environ | {"PYTHONPATH": str(root), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        command, env=environment, cwd=root, stdout=subprocess.PIPE, text=True, check=True
    )
    return json.loads(done.stdout)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="sweeps of chains together and one by one")
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--alone", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--potential", nargs="+", default=["lj", "toda"])
    parser.add_argument("--particles", nargs="+", type=int, default=[20, 100])
    parser.add_argument("--speeds", nargs=2, type=float, default=[0.01, 0.5])
    parser.add_argument("--tolerance", type=float, default=1e-6)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--before", type=Path)
    parser.add_argument("--measure", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.measure:
        measure(given)
        return
    ways = ["together", "alone"] + (["before"] if given.before else [])
    for particles in given.particles:
        for potential in given.potential:
            found: dict[str, list[dict]] = {way: [] for way in ways}
            counts = dict.fromkeys(ways, given.alone) | {"together": given.count}
            for _ in range(given.rounds):
                for way in ways:
                    run = _run(way, potential, particles, counts[way], given)
                    found[way].append(run)
            first = found["together"][0]["etas"]
            for way in ways:
                wall, processor = (
                    sum(run[key] for run in found[way]) / given.rounds / counts[way]
                    for key in ("wall", "processor")
                )
                if way == "together":
                    best = wall, processor
                other = found[way][0]["etas"]
                differ = sum(a != b for a, b in zip(first, other, strict=False))
                print(
                    f"{potential:5} n={particles:4} {way:9} {1.0 / wall:9.1f} a second, "
                    f"{1e3 * processor:8.3f} ms of processors; together over it "
                    f"{wall / best[0]:6.2f} by the clock, {processor / best[1]:6.2f} by these; "
                    f"{differ} of {min(len(first), len(other))} numbers differ",
                    flush=True,
                )


if __name__ == "__main__":
    main()
