"""Compare Verlet runs without wall checks between contacts with runs that check every step.

The random scenes have all potentials, short and long chains, slow and fast collisions, fine and
very coarse steps, and both walls. The two runs must have the same contacts, contact times and
speeds, final state and ending to the last bit, or must fail by the same error.

Run: python -m tests.workflows.engines.lammps.blind_steps [--scenes 1000] [--seed 1] [--longest 150]
"""

import argparse
from collections import Counter
from contextlib import AbstractContextManager
from dataclasses import replace
from unittest import mock

import numpy as np

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps import flight
from chaincor.workflows.engines.lammps.guard import WallGuard
from chaincor.workflows.errors import ChaincorError

POTENTIALS = ("harmonic", "lj", "toda", "log", "power")
FINEST, COARSEST = 0.0025, 0.3
SLOWEST, FASTEST = 0.01, 1.5


def random_scene(rng: np.random.Generator, longest: int = 150) -> tuple[Scene, Numerics]:
    """
    Draw a collision and its numerics.

    Verlet steps are between 0.0025 and 0.3, and speeds between 0.01 and 1.5 v*.
    """
    potential = str(rng.choice(POTENTIALS))
    fields: dict = {"potential": potential}
    fields["particles"] = round(2.0 * (longest / 2.0) ** rng.uniform())
    if potential == "power":
        order = int(rng.integers(3, 7))
        fields |= {"power_order": order, "power_c": 1.0 if order % 2 == 0 else -1.0}
    if potential == "harmonic":
        fields["velocity"] = float(10.0 ** rng.uniform(-3.0, -0.3))
    else:
        fields["speed"] = float(SLOWEST * (FASTEST / SLOWEST) ** rng.uniform())
    timestep = float(FINEST * (COARSEST / FINEST) ** rng.uniform())
    wall = "reflect" if rng.uniform() < 0.2 else "event"
    return Scene(**fields), Numerics(wall=wall, scheme="verlet", timestep=timestep)


def asking_every_step() -> AbstractContextManager:
    """Return a context in which the wall is checked before each Verlet step."""
    return mock.patch.object(flight, "WallGuard", return_value=None)


def outcome_bits(scene: Scene, numerics: Numerics) -> tuple:
    """Run a collision; return the results that must not depend on the number of wall checks."""
    try:
        outcome = lammps.run(scene.problem, numerics)
    except ChaincorError as error:
        return (type(error).__name__,)
    arrays = ("contact_times", "contact_speeds", "velocities", "displacements")
    bits = tuple(getattr(outcome, name).tobytes() for name in arrays)
    return (len(outcome.contact_times), outcome.ending, outcome.duration, *bits)


def with_table_of_a_run(scene: Scene, numerics: Numerics) -> Numerics:
    """
    Return numerics with which both runs of a collision have the same bond table.

    If a table is too short, LAMMPS may read arbitrary memory beyond its end. The two runs would
    then widen the table differently.
    """
    try:
        table = lammps.run(scene.problem, numerics).details["table"]
    except ChaincorError:
        return numerics
    return replace(numerics, bond_range=(table["shortest"], table["longest"]))


def compare(scene: Scene, numerics: Numerics) -> tuple[bool, tuple]:
    """Run a collision both ways; return whether results agree, and the results with all checks."""
    if scene.potential != "harmonic":
        numerics = with_table_of_a_run(scene, numerics)
    with asking_every_step():
        asking = outcome_bits(scene, numerics)
    return outcome_bits(scene, numerics) == asking, asking


def count_windows(counts: Counter) -> None:
    """Count windows without wall checks, and the windows that reached the wall and were undone."""
    run = WallGuard.run

    def counting(self: WallGuard, steps: int) -> bool:
        kept = run(self, steps)
        counts.update({"windows": 1, "taken back": not kept, "blind steps": steps})
        return kept

    WallGuard.run = counting  # type: ignore[method-assign]


def main() -> None:
    """Print how many scenes agree, and fail if one does not."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--longest", type=int, default=150)
    options = parser.parse_args()
    counts: Counter = Counter()
    count_windows(counts)
    different = []
    for k in range(options.scenes):
        scene, numerics = random_scene(np.random.default_rng([options.seed, k]), options.longest)
        same, found = compare(scene, numerics)
        counts["failures alike" if len(found) == 1 else "collisions"] += same
        counts["contacts"] += found[0] if same and len(found) > 1 else 0
        if not same:
            different.append(f"[{options.seed}, {k}] {scene.label} {scene.particles} {numerics}")
            print("different:", different[-1], flush=True)
    print(", ".join(f"{value} {key}" for key, value in counts.items()))
    if different:
        raise SystemExit(f"{len(different)} of {options.scenes} differ")


if __name__ == "__main__":
    main()
