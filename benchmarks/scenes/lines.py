"""Random scenes with unequal masses, free targets, soft contacts and initial states."""

import csv
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.scenes.chains import draw_chain
from chaincor.lammps_inputs.scene import Scene

_POTENTIALS = ("harmonic", "lj", "toda", "log", "power", "morse")
_MOST_PARTICLES = 60
# Extreme mass ratio, with fewer particles, because light particles need many more steps.
_EXTREME, _MOST_EXTREME = 1e6, 6
_SLOWEST, _FASTEST = 0.05, 1.2


def draw_line_scene(random: np.random.Generator, folder: Path, engine: str | None = None) -> Scene:
    """
    Draw a scene that is more general than a cold chain of unit masses at a hard wall.

    Parameters
    ----------
    random : numpy.random.Generator
        Source of random numbers.
    folder : pathlib.Path
        Folder for a CSV file of the initial state.
    engine : str, optional
        Engine; drawn by default.

    Returns
    -------
    Scene
        A valid scene. If all drawn masses are 1, it may be a standard scene.

    Raises
    ------
    SceneError
        If the drawn keys are not a valid scene.
    """
    extreme = bool(random.random() < 0.1)
    most = _MOST_EXTREME if extreme else _MOST_PARTICLES
    potential = str(random.choice(_POTENTIALS))
    particles = _count(random, most)
    fields = draw_chain(random, potential, particles, engine)
    if potential == "harmonic":
        fields["velocity"] = float(10 ** random.uniform(-3, -0.4))
    else:
        # At higher speeds, bonds of odd order would pass their barrier.
        fastest = 0.3 if potential == "power" and fields["power_order"] % 2 else _FASTEST
        low, high = np.log10(_SLOWEST), np.log10(fastest)
        fields["speed"] = float(10 ** random.uniform(low, high))
    masses = _masses(random, particles, extreme)
    if random.random() < 0.55:
        fields["target_particles"] = targets = _count(random, most)
        fields["target_masses"] = _masses(random, targets, extreme) or (1.0,)
    if random.random() < 0.4:
        fields |= {
            "contact": "power",
            "contact_stiffness": float(10 ** random.uniform(-1, 2)),
            "contact_exponent": float(random.choice([1.0, 1.5, 2.0, random.uniform(1, 3)])),
        }
    start = random.random()
    if start < 0.2:
        return _with_state(random, fields, masses, folder)
    if start < 0.35:
        fields["compression"] = float(random.uniform(-0.02, 0.05)) * _scale(fields)
    return Scene(**fields, **({} if masses is None else {"masses": masses}))


def _count(random: np.random.Generator, most: int) -> int:
    return round(10 ** random.uniform(0.0, np.log10(most)))


def _masses(random: np.random.Generator, count: int, extreme: bool) -> tuple[float, ...] | None:
    """Draw masses: alternating, random, graded, or one that differs; None for masses of 1."""
    ratio = float(10 ** random.uniform(-1.5, 1.5))
    if random.random() < 0.15:
        ratio **= 2.0
    if extreme:
        ratio = float(random.choice([_EXTREME, 1.0 / _EXTREME]))
    kind = random.choice(["equal", "pair", "any", "defect", "taper"], p=[0.25, 0.25, 0.2, 0.2, 0.1])
    if kind == "equal":
        return None
    if kind == "pair":
        return (1.0, ratio)[:count] if random.random() < 0.5 else (ratio, 1.0)[:count]
    if kind == "any":
        return tuple(float(m) for m in ratio ** random.uniform(0, 1, count))
    if kind == "taper":
        return tuple(float(m) for m in np.geomspace(1.0, ratio, count))
    masses = [1.0] * count
    masses[int(random.integers(count))] = ratio
    return tuple(masses)


def _scale(fields: dict[str, Any]) -> float:
    """Return the scale of strains at which a bond becomes anharmonic, at most 1."""
    return min(1.0, 10.0 / fields.get("toda_b", 10.0), 6.0 / fields.get("morse_a", 6.0))


def _with_state(
    random: np.random.Generator,
    fields: dict[str, Any],
    masses: tuple[float, ...] | None,
    folder: Path,
) -> Scene:
    """Return the scene with an initial state from a file: strains, gap, velocities and masses."""
    count = fields["particles"]
    speed = Scene(**fields).impact_velocity
    rows: dict[str, Any] = {}
    strains = 0.02 * _scale(fields) * random.normal(size=count)
    strains[0] = 0.0 if random.random() < 0.5 else random.uniform(0.0, 2.0)
    if random.random() < 0.5:
        rows["position"] = np.cumsum(strains) + np.arange(count)
    else:
        rows["strain"] = strains
    if random.random() < 0.7:
        rows["velocity"] = -speed * (1.0 + 0.3 * random.normal(size=count))
        fields.pop("speed", None)
        fields.pop("velocity", None)
    if masses is not None:
        if random.random() < 0.5:
            rows["mass"] = np.resize(masses, count)
        else:
            fields["masses"] = masses
    path = folder / "state.csv"
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(rows)
        writer.writerows(zip(*(map(repr, map(float, row)) for row in rows.values()), strict=True))
    return Scene(**fields, initial=path)


def draw_heavy_scene(random: np.random.Generator, engine: str | None = None) -> Scene:
    """
    Draw an anharmonic chain with one heavy particle, at a loose tolerance.

    Errors grow fast in such chains, and two time steps may agree in eta by chance. For the
    parameters see :func:`draw_line_scene`.
    """
    bonds: list[dict[str, Any]] = [
        {"potential": "power", "power_order": 4, "power_c": 6.0},
        {"potential": "power", "power_order": 4, "power_c": 40.0},
        {"potential": "power", "power_order": 6, "power_c": 5.0},
        {"potential": "toda"},
        {"potential": "log"},
    ]
    particles = int(random.choice([25, 40, 64, 100]))
    masses = np.ones(particles)
    masses[random.integers(particles)] = 10 ** random.uniform(0.5, 1.7)
    return Scene(
        **bonds[random.integers(len(bonds))],
        particles=particles,
        masses=masses.tolist(),
        speed=float(random.uniform(0.3, 1.2)),
        tolerance=float(random.choice([3e-2, 1e-2, 1e-3, 1e-4])),
        engine=engine or str(random.choice(["lammps", "reference"])),
    )
