r"""
Represent two harmonic bodies by their modes, and the gap as a sum over the modes.

A mode is stored as its velocity :math:`p_j` and its strain-like amplitude :math:`e_j = \omega_j
q_j`, with :math:`q_j = \sum_i a_{ij} \sqrt{m_i} u_i`. The motion of a mode is then a rotation, and
short waves keep all their digits beside long waves of large amplitude. All coordinates count
outward from the contact; a target is therefore described as its mirror image. A rigid wall is a
body without modes. If :math:`c_j` is the share of each mode in the gap, the gap follows

.. math:: \dot g = \sum_j c_j p_j, \quad \ddot g = -\sum_j c_j \omega_j e_j, \quad
          g^{(m + 2)} = \sum_j c_j (-\omega_j^2) \dots

The Taylor series of the gap is exact to rounding within a time window, which follows from the
remainder of the series, see ``mode_loops``.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Self

import numpy as np

from chaincor.analysis.modes import are_equal, free_modes, mode_frequencies
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.reference.mode_loops import Modes, mode_loops

# Largest number of unequal masses. The time to compute their mode shapes is proportional to n^3:
# 0.7 s for n = 300, 12 s for n = 1000.
MOST_UNEQUAL = 600


class BodyModes:
    r"""
    Modes j = 1..n-1 of a free body.

    Bodies of equal masses use cosine and sine transforms. `masses` are listed from the contact
    outward. `omega` contains the frequencies and `contact` the shares :math:`c_j =
    a_{1j}/\sqrt{m_1}`; both are of shape (n - 1,). The displacement of the particle at the contact
    is the displacement of the centre of mass plus :math:`\sum_j c_j q_j`.
    """

    def __init__(self, masses: Array, stiffness: float) -> None:
        self.masses = masses
        self._root = stiffness**0.5
        count, first = len(masses), float(masses[0])
        self._modes = None
        if are_equal(masses):
            self.omega = mode_frequencies(count, stiffness, masses)[1:]
            angle = 0.5 * np.pi * np.arange(1, count) / count
            self.contact = np.sqrt(2.0 / (count * first)) * np.cos(angle)
            return
        self._modes = free_modes(masses, stiffness)
        self.omega = self._modes.frequencies
        # There are two formulas for c_j; use the one that loses fewer digits. The formula by_strain
        # follows from the equation of motion of particle 1.
        by_strain = -self._root * self._modes.strains[0] / (first * self.omega)
        by_particle = self._modes.particles[0] / first**0.5
        sharper = self.omega * first**0.5 > self._root
        self.contact = np.where(sharper, by_strain, by_particle)

    def strain_amplitudes(self, strains: Array) -> Array:
        """Return the amplitudes e_j for strains; both arrays are of shape (n - 1,)."""
        if self._modes is None:
            return -self._root * _sine_transform(strains)
        return self._root * (strains @ self._modes.strains)

    def velocity_amplitudes(self, velocities: Array) -> Array:
        """Return the amplitudes p_j, of shape (n - 1,), for velocities of shape (n,)."""
        # No mode contains the translation. Subtracting the velocity of the first particle makes the
        # amplitudes of a body without vibration exactly zero.
        about = velocities - velocities[0]
        if self._modes is None:
            from scipy.fft import dct

            return self.masses[0] ** 0.5 * dct(about, type=2, norm="ortho")[1:]
        return (np.sqrt(self.masses) * about) @ self._modes.particles

    def strains(self, amplitudes: Array) -> Array:
        """Return the strains for amplitudes e_j; both arrays are of shape (..., n - 1)."""
        if self._modes is None:
            return -_sine_transform(amplitudes) / self._root
        return (amplitudes @ self._modes.strains.T) / self._root

    def velocities(self, amplitudes: Array) -> Array:
        """Return the velocities in the centre-of-mass frame, of shape (n,), for amplitudes p_j."""
        if self._modes is None:
            from scipy.fft import idct

            moving = np.concatenate(([0.0], amplitudes))
            return idct(moving, type=2, norm="ortho") / self.masses[0] ** 0.5
        return (self._modes.particles @ amplitudes) / np.sqrt(self.masses)


def body_modes(masses: Array, stiffness: float) -> BodyModes:
    """Return the modes of a body from a cache; the caller must not change them."""
    return _kept(masses.tobytes(), stiffness)


@lru_cache(maxsize=4)
def _kept(masses: bytes, stiffness: float) -> BodyModes:
    return BodyModes(np.frombuffer(masses), stiffness)


def _sine_transform(values: Array) -> Array:
    from scipy.fft import dst

    # SciPy refuses to transform an empty array.
    return dst(values, type=1, norm="ortho") if values.shape[-1] else values


@dataclass
class ModalGap:
    """Modes of two bodies and the gap between them; the first mode is the translation."""

    strain_modes: Array  #: Amplitudes e_j = omega_j q_j; of shape (n,).
    velocity_modes: Array  #: Amplitudes p_j; of shape (n,).
    omega: Array  #: Frequencies; of shape (n,).
    shape: Array  #: Share c_j of each mode in the gap; of shape (n,).
    distance: float = 0.0  #: Length of the gap; at a wall it is the x of particle 1.

    @property
    def modes(self) -> Modes:
        """Arrays of the modes; loops change these arrays in place."""
        return self.strain_modes, self.velocity_modes, self.omega, self.shape

    @property
    def mean_velocity(self) -> float:
        """Velocity V with which the centres of mass move apart."""
        return float(self.shape[0] * self.velocity_modes[0])

    @property
    def mean_distance(self) -> float:
        """Difference D between the mean displacements."""
        vibration = self.shape[1:] @ (self.strain_modes[1:] / self.omega[1:])
        return self.distance - float(vibration)

    def copy(self) -> Self:
        """Return an independent copy of the state."""
        return replace(
            self, strain_modes=self.strain_modes.copy(), velocity_modes=self.velocity_modes.copy()
        )

    def drifted(self, duration: float) -> Self:
        """Return a copy after a free flight; contacts are not searched for."""
        later = self.copy()
        mode_loops().rotate(later.modes, duration)
        # The gap changes by the integral of its velocity. The term 1 - cos is computed as 2 sin^2,
        # without cancellation.
        vibrating, omega = slice(1, None), self.omega[1:]
        swing = self.velocity_modes[vibrating] * np.sin(omega * duration)
        swing -= 2.0 * self.strain_modes[vibrating] * np.sin(0.5 * omega * duration) ** 2
        later.distance += float(self.shape[0] * self.velocity_modes[0] * duration)
        later.distance += float(self.shape[vibrating] @ (swing / omega))
        return later


class ModalBodies:
    """Modes of both bodies: first the translation, then the chain, then the target."""

    def __init__(self, line: Line, stiffness: float) -> None:
        self.line = line
        self.chain = body_modes(line.chain_masses, stiffness)
        self.target: BodyModes | None = None
        if not line.rigid:
            self.target = body_modes(line.target_masses, stiffness)
        self._split = len(line.chain_masses)  # index of the first mode of the target

    def at_start(self) -> ModalGap:
        """Return the modes and the gap at the start."""
        line, chain = self.line, self.chain
        strains = [chain.strain_amplitudes(line.strains[line.first :])]
        speeds = [chain.velocity_amplitudes(line.velocities[line.first :])]
        if self.target is not None:
            # The target extends from the contact towards -x; its mirror image is treated like a
            # chain.
            strains.append(self.target.strain_amplitudes(line.strains[: line.gap][::-1]))
            speeds.append(self.target.velocity_amplitudes(-line.velocities[: line.first][::-1]))
        # The mass of the relative motion of the centres of mass is the reduced mass.
        translation = 1.0 / math.sqrt(line.reduced_mass)
        approach = line.separation(line.velocities)
        bodies = [chain] + ([self.target] if self.target else [])
        shape = np.concatenate(([translation], *(body.contact for body in bodies)))
        return ModalGap(
            np.concatenate(([0.0], *strains)),
            np.concatenate(([approach / translation], *speeds)),
            np.concatenate(([0.0], *(body.omega for body in bodies))),
            shape,
            float(line.strains[line.gap]),
        )

    def strains(self, amplitudes: Array) -> tuple[Array, Array]:
        """Return the strains of chain and target for amplitudes e_j of shape (..., modes)."""
        chain = self.chain.strains(amplitudes[..., 1 : self._split])
        if self.target is None:
            return chain, np.empty(0)
        return chain, self.target.strains(amplitudes[..., self._split :])

    def velocities(self, amplitudes: Array) -> tuple[Array, Array]:
        """Return the outward velocities of both bodies in their centre-of-mass frames, for p_j."""
        chain = self.chain.velocities(amplitudes[1 : self._split])
        if self.target is None:
            return chain, np.zeros(1)
        return chain, self.target.velocities(amplitudes[self._split :])
