r"""
Two bodies on a line: a chain, and the target it hits, which is one line with a contact in it.

All particles stand along x, from the far end of the target to the far end of the chain, neighbours
joined by bonds, but for one gap: there lies the contact. The rigid wall is a target of one particle
with infinite mass, whose inverse, 0, is all that the motion needs. What both bodies come with
(strains, velocities, the gap) is data.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.lammps_inputs.contacts.hard import HARD

# Masses that differ by no more than this part amplify errors as equal ones do. A choice: by a
# hundredth would do in the few scenes that were judged, too few to promise it.
_ALIKE = 1e-6


@dataclass(frozen=True, eq=False)
class Line:
    r"""All particles of a collision, along x."""

    #: Along x: the target from its far end to the contact, then the chain; inf for a rigid wall; of
    #: shape (N,).
    masses: Array
    first: int  #: Where particle 1 of the chain stands: the number of particles of the target.
    #: At the start: bond lengths less one; at ``first - 1`` the gap, which is not negative; of
    #: shape (N - 1,).
    strains: Array
    velocities: Array  #: At the start, along x: the chain comes with negative ones; of shape (N,).
    contact: ContactLaw = HARD  #: How the bodies repel each other.

    @property
    def soft(self) -> bool:
        """Whether the bodies overlap when they meet."""
        return self.contact.soft

    @cached_property
    def cold(self) -> bool:
        """Whether the chain comes from the contact on at one speed, with no strained bond."""
        still = not np.any(self.strains) and not np.any(self.velocities[: self.first])
        chain = self.velocities[self.first :]
        return still and bool(np.all(chain == chain[0]))

    @cached_property
    def unit(self) -> bool:
        """Whether all masses of the chain are 1."""
        return bool(np.all(self.chain_masses == 1.0))

    @cached_property
    def at_wall(self) -> bool:
        """Whether the chain hits a hard, rigid wall: a place, and no particle."""
        return self.rigid and not self.soft

    @cached_property
    def is_standard(self) -> bool:
        """Whether this is a cold chain of unit masses before a hard, rigid wall."""
        return self.at_wall and self.cold and self.unit

    @cached_property
    def has_equal_masses(self) -> bool:
        """
        Whether this is a cold chain of masses that are alike, before a hard, rigid wall.

        Light particles between heavy ones, two bodies and chains that come vibrating amplify the
        errors of steps and roundings more.
        """
        masses = self.chain_masses
        alike = bool(np.ptp(masses) <= _ALIKE * np.min(masses))
        return self.at_wall and self.cold and alike

    @property
    def rigid(self) -> bool:
        """Whether the target is the wall."""
        return bool(np.isinf(self.masses[0]))

    @property
    def gap(self) -> int:
        """Where among the strains the gap is."""
        return self.first - 1

    @property
    def targets(self) -> int:
        """Particles of the target; 0 for the wall."""
        return 0 if self.rigid else self.first

    @cached_property
    def inverse_masses(self) -> Array:
        """1/m along x."""
        return 1.0 / self.masses

    @property
    def chain_masses(self) -> Array:
        """Of the chain, from the contact outward."""
        return self.masses[self.first :]

    @property
    def target_masses(self) -> Array:
        """Of the target, from the contact outward; empty for the wall."""
        return self.masses[: self.targets][::-1]

    @cached_property
    def contact_mass(self) -> float:
        """Reduced mass of the two particles that meet."""
        return float(1.0 / (self.inverse_masses[self.gap] + self.inverse_masses[self.first]))

    @cached_property
    def reduced_mass(self) -> float:
        """Of the two bodies."""
        chain = float(np.sum(self.chain_masses))
        if self.rigid:
            return chain
        return 1.0 / (1.0 / chain + 1.0 / float(np.sum(self.target_masses)))

    @cached_property
    def lightest(self) -> float:
        """Mass of the lightest particle that has a bond, or meets a soft body."""
        return float(np.min(self._bonded()))

    @cached_property
    def mean_mass(self) -> float:
        """Mean mass of a particle of the slower body: sound crosses that at sqrt(k/m)."""
        bodies = [self.chain_masses] + ([self.target_masses] if self.targets > 1 else [])
        return max(float(np.mean(masses)) for masses in bodies)

    @cached_property
    def heaviest_pair(self) -> float:
        """The largest reduced mass of two particles with a bond between them; 0 without bonds."""
        inverse = self.inverse_masses[1:] + self.inverse_masses[:-1]
        return float(np.max(1.0 / np.delete(inverse, self.gap), initial=0.0))

    def _bonded(self) -> Array:
        whole = self.soft or self.targets > 1
        masses = self.masses if whole and not self.rigid else self.chain_masses
        if len(self.chain_masses) == 1 and not self.soft and self.targets > 1:
            masses = self.target_masses
        return masses

    def overlap(self, speed: float) -> float:
        """Return how far the two particles at the contact overlap if they meet at a speed."""
        return self.contact.overlap(0.5 * self.contact_mass * speed**2)

    @property
    def contact_rate(self) -> float:
        """Stiffness over mass of the contact of soft bodies, where two particles meet at 2 v0."""
        v0 = float(np.max(np.abs(self.velocities)))
        return self.contact.rate(0.5 * self.contact_mass * (2.0 * v0) ** 2, self.contact_mass)

    def energy(self, bond: Potential, strains: Array, velocities: Array) -> float:
        """
        Return the energy of both bodies along x: of motion, of the bonds, and of the overlap.

        Strains, with the gap, are of shape (N - 1,), velocities of shape (N,).
        """
        masses = np.where(np.isinf(self.masses), 0.0, self.masses)
        with np.errstate(over="ignore", invalid="ignore"):
            energy = 0.5 * float(masses @ velocities**2)
            energy += float(np.sum(bond.energy(np.delete(strains, self.gap))))
        return energy + self.contact.energy(max(-float(strains[self.gap]), 0.0))

    def separation(self, velocities: Array) -> float:
        """Return the velocity of the chain's centre of mass along x less that of the target's."""
        chain = self.chain_masses
        # Not by `@`, whose last bit depends on where an array lies.
        speed = float(np.sum(chain * velocities[self.first :]) / np.sum(chain))
        if not self.rigid:
            target = self.masses[: self.first]
            speed -= float(np.sum(target * velocities[: self.first]) / np.sum(target))
        return speed
