"""Find the cause of a difference from the reference engine, by runs with usual mistakes."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import ChaincorError
from chaincor.workflows.result import Collision
from chaincor.workflows.validation.comparison import judging_scene

# A cause is accepted if the difference left without it is less than the first fraction of the
# difference, and less than the second number or the third number of error bars.
_LEFT, _MOST_LEFT, _BARS = 0.02, 2e-3, 2.0
# The bond of an LJ potential with energy scale 1 is this many times stiffer than the chain's.
_LJ_STIFFNESS = 72.0
# Larger chains get no additional reference runs.
_MOST_PARTICLES = 2000
_BODIES = ("particles", "masses", "target_particles", "target_masses")


class _Change(NamedTuple):
    """Mistake of an integrator, as a change of the scene."""

    said: str  #: Description of the mistake.
    remedy: str
    scene: Scene  #: Scene that the integrator solves instead.
    velocity: float  #: Impact velocity of the chain in its own units.


def find_cause(
    scene: Scene,
    judge: Collision,
    restitution: float,
    allowed: float,
    velocities: Array | None = None,
    contacts: int | None = None,
) -> str | None:
    """
    Return the known mistake that explains a restitution unlike the reference engine's, or None.

    `velocities` are the final velocities of a user's integrator, which gave the restitution.
    Without them, the restitution itself is the result of the run. `allowed` is the sum of both
    error bars.
    """
    difference = abs(restitution - judge.restitution)
    if velocities is not None and _moves_on(scene, velocities):
        return (
            "the chain's centre of mass still moves towards the wall. Integrate "
            "past the last contact, and count velocities away from the wall as "
            "positive."
        )
    if scene.problem.all_particles > _MOST_PARTICLES or (
        velocities is not None and scene.target_particles
    ):
        return None
    for change in _changes(scene):
        try:
            left = min(_LEFT * difference, _MOST_LEFT)
            found = collide(judging_scene(change.scene, max(0.1 * left, 1e-9)))
        except (ChaincorError, ValueError):
            continue
        own = restitution if velocities is None else _restitution_of(change, velocities)
        if abs(own - found.restitution) <= max(left, _BARS * allowed):
            return f"{change.said}. {change.remedy}"
    if contacts is not None and contacts < judge.contacts:
        return (
            f"the run has {contacts} contacts instead of {judge.contacts}. Integrate past the last "
            "contact, and locate each contact within its step."
        )
    return None


def _moves_on(scene: Scene, velocities: Array) -> bool:
    """Return whether the centre of mass of a chain still approaches a rigid wall."""
    if scene.target_particles is not None:
        return False
    return bool(scene.line.separation(np.concatenate(([0.0], velocities))) < 0.0)


def _restitution_of(change: _Change, velocities: Array) -> float:
    """Return the restitution that the velocities give in the scene of the mistake."""
    line = change.scene.line
    speed = line.separation(np.concatenate((np.zeros(line.first), velocities)))
    return (speed / change.velocity) ** 2


def _changes(scene: Scene) -> Iterator[_Change]:
    """Yield the scenes that common mistakes would solve instead."""
    plain = scene.without("masses", "target_masses")
    if scene.masses is not None or scene.target_masses is not None:
        said = "the masses are ignored, and all particles are equal"
        yield _Change(said, "Use scene.line.chain_masses.", plain, scene.impact_velocity)
    v, natural = scene.impact_velocity, scene.bond.natural_speed
    if scene.problem.comes_moving or natural is None:
        return
    bare = scene.without("speed", "velocity")
    said = "the speed in units of v* is used as a velocity"
    given = bare.replace(velocity=v / natural)
    yield _Change(said, "Use scene.impact_velocity.", given, v / natural)
    fast = bare.replace(velocity=v * natural)
    said = "the velocity is multiplied by v* once more"
    yield _Change(said, "Use scene.impact_velocity.", fast, v * natural)
    if scene.potential == "lj":
        said = "the depth of the Lennard-Jones bond is 1 instead of 1/72, as in LJ units"
        stiff = bare.replace(velocity=v / math.sqrt(_LJ_STIFFNESS))
        yield _Change(said, "Divide energy and force by 72.", stiff, v)
    bodies = {key: getattr(scene, key) for key in _BODIES if getattr(scene, key) is not None}
    harmonic = Scene(potential="harmonic", velocity=v, **bodies)
    yield _Change("the bonds are harmonic", "Use scene.bond.force.", harmonic, v)
