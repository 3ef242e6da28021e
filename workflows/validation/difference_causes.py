"""Find the usual mistake that explains a difference, from reference runs of changed scenes."""

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

# A mistake is accepted as the cause if correcting it leaves at most the fraction _LEFT of the
# difference, and at most _MOST_LEFT. A remaining difference of at most _BARS error bars is also
# accepted.
_LEFT, _MOST_LEFT, _BARS = 0.02, 2e-3, 2.0
# If the energy scale of an LJ potential is 1, the bond is this many times stiffer than the chain's.
_LJ_STIFFNESS = 72.0
# If a chain has more particles than this, no additional reference runs are made.
_MOST_PARTICLES = 2000
_BODIES = ("particles", "masses", "target_particles", "target_masses")


class _Change(NamedTuple):
    """Mistake of an integrator, which acts like a change of the scene."""

    said: str  #: Description of the mistake.
    remedy: str
    scene: Scene  #: Scene that the integrator solves because of the mistake.
    velocity: float  #: Impact velocity that the mistaken integrator uses.


def find_cause(
    scene: Scene,
    judge: Collision,
    restitution: float,
    allowed: float,
    velocities: Array | None = None,
    contacts: int | None = None,
) -> str | None:
    """
    Return the known mistake that explains a difference in restitution, or None.

    `judge` is the result of the reference engine, and `restitution` is the judged result.
    `velocities` are the final velocities from which a user's integrator got the restitution, if
    they are known. `allowed` is the sum of both error bars.
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
    """Return whether the chain's centre of mass still approaches a rigid wall."""
    if scene.target_particles is not None:
        return False
    return bool(scene.line.separation(np.concatenate(([0.0], velocities))) < 0.0)


def _restitution_of(change: _Change, velocities: Array) -> float:
    """Return the restitution from the velocities, if the scene is the one with the mistake."""
    line = change.scene.line
    speed = line.separation(np.concatenate((np.zeros(line.first), velocities)))
    return (speed / change.velocity) ** 2


def _changes(scene: Scene) -> Iterator[_Change]:
    """Yield common mistakes, each with the scene that an integrator then solves."""
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
