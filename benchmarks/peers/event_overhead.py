"""Print the time of an event-driven Verlet run, divided by the time of a bare `run N`.

The bare run has as many steps of the same chain, in one command and without wall and checks. Both
runs alternate in this process. The ratio of the median times is printed, with the quartiles of
single ratios. The ratio of the shortest times is for busy machines.

Run: python -m benchmarks.peers.event_overhead
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.bond_table import BondTable, tabulate
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps.instance import LammpsChain

LIMIT = 1.35
SIZES = ((100, 0.0125), (1000, 0.05))
BONDS = (
    {"potential": "harmonic", "velocity": 0.1},
    {"potential": "lj", "speed": 0.1},
    {"potential": "lj", "speed": 0.4},
)


def time_bare_run(scene: Scene, numerics: Numerics, table: BondTable | None, steps: int) -> float:
    """Return the seconds of one `run` command for a vibrating chain without a wall."""
    with (
        tempfile.TemporaryDirectory() as name,
        LammpsChain(scene.problem, numerics, table, Path(name)) as chain,
    ):
        chain.commands("run 0 post no")
        # Particle 1 moves towards the wall and all others away from it. The chain vibrates.
        chain.v[1:] *= -1.0
        chain.v[0] *= 0.5
        started = time.perf_counter()
        chain.commands(f"run {steps} pre no post no")
        return time.perf_counter() - started


def measure(fields: dict, particles: int, timestep: float, repeats: int) -> tuple[float, ...]:
    """Return ratio of medians, quartiles, ratio of minima, and microseconds per bare step."""
    scene = Scene(particles=particles, scheme="verlet", timestep=timestep, **fields)
    numerics = Numerics.from_scene(scene)
    first = lammps.run(scene.problem, numerics)
    steps = first.force_evaluations
    table = None
    if fields["potential"] != "harmonic":
        # The table has as many rows for twice the strains, because a bare run cannot widen it.
        bond_range = (2.0 * first.bond_min - 1.0, 2.0 * first.bond_max - 1.0)
        table = tabulate(scene.bond, bond_range, rows=first.details["table"]["rows"])
    events, bare = [], []
    for _ in range(repeats):
        events.append(lammps.run(scene.problem, numerics).seconds)
        bare.append(time_bare_run(scene, numerics, table, steps))
    low, high = np.percentile(np.array(events) / np.array(bare), [25, 75])
    ratio = float(np.median(events) / np.median(bare))
    best = min(events) / min(bare)
    return ratio, float(low), float(high), best, float(np.median(bare)) / steps * 1e6


def main() -> None:
    """Print the ratios; fail if a ratio is above the limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=9)
    repeats = parser.parse_args().repeats
    over = []
    print("| particles | dt | bond | event/bare | quartiles | shortest | us per bare step |")
    print("|---|---|---|---|---|---|---|")
    for particles, timestep in SIZES:
        for fields in BONDS:
            ratio, low, high, best, cost = measure(fields, particles, timestep, repeats)
            name = " ".join(str(value) for value in fields.values())
            print(
                f"| {particles} | {timestep} | {name} | {ratio:.2f} | {low:.2f} to {high:.2f} "
                f"| {best:.2f} | {cost:.2f} |",
                flush=True,
            )
            if ratio > LIMIT:
                over.append(f"{particles} {name}")
    if over:
        raise SystemExit(f"more than {LIMIT}: {', '.join(over)}")


if __name__ == "__main__":
    main()
