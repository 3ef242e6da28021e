"""Draw random scenes that are hard to judge: late contacts, breaking bonds, long chains."""

import math
from typing import Any

import numpy as np

from chaincor.lammps_inputs.scene import Scene


def draw_late(seed: int, index: int, engine: str) -> Scene:
    """Return a scene whose chain may hit the wall late: in five of seven, lj at 1.2 to 1.8 v*."""
    random = np.random.default_rng([seed, index, 5])
    n = round(math.exp(random.uniform(math.log(5.0), math.log(160.0))))
    turn = index % 7
    if turn < 5:
        speed = float(random.uniform(1.2, 1.8))
        return Scene(potential="lj", particles=n, speed=speed, engine=engine)
    name = ("toda", "log", "power")[(index // 7 + turn) % 3]
    fields: dict[str, Any] = {"potential": name, "particles": n, "engine": engine}
    if name == "toda":
        fields["toda_b"] = float(random.choice([5.0, 10.0, 30.0]))
    speed = random.uniform(0.6, 1.8)
    if name == "power":
        order = int(random.integers(3, 8))
        odd = order % 2 == 1
        fields |= {"power_order": order, "power_c": -1.0 if odd else 1.0}
        speed = random.uniform(0.03, 0.3) if odd else speed
    return Scene(**fields, speed=float(speed))


def draw_breaking(seed: int, index: int, engine: str) -> Scene:
    """Return a scene in which bonds may break: lj at 0.7 to 2 v*, log or power near the barrier."""
    random = np.random.default_rng([seed, index, 7])
    name = ("lj", "lj", "log", "power")[index % 4]
    n = round(math.exp(random.uniform(math.log(5.0), math.log(300.0))))
    if name == "power":
        order = int(random.integers(3, 7))
        odd = order % 2 == 1
        speed = random.uniform(0.1, 0.36) if odd else random.uniform(0.5, 2.0)
        return Scene(
            potential="power", power_order=order, power_c=-1.0 if odd else 1.0, particles=n,
            speed=float(speed), engine=engine,
        )  # fmt: skip
    speed = random.uniform(0.7, 2.0) if name == "lj" else random.uniform(0.6, 1.8)
    return Scene(potential=name, particles=n, speed=float(speed), engine=engine)


def draw_long(seed: int, index: int, engine: str) -> Scene:
    """Return a chain of 1000 to 4000 particles: in two of three, lj at 0.1 to 1 v*; toda; log."""
    random = np.random.default_rng([seed, index, 13])
    name = ("lj", "toda", "lj", "log", "lj", "lj")[index % 6]
    n = round(math.exp(random.uniform(math.log(1000.0), math.log(4000.0))))
    speed = float(random.uniform(0.1, 1.0))
    tolerance = float(10.0 ** random.uniform(-7.0, -5.0))
    return Scene(potential=name, particles=n, speed=speed, tolerance=tolerance, engine=engine)


def draw_forgetful(seed: int, index: int, engine: str) -> Scene:
    """Return a chain of 3000 to 6000 particles that breaks up: in two of three, lj; or log."""
    random = np.random.default_rng([seed, index, 17])
    name = ("lj", "log", "lj")[index % 3]
    n = round(math.exp(random.uniform(math.log(3000.0), math.log(6000.0))))
    speed = float(random.uniform(0.3, 1.0) if name == "lj" else random.uniform(0.7, 1.0))
    tolerance = float(10.0 ** random.uniform(-7.0, -4.0))
    return Scene(potential=name, particles=n, speed=speed, tolerance=tolerance, engine=engine)


def draw_loose(seed: int, index: int, engine: str) -> Scene:
    """Return a harmonic, lj or toda scene at a loose tolerance or with an explicit Verlet step."""
    random = np.random.default_rng([seed, index, 11])
    name = ("harmonic", "lj", "toda")[index % 3]
    n = int(random.integers(5, 141))
    speed: dict[str, Any] = {
        "speed": float(math.exp(random.uniform(math.log(0.02), math.log(1.3))))
    }
    if name == "harmonic":
        speed = {"velocity": float(random.uniform(0.01, 0.5))}
    if random.random() < 0.5:
        numerics: dict[str, Any] = {"tolerance": float(10.0 ** random.uniform(-4.0, -2.0))}
    else:
        step = math.exp(random.uniform(math.log(0.0025), math.log(0.05)))
        numerics = {"scheme": "verlet", "timestep": float(step)}
    return Scene(potential=name, particles=n, engine=engine, **speed, **numerics)
