"""Make the `Line` of particles from a scene's masses, target, contact and initial state."""

import hashlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.scene_parts.scene_fields import BODY_KEYS
from chaincor.lammps_inputs.thermal_state import DEFAULT_SEED, draw

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene

# Longer lists of masses are identified by a hash.
_LONGEST_LIST = 64


def chain_masses(scene: "Scene") -> Array:
    """Return the masses of the chain's particles, of shape (n,), from the contact outward."""
    state = scene.initial_state
    if state is not None and state.masses is not None:
        return state.masses
    if scene.masses is None and scene.diameters is not None:
        return np.resize(np.array(scene.diameters) ** 3, scene.particles)
    return np.resize(np.array(scene.masses or (1.0,)), scene.particles)


def line_of(scene: "Scene") -> Line:
    """Return both bodies of a scene in their initial state."""
    masses, target = chain_masses(scene), np.array([math.inf])
    if scene.target_particles is not None:
        target = np.resize(np.array(scene.target_masses or (1.0,)), scene.target_particles)[::-1]
    state = scene.initial_state
    gap, strains = 0.0, np.full(scene.particles - 1, -(scene.compression or 0.0))
    velocities = np.full(scene.particles, -scene.impact_velocity)
    if state is not None:
        gap, strains = state.gap, state.strains
        velocities = velocities if state.velocities is None else state.velocities
    free = target if scene.target_particles is not None else np.zeros(0)
    target_strains, target_velocities = np.zeros(len(target) - 1), np.zeros(len(target))
    if scene.temperature is not None:
        drawn = draw(scene.bond, scene.temperature, masses, free[::-1], [seed_of(scene)])
        gap, strains = float(drawn.gaps[0]), drawn.strains[0]
        velocities = drawn.velocities[0] - scene.impact_velocity
        if len(free):
            target_strains = drawn.target_strains[0, ::-1]
            target_velocities = drawn.target_velocities[0, ::-1]
    diameters, contact = None, scene.contact_law
    if scene.diameters is not None:
        diameters = np.resize(np.array(scene.diameters), scene.particles)
        contact = contact.between_spheres(float(diameters[0]))
    return Line(
        masses=np.concatenate((target, masses)),
        first=len(target),
        strains=np.concatenate((target_strains, [gap], strains)),
        velocities=np.concatenate((target_velocities, velocities)),
        contact=contact,
        diameters=diameters,
    )


def seed_of(scene: "Scene") -> int:
    """Return the seed of the random initial state of a warm scene."""
    return DEFAULT_SEED if scene.seed is None else scene.seed


def given_bodies(scene: "Scene") -> dict[str, Any]:
    """Return the given fields of the bodies, with paths as text."""
    given = {key: getattr(scene, key) for key in BODY_KEYS}
    if scene.contact is None and scene.contact_law.soft:  # the contact law of the beads
        given |= {"contact": scene.contact_law.name, **scene.contact_law.as_keys()}
    return {k: str(v) if isinstance(v, Path) else v for k, v in given.items() if v is not None}


def body_fields(scene: "Scene") -> dict[str, Any]:
    """Return canonical fields of the bodies, as JSON; equal bodies have equal fields."""
    line = scene.line
    if line.is_standard:
        return {}
    fields: dict[str, Any] = {"masses": _period(line.chain_masses)}
    if line.diameters is not None:
        fields["diameters"] = _period(line.diameters)
    if not line.rigid:
        fields |= {"target_particles": line.first, "target_masses": _period(line.target_masses)}
    if line.soft:
        fields["contact"] = line.contact.identity
    if scene.initial is not None:
        # Hash the state, not the file: equal states can be written differently, and the file may
        # have changed after it was read.
        state = np.concatenate((line.strains[line.gap :], line.velocities[line.first :]))
        fields["initial"] = _digest(state)
    elif scene.compression:
        fields["compression"] = scene.compression
    elif scene.temperature is not None:
        fields |= {"temperature": scene.temperature, "seed": seed_of(scene)}
    return fields


def _period(masses: Array) -> list[float] | str:
    """Return the shortest list whose repetition gives the masses, or a hash of a long list."""
    for period in range(1, min(len(masses), _LONGEST_LIST) + 1):
        if np.array_equal(masses[period:], masses[:-period]):
            return [float(mass) for mass in masses[:period]]
    return _digest(masses)


def _digest(values: Array) -> str:
    return hashlib.sha256(values.astype("<f8").tobytes()).hexdigest()
