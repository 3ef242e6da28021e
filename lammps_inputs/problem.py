"""Problem: the physics of one collision, as engines and error estimates use it."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.chain_data import initial_state
from chaincor.lammps_inputs.line import Line

# Factor on the longest time of approach, as a reserve.
_LATEST = 1.1


@dataclass(frozen=True, eq=False)
class Problem:
    """
    Bodies of one collision, with their bonds, contact law and initial state.

    A scene is the description by a user; a problem contains what a solver needs. Units are the
    natural bond length, the particle mass and the bond stiffness.
    """

    bond: Potential  #: Potential of the bonds.
    line: Line  #: Both bodies along x, with their masses, contact law and initial state.
    #: v0 > 0; the chain's centre of mass arrives with the velocity -v0.
    impact_velocity: float
    label: str  #: Name of the potential in output.
    #: Whether the bond is built from keys of a scene. Only such bonds can be keys of a cache.
    named: bool = True
    temperature: float | None = (
        None  #: k_B T of a random initial state; None for a cold initial state.
    )
    comes_moving: bool = False  #: Whether particles have individual initial velocities.

    @classmethod
    def of_cold_chain(cls, bond: Potential, particles: int, velocity: float) -> "Problem":
        """Return a cold chain of unit masses that hits a hard, rigid wall."""
        line = Line(
            masses=np.concatenate(([np.inf], np.ones(particles))),
            first=1,
            strains=np.concatenate(([0.0], np.full(particles - 1, -0.0))),
            velocities=np.concatenate(([0.0], np.full(particles, -velocity))),
        )
        return cls(bond, line, velocity, bond.name, named=False)

    def at_velocity(self, velocity: float) -> "Problem":
        """Return the problem of a cold chain at another impact velocity."""
        return replace(self, line=self.line.at_velocity(velocity), impact_velocity=velocity)

    @property
    def particles(self) -> int:
        """Number of particles of the chain."""
        return len(self.line.masses) - self.line.first

    @property
    def all_particles(self) -> int:
        """Number of particles of both bodies."""
        return self.particles + self.line.targets

    @property
    def longest_body(self) -> int:
        """Number of particles in the longer body."""
        return max(self.particles, self.line.targets)

    @cached_property
    def fast_stiffness(self) -> float:
        """U''(1) divided by the smallest mass: the squared frequency of the fastest bond."""
        return self.bond.scale_stiffness(self.impact_velocity**2) / self.line.lightest

    @cached_property
    def slow_stiffness(self) -> float:
        """U''(1) divided by the mean mass in the slower body: the squared speed of its sound."""
        return self.bond.sound_stiffness(self.impact_velocity**2) / self.line.mean_mass

    @property
    def contact_duration(self) -> float:
        """Approximate duration of an overlap at the impact speed; 0 for hard contacts."""
        if not self.line.soft:
            return 0.0
        return 3.0 * self.line.overlap(self.impact_velocity) / self.impact_velocity

    @property
    def energy_ratio(self) -> float:
        """
        Ratio of the initial energy of two bodies to their relative translational energy.

        The ratio is 1 for a cold chain. In a vibrating chain, the rounded velocities exceed the
        velocity of the centre of mass by the square root of this ratio. Such a chain may leave
        faster than it arrived.
        """
        if self.line.cold:
            return 1.0
        translation = 0.5 * self.line.chain_mass * self.impact_velocity**2
        return max(self.start_energy / translation, 1.0)

    @property
    def is_smooth(self) -> bool:
        """Whether schemes keep their order, because neither bonds nor contact have kinks."""
        return self.bond.smooth and self.line.contact.smooth

    @cached_property
    def approach_time(self) -> float:
        """
        Upper bound on the time to the first contact; 0 if the bodies start in contact.

        The centres of mass approach each other with the velocity v0. The bodies touch before their
        centres of mass would coincide.
        """
        n = self.particles
        positions, velocities = initial_state(self.line)
        if positions[0] == 0.0 and velocities[0] < 0.0:
            return 0.0
        way = float(self.line.chain_masses @ positions[:n]) / self.line.chain_mass
        if self.line.targets:
            # For a single particle this distance is zero, apart from rounding.
            targets = self.line.target_masses
            way += 1.0 - float(targets @ positions[n:]) / float(np.sum(targets))
        return _LATEST * way / self.impact_velocity

    @cached_property
    def start_energy(self) -> float:
        """Total initial energy of the bodies: kinetic energy and energy of strained bonds."""
        return self.line.energy(self.bond, self.line.strains, self.line.velocities)
