"""
Compile loops of the named bonds before the tests, in one process per core.

    python -m tests.warm_kernels [all]

Without ``all``, the program compiles only the loops that `make test` needs: every kind of loop for
lj and toda, and time steps for other bonds.

Otherwise, workers of the tests would wait for each other, half a minute for each bond. Loops that
are already on disk take a second.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.collide_many import collide_many
from chaincor.workflows.engines.reference import adaptive, modal, stepping

HARMONIC = {"potential": "harmonic", "velocity": 0.1}
# Bonds in decreasing order of the time to compile.
BONDS = (
    {"potential": "log"},
    {"potential": "power", "power_order": 4, "power_c": 1.0},
    {"potential": "toda"},
    {"potential": "morse"},
    {"potential": "lj"},
    HARMONIC,
)
POWERS = tuple(
    {
        "potential": "power",
        "power_order": order,
        "power_c": -1.0 if order % 2 else 1.0,
        "speed": 0.1,
    }
    for order in (3, 5, 6, 8)
)
# For these bonds, the tests also need loops for adaptive steps, unequal masses and two bodies.
WAITED_FOR = ("toda", "lj")


def compile_steps(fields: dict) -> None:
    """Compile both kinds of steps for a chain of unit masses at a wall."""
    step_once(Scene(particles=5, **fields))


def compile_adaptive(fields: dict) -> None:
    """Compile adaptive steps."""
    adaptive.run(Scene(particles=5, **fields).problem, 1e-6)


def compile_masses(fields: dict) -> None:
    """Compile steps for unequal masses."""
    step_once(Scene(particles=5, **fields).replace(masses=(1.0, 2.0)))


def compile_bodies(fields: dict) -> None:
    """Compile steps of two bodies, and of many warm chains at once."""
    scene = Scene(particles=5, **fields)
    if fields["potential"] not in ("power", "morse"):
        step_once(scene.replace(target_particles=2))
    if fields["potential"] == "toda":
        # Slow tests compile the loops of other bonds.
        warm = scene.replace(temperature=1e-4, engine="reference")
        collide_many(warm, 1, workers=1)


def compile_modes() -> None:
    """Compile loops for modes of harmonic chains at a wall, with equal and unequal masses."""
    scene = Scene(potential="harmonic", particles=5, velocity=0.1, engine="reference")
    for each in (scene, scene.replace(masses=(1.0, 2.0))):
        modal.run(each.problem)


def step_once(scene: Scene) -> None:
    """Run a collision with each of two kinds of steps."""
    for scheme in ("order8", "extrapolated14"):
        stepping.run(scene.problem, Numerics(scheme=scheme, timestep=0.1))


def main() -> None:
    """Compile in as many processes as there are cores."""
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        whole = "all" in sys.argv
        bonds = BONDS + POWERS if whole else BONDS
        more = [bond for bond in BONDS if whole or bond["potential"] in WAITED_FOR]
        tasks = [pool.submit(compile_bodies, bond) for bond in more]
        tasks += [pool.submit(compile_adaptive, bond) for bond in more]
        tasks += [pool.submit(compile_steps, bond) for bond in bonds]
        tasks += [pool.submit(compile_masses, bond) for bond in more]
        tasks.append(pool.submit(compile_modes))
        for task in tasks:
            task.result()


if __name__ == "__main__":
    main()
