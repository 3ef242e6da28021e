"""Define the exercises of each lesson: question, right answer, and answers of usual mistakes."""

from functools import cache
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.result import Collision


@cache
def by_reference(tolerance: float = 1e-8, **fields: Any) -> Collision:
    """Return a collision of the reference engine, which each process computes once."""
    return collide(Scene(engine="reference", tolerance=tolerance, **fields))
