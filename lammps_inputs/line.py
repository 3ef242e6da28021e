r"""
A chain and its target, as one row of particles with a contact.

All particles are arranged along x, from the far end of the target to the far end of the chain.
Neighbours have bonds, except at the contact, where there is a gap. A rigid wall is a target of one
particle with infinite mass. The motion uses only its inverse mass, 0. Initial strains, velocities
and the gap are data of the line.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.lammps_inputs.contacts.hard import HARD

# Masses with a smaller relative difference are assumed to amplify errors like equal masses. In the
# few scenes that were examined, 0.01 was small enough. The scenes are too few for a general
# statement, and a smaller number was chosen.
_ALIKE = 1e-6
# Cached properties that lines of a cold chain at different velocities share.
_WITHOUT_SPEED = (
    *("unit", "at_wall", "is_standard", "has_equal_masses", "rigid", "inverse_masses"),
    *("contact_mass", "chain_mass", "reduced_mass", "lightest", "mean_mass", "heaviest_pair"),
)


@dataclass(frozen=True, eq=False)
class Line:
    r"""Particles of both bodies of a collision, along x."""

    #: Masses along x, of shape (N,): the target from its far end to the contact, then the chain. A
    #: rigid wall has the mass inf.
    masses: Array
    first: int  #: Index of particle 1 of the chain, which is the number of particles of the target.
    #: Initial bond lengths minus 1, of shape (N - 1,). The item ``first - 1`` is the gap, which is
    #: not negative.
    strains: Array
    #: Initial velocities along x, negative for an approaching chain, of shape (N,).
    velocities: Array
    contact: ContactLaw = HARD  #: Contact law of the bodies.
    diameters: Array | None = (
        None  #: Diameters of a column's beads, of shape (n,); None for diameters of 1.
    )

    @cached_property
    def pair_stiffness(self) -> Array:
        """
        Factors of the bond forces, of shape (N - 1,): sqrt(4 R_eff) in Hertz's law.

        The factor is 1 for beads of diameter 1. The factor of the gap is 1, because the contact law
        contains sqrt(4 R_eff).
        """
        found = np.ones(len(self.masses) - 1)
        if self.diameters is not None:
            near, far = self.diameters[:-1], self.diameters[1:]
            found[self.first :] = np.sqrt(2.0 * near * far / (near + far))
        return found

    @property
    def soft(self) -> bool:
        """Whether the bodies overlap in a contact."""
        return self.contact.soft

    @cached_property
    def cold(self) -> bool:
        """Whether the chain starts at the contact, with equal velocities and without strains."""
        still = not np.any(self.strains) and not np.any(self.velocities[: self.first])
        chain = self.velocities[self.first :]
        return still and bool(np.all(chain == chain[0]))

    @cached_property
    def unit(self) -> bool:
        """Whether all masses of the chain are 1."""
        return bool(np.all(self.chain_masses == 1.0))

    @cached_property
    def at_wall(self) -> bool:
        """Whether the chain hits a hard, rigid wall."""
        return self.rigid and not self.soft

    @cached_property
    def is_standard(self) -> bool:
        """Whether a cold chain of unit masses hits a hard, rigid wall."""
        return self.at_wall and self.cold and self.unit and self.diameters is None

    @cached_property
    def has_equal_masses(self) -> bool:
        """
        Whether a cold chain of nearly equal masses hits a hard, rigid wall.

        Other collisions amplify errors due to the time step and to rounding more: those with light
        particles between heavy ones, with free targets, or with chains that vibrate before the
        impact.
        """
        masses = self.chain_masses
        alike = bool(np.ptp(masses) <= _ALIKE * np.min(masses))
        return self.at_wall and self.cold and alike

    @cached_property
    def rigid(self) -> bool:
        """Whether the target is a rigid wall."""
        return bool(np.isinf(self.masses[0]))

    @property
    def gap(self) -> int:
        """Index of the gap among the strains."""
        return self.first - 1

    @property
    def targets(self) -> int:
        """Number of particles of the target; 0 for the wall."""
        return 0 if self.rigid else self.first

    @cached_property
    def largest_speed(self) -> float:
        """Largest speed of a particle at the start."""
        return float(np.max(np.abs(self.velocities)))

    @cached_property
    def inverse_masses(self) -> Array:
        """Inverse masses along x."""
        return 1.0 / self.masses

    @property
    def chain_masses(self) -> Array:
        """Masses of the chain, from the contact outward."""
        return self.masses[self.first :]

    @property
    def target_masses(self) -> Array:
        """Masses of the target, from the contact outward; empty for the wall."""
        return self.masses[: self.targets][::-1]

    @cached_property
    def contact_mass(self) -> float:
        """Reduced mass of the two particles at the contact."""
        return float(1.0 / (self.inverse_masses[self.gap] + self.inverse_masses[self.first]))

    @cached_property
    def chain_mass(self) -> float:
        """Total mass of the chain."""
        return float(np.sum(self.chain_masses))

    @cached_property
    def reduced_mass(self) -> float:
        """Reduced mass of the two bodies."""
        if self.rigid:
            return self.chain_mass
        return 1.0 / (1.0 / self.chain_mass + 1.0 / float(np.sum(self.target_masses)))

    @cached_property
    def lightest(self) -> float:
        """Mass of the lightest particle with a bond or a soft contact."""
        return float(np.min(self._bonded()))

    @cached_property
    def mean_mass(self) -> float:
        """Mean particle mass m of the body with the slower sound, of speed sqrt(k/m)."""
        bodies = [self.chain_masses] + ([self.target_masses] if self.targets > 1 else [])
        return max(float(np.mean(masses)) for masses in bodies)

    @cached_property
    def heaviest_pair(self) -> float:
        """Largest reduced mass of two bonded particles; 0 without bonds."""
        inverse = self.inverse_masses[1:] + self.inverse_masses[:-1]
        return float(np.max(1.0 / np.delete(inverse, self.gap), initial=0.0))

    def _bonded(self) -> Array:
        whole = self.soft or self.targets > 1
        masses = self.masses if whole and not self.rigid else self.chain_masses
        if len(self.chain_masses) == 1 and not self.soft and self.targets > 1:
            masses = self.target_masses
        return masses

    def at_velocity(self, velocity: float) -> "Line":
        """Return the line with a chain whose particles all have another velocity."""
        velocities = self.velocities.copy()
        velocities[self.first :] = -velocity
        if not self.cold:
            return replace(self, velocities=velocities)
        for name in _WITHOUT_SPEED:
            getattr(self, name)  # computed once for all velocities
        other = object.__new__(Line)
        # Only one cached property of a cold chain depends on the velocities: the largest speed.
        vars(other).update(vars(self), velocities=velocities)
        vars(other).pop("largest_speed", None)
        return other

    def overlap(self, speed: float) -> float:
        """Return the overlap of the two particles at the contact for a relative speed."""
        return self.contact.overlap(0.5 * self.contact_mass * speed**2)

    @property
    def contact_rate(self) -> float:
        """Stiffness/mass in a contact of soft bodies with the relative speed 2 v0."""
        v0 = float(np.max(np.abs(self.velocities)))
        return self.contact.rate(0.5 * self.contact_mass * (2.0 * v0) ** 2, self.contact_mass)

    def energy(self, bond: Potential, strains: Array, velocities: Array) -> float:
        """
        Return the kinetic energy of both bodies plus the energy of bonds and overlap.

        Strains, including the gap, have the shape (N - 1,), and velocities the shape (N,).
        """
        masses = np.where(np.isinf(self.masses), 0.0, self.masses)
        with np.errstate(over="ignore", invalid="ignore"):
            energy = 0.5 * float(masses @ velocities**2)
            energies = bond.energy(np.delete(strains, self.gap))
            if self.diameters is not None:
                energies = energies * np.delete(self.pair_stiffness, self.gap)
            energy += float(np.sum(energies))
        return energy + self.contact.energy(max(-float(strains[self.gap]), 0.0))

    def separation(self, velocities: Array) -> float:
        """Return the velocity between the centres of mass of chain and target, along x."""
        chain = self.chain_masses
        # The last bit of a product by `@` depends on the memory address of an array.
        speed = float(np.sum(chain * velocities[self.first :]) / np.sum(chain))
        if not self.rigid:
            target = self.masses[: self.first]
            speed -= float(np.sum(target * velocities[: self.first]) / np.sum(target))
        return speed
