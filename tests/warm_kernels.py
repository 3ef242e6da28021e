"""
Compile the loops of every named bond once, before the tests start, one process a core.

    python -m tests.warm_kernels [all]

With ``all`` also those that only slow tests need: of power bonds of any order.

Left to the tests, every worker would compile for itself what the others compile meanwhile: half a
minute for each bond. What is kept on disk already costs a second.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.collide_many import collide_many
from chaincor.workflows.engines.in_house import adaptive, modal, stepping

# From the one that takes longest.
BONDS = (
    {"potential": "log"},
    {"potential": "power", "power_order": 4, "power_c": 1.0},
    {"potential": "toda"},
    {"potential": "morse"},
    {"potential": "lj"},
    {"potential": "harmonic", "velocity": 0.1},
)
POWERS = tuple(
    {
        "potential": "power",
        "power_order": order,
        "power_c": -1.0 if order % 2 else 1.0,
        "speed": 0.1,
    }
    for order in (3, 5, 6, 7, 8, 9)
)


def compile_loops(fields: dict) -> None:
    """Run every kind of step of a bond for one short collision."""
    scene = Scene(particles=5, **fields)
    step_once(scene)
    adaptive.run(scene, 1e-6)


def compile_lines(fields: dict) -> None:
    """Do the same with unequal masses, with two bodies, and with many chains at once."""
    scene = Scene(particles=5, **fields)
    step_once(scene.replace(masses=(1.0, 2.0)))
    if fields["potential"] not in ("power", "morse"):
        step_once(scene.replace(target_particles=2))
    if fields["potential"] == "toda":
        # Slow tests compile those of other bonds.
        warm = scene.replace(temperature=1e-4, engine="reference")
        collide_many(warm, 1, workers=1)


def compile_modes() -> None:
    """Do the same by the modes of harmonic chains, at a wall and of unequal masses."""
    scene = Scene(potential="harmonic", particles=5, velocity=0.1, engine="reference")
    for each in (scene, scene.replace(masses=(1.0, 2.0))):
        modal.run(each)


def step_once(scene: Scene) -> None:
    """Carry out a collision with steps of either kind."""
    for scheme in ("order8", "extrapolated14"):
        stepping.run(scene, Numerics(scheme=scheme, timestep=0.1))


def main() -> None:
    """Compile in as many processes as there are cores."""
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        powers = POWERS if "all" in sys.argv else ()
        tasks = [pool.submit(compile_loops, bond) for bond in BONDS + powers]
        tasks += [pool.submit(compile_lines, bond) for bond in BONDS]
        tasks.append(pool.submit(compile_modes))
        for task in tasks:
            task.result()


if __name__ == "__main__":
    main()
