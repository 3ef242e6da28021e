"""What a collision knows of its bodies: places at rest, energies, and what comes next."""

from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.chain_data import initial_state
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.in_house.follow import Flight, follow
from chaincor.workflows.engines.pieces import count_fragments

# So much more is waited than bodies can take to meet.
_LATEST = 1.1


class Bodies:
    """
    Both bodies of a scene: the chain's particles come first, then those of a free target.

    Parameters
    ----------
    scene : Scene
        The collision.

    Attributes
    ----------
    rest : ndarray of shape (n + M,)
        Where the particles are at rest, in the order in which LAMMPS has them.
    only_meets : bool
        Whether there is one contact, because neither body has parts.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, self.line = scene, scene.line
        n, targets = scene.particles, self.line.targets
        self.rest = np.concatenate((np.arange(n, dtype=float), -np.arange(targets, dtype=float)))
        self.only_meets = n == 1 and targets <= 1
        # LAMMPS's places of the particles along the line.
        self._along = np.concatenate((np.arange(n + targets)[: n - 1 : -1], np.arange(n)))

    def _velocities_along(self, velocities: Array) -> Array:
        along = velocities[self._along]
        return np.concatenate(([0.0], along)) if self.line.rigid else along

    def _strains_along(self, displacements: Array) -> Array:
        """Return the strains of all bonds, and the gap: the two that meet rest at one place."""
        along = displacements[self._along]
        return np.diff(np.concatenate(([0.0], along)) if self.line.rigid else along)

    def apart(self, velocities: Array) -> bool:
        """Return whether the centres of mass recede from each other."""
        return self.line.separation(self._velocities_along(velocities)) > 0.0

    def energy_start(self) -> float:
        """Return the energy at the start, that of strained bonds included."""
        return self.line.energy(self.scene.bond, self.line.strains, self.line.velocities)

    def energy(self, displacements: Array, velocities: Array) -> float:
        """Return the energy of a state in which the bodies do not overlap."""
        strains = self._strains_along(displacements)
        return self.line.energy(self.scene.bond, strains, self._velocities_along(velocities))

    def fragments(self, displacements: Array, velocities: Array) -> int:
        """Return how many pieces the chain has."""
        n = self.scene.particles
        strains, masses = np.diff(displacements[:n]), self.line.chain_masses
        return count_fragments(strains, velocities[:n], self.scene.bond, masses)

    def follow(self, displacements: Array, velocities: Array, **times: float) -> Flight:
        """Ask the in-house integrator what comes next."""
        strains = self._strains_along(displacements)
        return follow(self.scene, strains, self._velocities_along(velocities), **times)

    def split(self, displacements: Array, velocities: Array) -> dict[str, Any]:
        """Return a state as an :class:`Outcome` has it, or a moment of :class:`Frames`."""
        n = self.scene.particles
        return {
            "displacements": displacements[:n],
            "velocities": velocities[:n],
            "target_displacements": displacements[n:],
            "target_velocities": velocities[n:],
        }


def approach_time(scene: Scene) -> float:
    """
    Return how long the bodies take to meet at most; 0 where they start at their first contact.

    They meet before their centres of mass could, which come together with v0.
    """
    n, masses = scene.particles, scene.line.chain_masses
    positions, velocities = initial_state(scene.line)
    if positions[0] == 0.0 and velocities[0] < 0.0:
        return 0.0
    way = float(masses @ positions[:n]) / float(np.sum(masses))
    if scene.line.targets:
        # Of one particle, whose surface is where it is met: no way at all, but for rounding.
        targets = scene.line.target_masses
        way += 1.0 - float(targets @ positions[n:]) / float(np.sum(targets))
    return _LATEST * way / scene.impact_velocity
