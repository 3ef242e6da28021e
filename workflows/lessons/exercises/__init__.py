"""Exercises of each lesson: the question, the right answer, and answers of usual mistakes."""

from functools import cache
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.result import Collision


@cache
def in_house(tolerance: float = 1e-8, **fields: Any) -> Collision:
    """Return a collision of the reference engine, computed once in a process."""
    return collide(Scene(engine="reference", tolerance=tolerance, **fields))
