"""Random scenes that sweeps run in batches, and their results from batches."""

import math
from typing import Any

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.batching import batch_kind
from chaincor.workflows.campaign.work import collide_together
from chaincor.workflows.collision import collide
from chaincor.workflows.result import Collision


def draw_together(seed: int, index: int, engine: str) -> Scene:
    """Return a scene that sweeps run in batches: tiny speeds, lj that may break, or any."""
    random = np.random.default_rng([seed, index, 13])
    turn = index % 4
    name = (
        ("lj", "lj", "toda", "log")[turn] if turn else str(random.choice(["lj", "toda", "power"]))
    )
    n = round(math.exp(random.uniform(math.log(2.0), math.log(100.0))))
    fields: dict[str, Any] = {"potential": name, "particles": n, "engine": engine}
    speed = math.exp(random.uniform(math.log(0.01), math.log(1.5)))
    if turn == 0:
        speed = math.exp(random.uniform(math.log(1e-6), math.log(1e-2)))
    elif turn == 1:
        n = fields["particles"] = round(math.exp(random.uniform(math.log(2.0), math.log(150.0))))
        # From speeds at which a bond may break to speeds at which several bonds usually break. They
        # follow from the total energy.
        speed = random.uniform(0.7, 1.6) * min(1.0, 20.0 / n) ** 0.5
    if name == "toda":
        fields["toda_b"] = float(random.choice([3.0, 10.0, 30.0]))
    elif name == "power":
        fields |= {"power_order": 4, "power_c": 1.0}
    tolerance = float(10.0 ** random.uniform(-7.0, -3.0))
    return Scene(**fields, speed=float(speed), tolerance=tolerance)


def collide_in_batch(scene: Scene) -> tuple[Collision, bool]:
    """Return the result of a scene in a sweep, and whether the scene ran in a batch."""
    others = [scene.replace(speed=factor * (scene.speed or 1.0)) for factor in (0.9, 0.95, 1.05)]
    batch = [other for other in others if batch_kind(other) == batch_kind(scene)]
    found = None
    if batch_kind(scene) is not None:
        found = collide_together([*batch, scene])[-1]
    return (collide(scene), False) if found is None else (found, True)
