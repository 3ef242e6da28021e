"""
Make the data files that lessons read on slow laptops.

Run it by ``python docs/course/make_data.py``.
"""

from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.versions import versions

FOLDER = Path(__file__).parent / "data"
TOLERANCE = 1e-6


def cor_curves() -> dict[str, list[float]]:
    """Return eta of chains with n = 100 and three bonds at the speeds of lesson 5."""
    speeds = [*np.linspace(0.05, 1.25, 13), *np.linspace(1.4, 2.0, 5)]
    names = ("lj", "toda", "log")
    return {"speed": speeds} | {
        name: [
            collide(
                Scene(potential=name, speed=speed, engine="reference"), tolerance=TOLERANCE
            ).restitution
            for speed in speeds
        ]
        for name in names
    }


def timestep_and_wall() -> dict[str, list[float]]:
    """Return the errors of eta of lesson 3: two walls in LAMMPS at seven timesteps."""
    scene = Scene(potential="lj", particles=20, speed=0.4)
    exact = collide(scene.replace(engine="reference"), tolerance=1e-11).restitution
    steps = [0.08 / 2**k for k in range(7)]
    return {"timestep": steps} | {
        wall: [
            abs(
                collide(
                    scene.replace(wall=wall, scheme="verlet", timestep=step, error=False)
                ).restitution
                - exact
            )
            for step in steps
        ]
        for wall in ("reflect", "event")
    }


def lengths() -> dict[str, list[float]]:
    """Return the lost energy and the contacts of harmonic chains of n = 5 to 2000."""
    sizes = [5, 10, 20, 50, 100, 200, 500, 1000, 2000]
    chains = [
        collide(Scene(potential="harmonic", particles=n, engine="reference"), tolerance=TOLERANCE)
        for n in sizes
    ]
    return {
        "particles": sizes,
        "lost": [1.0 - chain.restitution for chain in chains],
        "contacts": [chain.contacts for chain in chains],
    }


def write(name: str, columns: dict[str, list[float]], says: str) -> None:
    """Write a file of columns, preceded by lines that describe them."""
    made_by = ", ".join(
        f"{k} {v}" for k, v in versions().items() if k in ("chaincor", "lammps", "numpy")
    )
    with (FOLDER / f"{name}.csv").open("w", encoding="utf-8") as file:
        file.write(f"# {says}\n# made by docs/course/make_data.py with {made_by}\n")
        file.write(f"# {','.join(columns)}\n")
        for row in zip(*columns.values(), strict=True):
            file.write(",".join(f"{value:.9g}" for value in row) + "\n")


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    write(
        "cor_curves",
        cor_curves(),
        f"eta of chains of 100 against the speed in v*, each to {TOLERANCE:g}",
    )
    write(
        "timestep_and_wall",
        timestep_and_wall(),
        "error of eta against the Verlet step in LAMMPS: lj, n = 20, 0.4 v*",
    )
    write("lengths", lengths(), f"1 - eta and contacts of chains of springs, eta to {TOLERANCE:g}")
