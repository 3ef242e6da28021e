"""What a collision knows of its bodies: places at rest, energies, and what comes next."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.chain_data import initial_state
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.in_house.follow import Flight, follow
from chaincor.workflows.engines.pieces import count_fragments

# So much more is waited than bodies can take to meet.
_LATEST = 1.1

Array = NDArray[np.float64]


class Bodies:
    """
    The chain of a scene, of unit masses before the wall.

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
        self.scene = scene
        self.rest = np.arange(scene.particles, dtype=float)
        self.only_meets = scene.particles == 1

    def apart(self, velocities: Array) -> bool:
        """Return whether the bodies recede from each other, as wholes."""
        return float(velocities.sum()) > 0.0

    def energy_start(self) -> float:
        """Return the energy at the start."""
        return 0.5 * self.scene.particles * self.scene.impact_velocity**2

    def energy(self, displacements: Array, velocities: Array) -> float:
        """Return the energy of a state in which the bodies do not overlap."""
        strains = np.diff(displacements)
        return 0.5 * float(velocities @ velocities) + float(np.sum(self.scene.bond.energy(strains)))

    def fragments(self, displacements: Array, velocities: Array) -> int:
        """Return how many pieces the chain has."""
        return count_fragments(np.diff(displacements), velocities, self.scene.bond)

    def follow(self, displacements: Array, velocities: Array, **times: float) -> Flight:
        """Ask the in-house integrator what comes next, see :func:`follow`."""
        strains = np.diff(np.append(0.0, displacements))
        return follow(self.scene, strains, np.append(0.0, velocities), **times)

    def split(self, displacements: Array, velocities: Array) -> dict[str, Any]:
        """Return a state as an :class:`Outcome` has it, or a moment of :class:`Frames`."""
        return {"displacements": displacements, "velocities": velocities}


class LineBodies(Bodies):
    """
    Both bodies of a scene that has a line: the chain's particles come first, then the target's.

    Parameters
    ----------
    scene : Scene
        The collision.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self.line: Line = scene.line
        n, targets = scene.particles, self.line.targets
        self.rest = np.concatenate((self.rest, -np.arange(targets, dtype=float)))
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


def bodies_of(scene: Scene) -> Bodies:
    """Return what a collision knows of the bodies of a scene."""
    return Bodies(scene) if scene.line.plain else LineBodies(scene)


def approach_time(scene: Scene) -> float:
    """
    Return how long the bodies take to meet at most; 0 where they start at their first contact.

    They meet before their centres of mass could, which come together with v0.
    """
    if scene.line.plain:
        return 0.0
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
