"""Random keys of a scene for its chain, engine and tolerance."""

from typing import Any

import numpy as np


def draw_chain(
    random: np.random.Generator, potential: str, particles: int, engine: str | None
) -> dict[str, Any]:
    """
    Draw the engine, the tolerance and the parameters of a potential.

    Parameters
    ----------
    random : numpy.random.Generator
        Source of random numbers.
    potential : str
        Name of the potential.
    particles : int
        Number of particles.
    engine : str or None
        Engine; drawn if it is None.

    Returns
    -------
    dict
        Keys of a scene.
    """
    fields: dict[str, Any] = {
        "potential": potential,
        "particles": particles,
        "engine": engine or str(random.choice(["lammps", "reference"])),
        "tolerance": float(10 ** random.uniform(-9, -4)),
    }
    if potential == "toda":
        fields["toda_b"] = float(random.choice([3.0, 10.0, 30.0]))
    if potential == "morse":
        fields["morse_a"] = float(random.choice([3.0, 6.0, 12.0]))
    if potential == "power":
        order = int(random.integers(3, 7))
        fields |= {"power_order": order, "power_c": 1.0 if order % 2 == 0 else -1.0}
    return fields
