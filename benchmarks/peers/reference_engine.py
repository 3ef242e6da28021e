"""
Compare the reference engine with its peers, as ratios from one run.

    python -m benchmarks.peers.reference_engine [--long] [--csv FILE]

Integrators are compared at equal error of eta. Each uses the coarsest setting after which all finer
settings are within 1e-11 of a much more accurate run. Times are medians of the processor time of
one thread, without compiling, and the integrators alternate. Three tasks are timed:

- *last*: from the first to the last contact, whose time is given to the peers.
- *whole*: to the time at which an argument shows that no contact follows (see ``ending``). Our
  engine looks ahead with coarse steps. The peers are given this time, and continue after the last
  contact with the loose tolerance that is fastest for them.
- *plain*: the same, but the peers continue with unchanged tolerance, like in a simple program.

heyoka differentiates the expression of the force. In heyoka, two powers of r are twice as fast as
the products of 1/r (*heyoka_products*) that the other integrators use.

The loops over bonds are compared with the same loops in C, compiled with ``gcc -O3 -march=native``.
"""

import argparse
import csv
import math
import tempfile
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.peers.c_loops import compare_loops, compile_c, compile_ours
from benchmarks.peers.integrators import Dop853Chain, HeyokaChain, coarsest, lj_products, timed
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import bookkeeping, stepping
from chaincor.workflows.engines.reference.moving import Motion, Stepper

ERROR = 1e-11
REPEATS = 15
# Longer runs need fewer repeats.
SLOW, SLOW_REPEATS = 0.3, 3
SPEEDS = (0.1, 0.4, 1.0)
# Ratio of neighbouring steps. Each step costs about 4 % more than the previous one. With a coarser
# choice, an integrator that just misses the error would seem much slower.
FINER_STEP = 2.0 ** (-1 / 16)
HEYOKA_TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(18, 29))
DOP853_TOLERANCES = tuple(10.0 ** (-k / 8) for k in range(80, 105))
# Tolerances with which peers may look ahead.
LOOSE_TOLERANCES = (1e-3, 1e-5, 1e-7)
TASKS = ("last", "whole", "plain")


def restitution(velocities: np.ndarray, scene: Scene) -> float:
    """Return eta of final velocities."""
    return float((velocities.mean() / scene.impact_velocity) ** 2)


def run_ours(scene: Scene, step: float, scheme: str = "order8") -> Outcome:
    """Run the reference engine with fixed steps."""
    return stepping.run(scene.problem, Numerics(scheme=scheme, timestep=step))


def seconds_to_last_contact(scene: Scene, step: float, scheme: str, last: float) -> float:
    """Return the processor time of fixed steps up to a time, without a search for the end."""
    stepper = Stepper.of(scene.line, scene.bond, scheme, step)
    chain = Motion.at_start(scene.problem, stepper)
    bookkeeping.never_argue(chain.run_state)
    return timed(lambda: chain.advance(math.ceil(last / step)))


def our_tasks(scene: Scene, scheme: str, step: float, last: float) -> dict[str, Callable]:
    """Return functions that time the tasks in the reference engine."""

    def whole() -> float:
        return timed(lambda: run_ours(scene, step, scheme))

    to_last = partial(seconds_to_last_contact, scene, step, scheme, last)
    return {"last": to_last, "whole": whole, "plain": whole}


def peer_tasks(chain, loose_chains: Iterable, last: float, end: float) -> dict[str, Callable]:
    """Return functions that time a peer's tasks; it looks ahead with the fastest tolerance."""
    state = chain.run(chain.start, 0.0, last)
    for loose in loose_chains:
        loose.run(state, last, end)
    quickest = min(loose_chains, key=lambda loose: timed(lambda: loose.run(state, last, end)))

    def to_last() -> float:
        return timed(lambda: chain.run(chain.start, 0.0, last))

    def look_ahead() -> float:
        return timed(lambda: quickest.run(chain.run(chain.start, 0.0, last), last, end))

    def plain() -> float:
        return timed(lambda: chain.run(chain.start, 0.0, end))

    return {"last": to_last, "whole": look_ahead, "plain": plain}


def compare_integrators(speed: float) -> list[dict[str, float | str]]:
    """Return settings, errors and times of integrators at equal error, for lj and n = 100."""
    scene = Scene(potential="lj", particles=100, speed=speed)
    tight = run_ours(scene, 0.0125)
    exact, end = restitution(tight.velocities, scene), tight.duration
    # Slightly after the contact, because some integrators detect it slightly later.
    last = float(tight.contact_times[-1]) + 1e-3
    rows: list[dict[str, float | str]] = []
    tasks: list[dict[str, Callable]] = []

    def add(name, settings, velocities_of, tasks_of):
        setting, error = coarsest(
            settings, lambda s: abs(restitution(velocities_of(s), scene) - exact), ERROR
        )
        rows.append({"speed": speed, "integrator": name, "setting": setting, "error": error})
        tasks.append(tasks_of(setting))

    for scheme, longest in (("order8", 0.2), ("extrapolated14", 0.8)):
        add(
            scheme,
            [longest * FINER_STEP**k for k in range(57)],
            lambda step, scheme=scheme: run_ours(scene, step, scheme).velocities,
            lambda step, scheme=scheme: our_tasks(scene, scheme, step, last),
        )
    for name, kind, tolerances in (
        ("heyoka", HeyokaChain, HEYOKA_TOLERANCES),
        ("heyoka_products", partial(HeyokaChain, force_of=lj_products), HEYOKA_TOLERANCES),
        ("dop853", Dop853Chain, DOP853_TOLERANCES),
    ):
        chains = {tolerance: kind(scene, tolerance) for tolerance in tolerances}
        loose = [kind(scene, tolerance) for tolerance in LOOSE_TOLERANCES]
        add(
            name,
            tolerances,
            lambda tolerance, chains=chains: chains[tolerance].run(
                chains[tolerance].start, 0.0, last
            )[scene.particles :],
            lambda tolerance, chains=chains, loose=loose: peer_tasks(
                chains[tolerance], loose, last, end
            ),
        )
    add_times(rows, tasks)
    return rows


def add_times(rows: list[dict], tasks: list[dict[str, Callable]]) -> None:
    """Add the median times of the tasks, which alternate, and their ratios to ours."""
    samples: dict = {(k, task): [] for k in range(len(rows)) for task in TASKS}
    for turn in range(REPEATS):
        for (k, task), times in samples.items():
            if turn < SLOW_REPEATS or times[0] < SLOW:
                times.append(tasks[k][task]())
    medians = {key: float(np.median(times)) for key, times in samples.items()}
    for k, row in enumerate(rows):
        row |= {f"{task}_ms": 1e3 * medians[k, task] for task in TASKS}
        row |= {f"{task}_over_8": medians[k, task] / medians[0, task] for task in TASKS}
        row |= {f"{task}_over_x14": medians[k, task] / medians[1, task] for task in TASKS}


def measure_scaling(sizes: Iterable[int]) -> list[dict[str, float]]:
    """Return the time of whole collisions divided by n^2, for lj at 0.4 v* and order 6 at 0.1."""
    rows: list[dict[str, float]] = []
    for particles in sizes:
        scene = Scene(potential="lj", particles=particles, speed=0.4)
        outcome = stepping.run(scene.problem, Numerics(scheme="order6", timestep=0.1))
        # The simulated time per particle differs slightly, because the end is detected at other
        # times.
        per_square = outcome.seconds / (particles * outcome.duration)
        rows.append(
            {
                "particles": float(particles),
                "seconds": outcome.seconds,
                "duration": outcome.duration,
                "ns_per_particle_and_time": 1e9 * per_square,
                "over_first": per_square / (rows[0]["ns_per_particle_and_time"] * 1e-9)
                if rows
                else 1.0,
            }
        )
    return rows


def show(title: str, rows: list[dict]) -> None:
    """Print rows as a table."""
    print(f"\n{title}", flush=True)
    print("  ".join(f"{name:>14}" for name in rows[0]))
    for row in rows:
        shown = (v if isinstance(v, str) else f"{v:.4g}" for v in row.values())
        print(
            "  ".join(
                f"{text:>{max(14, len(name))}}" for name, text in zip(row, shown, strict=True)
            )
        )


def measure_tables(longest: bool) -> Iterator[tuple[str, list[dict]]]:
    """Yield the tables, each as soon as it is measured."""
    for speed in SPEEDS:
        yield f"integrators at equal error, {speed:g} v*", compare_integrators(speed)
    with tempfile.TemporaryDirectory() as folder:
        c_loops, ours = compile_c(Path(folder)), compile_ours()
        yield (
            "loops, ns per bond",
            [compare_loops(particles, c_loops, ours) for particles in (100, 1000, 20000)],
        )
    sizes = (100, 300, 1000, 3000)
    yield "scaling", measure_scaling((*sizes, 10000, 20000) if longest else sizes)


def main() -> None:
    """Run all comparisons."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--csv", type=Path, help="also write every figure to this file")
    parser.add_argument("--long", action="store_true", help="chains of 20000 too: minutes")
    arguments = parser.parse_args()
    tables = {}
    for title, rows in measure_tables(arguments.long):
        show(title, rows)
        tables[title] = rows
    if arguments.csv:
        with arguments.csv.open("w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(["table", "row", "figure", "value"])
            for title, rows in tables.items():
                for number, row in enumerate(rows):
                    writer.writerows((title, number, name, value) for name, value in row.items())


if __name__ == "__main__":
    main()
