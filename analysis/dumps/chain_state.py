"""A chain at one moment, and the free target that it hits."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from chaincor.lammps_inputs.arrays import Array


@dataclass(frozen=True)
class ChainState:
    """The chain at one moment, and the free target that it hits, if there is one."""

    step: int  #: LAMMPS timestep number.
    time: float  #: Simulated time; its origin is that of the dump.
    #: u_i = x_i - (i - 1), particle 1 nearest the wall at x = 0; of shape (n,).
    displacements: Array
    velocities: Array  #: Positive away from the wall; of shape (n,).
    #: The same of a free target, from the contact outward: particle k is at 1 - k + u_k. Empty for
    #: a wall; of shape (M,).
    target_displacements: Array = field(default_factory=lambda: np.empty(0))
    #: See ``target_displacements``.
    target_velocities: Array = field(default_factory=lambda: np.empty(0))

    @property
    def gap(self) -> float:
        """How far particle 1 is from the wall, or from the target's particle that it meets."""
        target = self.target_displacements
        return float(self.displacements[0] - target[0] if target.size else self.displacements[0])

    @property
    def opening(self) -> float:
        """How fast that grows."""
        target = self.target_velocities
        return float(self.velocities[0] - target[0] if target.size else self.velocities[0])

    @property
    def bodies(self) -> "list[ChainState]":
        """The chain, and a free target in a mirror, in which it is a chain too."""
        motions = [(self.displacements, self.velocities)]
        if self.target_velocities.size:
            motions.append((-self.target_displacements, -self.target_velocities))
        return [ChainState(self.step, self.time, *motion) for motion in motions]

    def separation(self, masses: Sequence[Array]) -> float:
        """Return how fast the centres of mass of bodies of these masses move apart."""
        return float(
            sum(
                np.sum(m * body.velocities) / np.sum(m)
                for body, m in zip(self.bodies, masses, strict=True)
            )
        )

    @property
    def all_displacements(self) -> Array:
        """Of the chain, then of the target, of shape (n + M,)."""
        return np.concatenate((self.displacements, self.target_displacements))

    @property
    def all_velocities(self) -> Array:
        """Of the chain, then of the target, of shape (n + M,)."""
        return np.concatenate((self.velocities, self.target_velocities))

    @property
    def all_positions(self) -> Array:
        """Of the chain, then of the target, of shape (n + M,), along x."""
        rest = np.arange(self.displacements.size), -np.arange(self.target_displacements.size)
        return self.all_displacements + np.concatenate(rest)

    @property
    def all_bonds(self) -> list[tuple[int, int]]:
        """Pairs of neighbours, counted from 0; none between the bodies."""
        n, both = self.displacements.size, self.displacements.size + self.target_displacements.size
        return [(i, i + 1) for i in range(both - 1) if i != n - 1]

    def after_contact(self, masses: Sequence[Array]) -> "ChainState":
        """Return the state on the other side of a contact of a chain and a target."""
        velocities, target = self.velocities.copy(), self.target_velocities.copy()
        push = 2.0 * self.opening / (1.0 / masses[0][0] + 1.0 / masses[1][0])
        velocities[0] -= push / masses[0][0]
        target[0] += push / masses[1][0]
        return replace(self, velocities=velocities, target_velocities=target)

    def turned_round(self, speed: float) -> "ChainState":
        """Return the state right after a contact with a wall at a speed."""
        velocities = self.velocities.copy()
        velocities[0] = speed
        return replace(self, velocities=velocities)
