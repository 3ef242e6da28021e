"""Define the exercises of each lesson: question, right answer, and answers of usual mistakes."""

from functools import cache
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.result import Collision


@cache
def by_reference(tolerance: float = 1e-8, **fields: Any) -> Collision:
    """Compute a collision with the reference engine, once in each process."""
    return collide(Scene(engine="reference", tolerance=tolerance, **fields))
