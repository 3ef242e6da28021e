"""Random warm scenes: chains in equilibrium that hit walls or warm free targets."""

import numpy as np

from benchmarks.scenes.chains import draw_chain
from chaincor.lammps_inputs.bonds.equilibrium import LEAST_DEPTH
from chaincor.lammps_inputs.scene import Scene

_POTENTIALS = ("harmonic", "lj", "toda", "log", "power", "morse")
_MOST_PARTICLES = 60
# Range of temperatures, in units of (v*)^2 or of the highest temperature that a bond allows.
_COLDEST, _WARMEST = 1e-8, 1.0
# Range of the impact speed, in units of the thermal speed of a particle.
_SLOWEST, _FASTEST = 0.1, 30.0
# Largest impact speed, in v*. Faster impacts break bonds or stiffen them strongly.
_FASTEST_IMPACT = 1.2


def draw_warm_scene(random: np.random.Generator, engine: str | None = None) -> Scene:
    """
    Draw a scene with a temperature.

    Parameters
    ----------
    random : numpy.random.Generator
        Source of random numbers.
    engine : str, optional
        Engine; drawn by default.

    Returns
    -------
    Scene
        A valid scene.

    Raises
    ------
    SceneError
        If the drawn keys are not a valid scene.
    """
    potential = str(random.choice(_POTENTIALS))
    particles = round(10 ** random.uniform(np.log10(2), np.log10(_MOST_PARTICLES)))
    fields = draw_chain(random, potential, particles, engine)
    bond = Scene(**fields).bond
    held = min(bond.dissociation, bond.barrier) / LEAST_DEPTH
    scale = 0.1 if bond.natural_speed is None else bond.natural_speed
    hottest = min(held, scale**2)
    temperature = hottest * float(10 ** random.uniform(np.log10(_COLDEST), np.log10(_WARMEST)))
    ratio = float(10 ** random.uniform(np.log10(_SLOWEST), np.log10(_FASTEST)))
    velocity = min(ratio * temperature**0.5, _FASTEST_IMPACT * scale)
    fields |= {"temperature": temperature, "velocity": velocity}
    fields["seed"] = int(random.integers(1_000_000))
    if random.random() < 0.3:
        fields["masses"] = (1.0, float(10 ** random.uniform(-1, 1)))
    if random.random() < 0.3:
        fields["target_particles"] = round(10 ** random.uniform(0.0, 1.5))
    if random.random() < 0.15:
        fields |= {
            "contact": "power",
            "contact_stiffness": float(10 ** random.uniform(-1, 2)),
            "contact_exponent": float(random.choice([1.0, 1.5, 2.0])),
        }
    return Scene(**fields)
