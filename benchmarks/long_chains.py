"""
Long chains in the reference engine: speed-up by a second core, and time against length.

    python -m benchmarks.long_chains [--particles 5000 20000 100000] [--cores 1 2] [--repeats 9]
    python -m benchmarks.long_chains --growth 2000 4000 8000 16000
    python -m benchmarks.long_chains --run 100000

The first command compares the time of steps on different numbers of cores, for moving chains (lj,
0.4 v*, extrapolated14). It alternates between the numbers of cores and uses the shortest of many
times. It prints the speed-up, the ratio of processor times, and whether all bits are equal. The
second and the third command run whole collisions to 1e-6 on all cores. They print time, error bar,
and the exponent of the time between two lengths. A collision of 4000 particles takes a quarter of a
minute, and of 100000 particles an hour. `OMP_NUM_THREADS` limits the cores of these commands. The
machine must be idle.
"""

import argparse
import math
import os
import time

import numpy as np

from chaincor import collide
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.moving import Motion, Stepper

SCHEME, STEP = "extrapolated14", 0.6
# Bonds times steps in one timed run, which takes a third of a second.
WORK = 2e7


def scene_of(particles: int) -> Scene:
    """Return the scene of all measurements."""
    return Scene(potential="lj", particles=particles, speed=0.4, engine="reference")


def step_once(scene: Scene, stepper: Stepper, steps: int) -> tuple[float, float, Motion]:
    """Return elapsed time, processor time and chain after steps with all bonds in motion."""
    chain = Motion.at_start(scene.problem, stepper)
    chain.run_state.active = scene.particles - 1
    bookkeeping.never_argue(chain.run_state)
    started, used = time.perf_counter(), time.process_time()
    chain.advance(steps)
    return time.perf_counter() - started, time.process_time() - used, chain


def is_same(one: Motion, other: Motion) -> bool:
    """Return whether the states of two chains are equal to the last bit."""
    states = zip(
        one.arrays.now + one.arrays.last, other.arrays.now + other.arrays.last, strict=True
    )
    same = all(np.array_equal(mine, theirs) for mine, theirs in states)
    return same and np.array_equal(one.contact_times, other.contact_times)


def compare(particles: int, cores: list[int], repeats: int) -> None:
    """Print a row for each number of cores."""
    scene = scene_of(particles)
    stepper = Stepper.of(scene.line, scene.bond, SCHEME, STEP)
    steps = max(32, int(WORK / particles))
    best = dict.fromkeys(cores, (math.inf, math.inf))
    chains: dict[int, Motion] = {}
    for _ in range(repeats + 1):  # the first round loads the loops
        for count in cores:
            os.environ["OMP_NUM_THREADS"] = str(count)
            *times, chains[count] = step_once(scene, stepper, steps)
            best[count] = min(best[count], (times[0], times[1]))
    first = cores[0]
    for count in cores:
        seconds, used = best[count]
        same = "equal" if is_same(chains[count], chains[first]) else "DIFFER"
        print(
            f"| {particles} | {count} | {1e6 * seconds / steps:.0f} | "
            f"{best[first][0] / seconds:.2f} | {used / best[first][1]:.2f} | {same} |",
            flush=True,
        )


def collide_whole(sizes: list[int]) -> None:
    """Print time and error bar of whole collisions, and the exponent of the time."""
    print("| n | s | processor s | eta | bar | exponent |\n|---|---|---|---|---|---|")
    before: tuple[int, float] | None = None
    for particles in sizes:
        started, used = time.perf_counter(), time.process_time()
        result = collide(scene_of(particles), tolerance=1e-6)
        seconds, used = time.perf_counter() - started, time.process_time() - used
        grown = ""
        if before is not None:
            grown = f"{math.log(used / before[1]) / math.log(particles / before[0]):.2f}"
        before = particles, used
        print(
            f"| {particles} | {seconds:.1f} | {used:.1f} | {result.restitution:.7f} | "
            f"{result.restitution_error:.1e} | {grown} |",
            flush=True,
        )


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--particles", type=int, nargs="+", default=[5_000, 20_000, 100_000])
    parser.add_argument("--cores", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--growth", type=int, nargs="+", metavar="N")
    parser.add_argument("--run", type=int, metavar="N")
    arguments = parser.parse_args()
    if arguments.growth or arguments.run:
        collide_whole(arguments.growth or [arguments.run])
        return
    print("| n | cores | us a step | ratio | processor time | bits |\n|---|---|---|---|---|---|")
    for particles in arguments.particles:
        compare(particles, arguments.cores, arguments.repeats)


if __name__ == "__main__":
    main()
