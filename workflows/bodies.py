"""What a result says of both bodies, where there is more than a cold chain and a hard wall."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from chaincor.analysis.modes import mode_energies
from chaincor.analysis.restitution import centre_of_mass_velocity, energy_split
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene_parts.given_bodies import (
    DEFAULT_CONTACT_EXPONENT,
    DEFAULT_CONTACT_STIFFNESS,
    plain_bodies,
    seed_of,
)

if TYPE_CHECKING:
    from chaincor.lammps_inputs.line import Line
    from chaincor.lammps_inputs.scene import Scene
    from chaincor.workflows.engines.outcome import Outcome


TARGET_ARRAYS = ("target_mode_energies", "target_velocities", "target_displacements")


@dataclass(frozen=True, kw_only=True)
class Bodies:
    r"""
    What is said of both bodies; None throughout for a cold chain of unit masses and a hard wall.

    Velocities are along x, as the chain's: positive away from the target, so that a target that is
    knocked away moves with a negative one. Energies are those after the collision.

    Attributes
    ----------
    masses : tuple of float or None
        Of the chain's particles from the contact outward, as they were given, repeated along the
        chain; None where all are 1.
    target_particles : int or None
        Of a free target; None for the wall.
    target_masses : tuple of float or None
        Its masses, from the contact outward, likewise.
    contact : str or None
        ``power`` where the bodies are soft.
    contact_stiffness, contact_exponent : float or None
        K and q of their repulsion :math:`K d^q`.
    initial : str or None
        File of the state that the chain came with.
    compression : float or None
        By which part its bonds were shorter at first.
    temperature : float or None
        k_B T of both bodies at first.
    seed : int or None
        Of what was drawn.
    velocity_after, target_velocity_after : float or None
        Of the centres of mass.
    translational_energy, target_translational_energy : float or None
        :math:`M V^2/2` of each body.
    vibrational_energy, target_vibrational_energy : float or None
        All other energy of each body.
    target_mode_energies : ndarray of shape (M,) or None
        As `mode_energies`, of the target.
    target_velocities, target_displacements : ndarray of shape (M,) or None
        Its final state from the contact outward; particle k is at :math:`1 - k + u_k`.
    """

    masses: tuple[float, ...] | None = None
    target_particles: int | None = None
    target_masses: tuple[float, ...] | None = None
    contact: str | None = None
    contact_stiffness: float | None = None
    contact_exponent: float | None = None
    initial: str | None = None
    compression: float | None = None
    temperature: float | None = None
    seed: int | None = None
    velocity_after: float | None = None
    target_velocity_after: float | None = None
    translational_energy: float | None = None
    vibrational_energy: float | None = None
    target_translational_energy: float | None = None
    target_vibrational_energy: float | None = None
    target_mode_energies: Array | None = None
    target_velocities: Array | None = None
    target_displacements: Array | None = None


BODY_FIELDS = tuple(f.name for f in fields(Bodies))


def bodies_after(scene: "Scene", outcome: "Outcome") -> dict[str, Any]:
    """Return the fields of :class:`Bodies` that a collision has; none for a plain scene."""
    line = scene.line
    if line.plain:
        return {}
    k = scene.bond.stiffness
    chain = energy_split(
        outcome.displacements, outcome.velocities, scene.bond, masses=line.chain_masses
    )
    found: dict[str, Any] = _as_given(scene) | {
        "velocity_after": float(centre_of_mass_velocity(outcome.velocities, line.chain_masses)),
        "translational_energy": float(chain.translation),
        "vibrational_energy": float(chain.vibration),
    }
    if line.rigid:
        return found
    masses, velocities = line.target_masses, outcome.target_velocities
    # From the contact outward a target goes towards -x: seen in a mirror, it is a chain.
    target = energy_split(-outcome.target_displacements, -velocities, scene.bond, masses=masses)
    return found | {
        "target_velocity_after": float(centre_of_mass_velocity(velocities, masses)),
        "target_translational_energy": float(target.translation),
        "target_vibrational_energy": float(target.vibration),
        "target_velocities": velocities,
        "target_displacements": outcome.target_displacements,
        "target_mode_energies": mode_energies(outcome.target_displacements, velocities, k, masses),
    }


def _as_given(scene: "Scene") -> dict[str, Any]:
    given, state = plain_bodies(scene), scene.initial_state
    if state is not None and state.masses is not None:
        given["masses"] = tuple(state.masses.tolist())
    if scene.temperature is not None:
        given["seed"] = seed_of(scene)
    if scene.contact == "power":
        given.setdefault("contact_stiffness", DEFAULT_CONTACT_STIFFNESS)
        given.setdefault("contact_exponent", DEFAULT_CONTACT_EXPONENT)
    else:
        given.pop("contact", None)
    return given


def impulse_residual(line: "Line", outcome: "Outcome", impact_velocity: float) -> float:
    """
    Return how far the momenta of both bodies are from what the contacts gave, in units of M v0.

    Each contact gives the chain its impulse and the target the opposite one, whatever the bonds do.
    The larger of both residuals; of the chain alone before a wall, which takes any momentum.
    """
    given = float(np.sum(outcome.impulses))
    mass = float(np.sum(line.chain_masses))
    change = float(line.chain_masses @ outcome.velocities) + mass * impact_velocity
    residuals = [abs(change - given)]
    if not line.rigid:
        residuals.append(abs(float(line.target_masses @ outcome.target_velocities) + given))
    return max(residuals) / (mass * impact_velocity)
