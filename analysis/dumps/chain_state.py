"""State of a chain at one time, and of the free target that it hits."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from chaincor.lammps_inputs.arrays import Array


@dataclass(frozen=True)
class ChainState:
    """State of a chain at one time, and of a free target if there is one."""

    step: int  #: LAMMPS timestep number.
    time: float  #: Simulated time, measured like the times in the dump.
    #: Displacements u_i = x_i - (i - 1), of shape (n,), with particle 1 nearest the wall at x = 0.
    displacements: Array
    velocities: Array  #: Velocities, positive away from the wall, of shape (n,).
    #: Displacements of a free target, of shape (M,), from the contact outward: particle k is at
    #: 1 - k + u_k. Empty for a wall.
    target_displacements: Array = field(default_factory=lambda: np.empty(0))
    #: Velocities of a free target along x, of shape (M,); empty for a wall.
    target_velocities: Array = field(default_factory=lambda: np.empty(0))

    @property
    def gap(self) -> float:
        """Distance of particle 1 from the wall, or from the target's particle at the contact."""
        target = self.target_displacements
        return float(self.displacements[0] - target[0] if target.size else self.displacements[0])

    @property
    def gap_velocity(self) -> float:
        """Rate at which the gap grows."""
        target = self.target_velocities
        return float(self.velocities[0] - target[0] if target.size else self.velocities[0])

    @property
    def bodies(self) -> "list[ChainState]":
        """States of the chain and of a free target, which is mirrored to look like a chain."""
        motions = [(self.displacements, self.velocities)]
        if self.target_velocities.size:
            motions.append((-self.target_displacements, -self.target_velocities))
        return [ChainState(self.step, self.time, *motion) for motion in motions]

    def separation(self, masses: Sequence[Array]) -> float:
        """Return the velocity at which the centres of mass of the bodies separate."""
        return float(
            sum(
                np.sum(m * body.velocities) / np.sum(m)
                for body, m in zip(self.bodies, masses, strict=True)
            )
        )

    @property
    def all_displacements(self) -> Array:
        """Displacements of the chain, then of the target, of shape (n + M,)."""
        return np.concatenate((self.displacements, self.target_displacements))

    @property
    def all_velocities(self) -> Array:
        """Velocities of the chain, then of the target, of shape (n + M,)."""
        return np.concatenate((self.velocities, self.target_velocities))

    @property
    def all_positions(self) -> Array:
        """Positions along x of the chain, then of the target, of shape (n + M,)."""
        rest = np.arange(self.displacements.size), -np.arange(self.target_displacements.size)
        return self.all_displacements + np.concatenate(rest)

    @property
    def all_bonds(self) -> list[tuple[int, int]]:
        """Pairs of bonded neighbours, counted from 0. No bond connects the two bodies."""
        n, both = self.displacements.size, self.displacements.size + self.target_displacements.size
        return [(i, i + 1) for i in range(both - 1) if i != n - 1]

    def after_contact(self, masses: Sequence[Array]) -> "ChainState":
        """Return the state after a contact between a chain and a target, or before it."""
        velocities, target = self.velocities.copy(), self.target_velocities.copy()
        push = 2.0 * self.gap_velocity / (1.0 / masses[0][0] + 1.0 / masses[1][0])
        velocities[0] -= push / masses[0][0]
        target[0] += push / masses[1][0]
        return replace(self, velocities=velocities, target_velocities=target)

    def turned_round(self, speed: float) -> "ChainState":
        """Return the state right after a contact with a wall at a given incoming speed."""
        velocities = self.velocities.copy()
        velocities[0] = speed
        return replace(self, velocities=velocities)
