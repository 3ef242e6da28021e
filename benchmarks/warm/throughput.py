"""
Compare the speed of an ensemble with that of single collisions.

    python -m benchmarks.warm.throughput [--samples 10000] [--singles 100] [--potential toda]
        [--particles 10] [--temperature 1e-3] [--velocity 0.1] [--tolerance 1e-6] [--workers 2]

Two methods alternate in one run: `collide_many` for a part of the samples, and `collide` for some
of the same seeds. Each pair of results must agree within both error bars. Prints the ratios of
elapsed times and of processor times. Loops are compiled before.
"""

import argparse
import time
from collections.abc import Callable
from typing import Any

from chaincor import Scene, collide, collide_many

ROUNDS = 10


def timed(action: Callable[[], Any]) -> tuple[Any, float, float]:
    """Return the result of an action, the elapsed time, and this process's processor time."""
    started, cpu = time.perf_counter(), time.process_time()
    value = action()
    return value, time.perf_counter() - started, time.process_time() - cpu


def compare(scene: Scene, samples: int, singles: int, workers: int) -> dict[str, float]:
    """Return collisions per second of both methods, and their ratios."""
    collide_many(scene, 1, workers=workers)
    collide(scene)
    share, few = max(samples // ROUNDS, 1), max(singles // ROUNDS, 1)
    many = many_cpu = single = single_cpu = worst = 0.0
    together = 0
    for k in range(ROUNDS):
        first = scene.replace(seed=1 + k * share)
        found, seconds, cpu = timed(lambda: collide_many(first, share, workers=workers))  # noqa: B023
        many, many_cpu = many + seconds, many_cpu + cpu
        together += sum(sample.tolerance_met is True for sample in found.samples)
        for sample in found.samples[:few]:
            one = scene.replace(seed=sample.seed)
            result, seconds, cpu = timed(lambda: collide(one))  # noqa: B023
            single, single_cpu = single + seconds, single_cpu + cpu
            bars = sample.restitution_error + result.restitution_error
            worst = max(worst, abs(sample.restitution - result.restitution) / bars)
    count, alone = ROUNDS * share, ROUNDS * few
    return {
        "samples": count,
        "singles": alone,
        "met": together / count,
        "samples_a_second": count / many,
        "singles_a_second": alone / single,
        "ratio": single / alone / (many / count),
        "processor_ratio": single_cpu / alone / (many_cpu / count),
        "worst_difference_in_bars": worst,
    }


def main() -> None:
    """Compare both methods, and print the results."""
    parser = argparse.ArgumentParser(description="ensembles against single collisions")
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--singles", type=int, default=100)
    parser.add_argument("--potential", default="toda")
    parser.add_argument("--particles", type=int, default=10)
    parser.add_argument("--temperature", type=float, default=1e-3)
    parser.add_argument("--velocity", type=float, default=0.1)
    parser.add_argument("--tolerance", type=float, default=1e-6)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    scene = Scene(
        potential=given.potential,
        particles=given.particles,
        velocity=given.velocity,
        temperature=given.temperature,
        tolerance=given.tolerance,
        engine="reference",
    )
    found = compare(scene, given.samples, given.singles, given.workers)
    for name, value in found.items():
        print(f"{name:26} {value:.6g}")


if __name__ == "__main__":
    main()
