r"""
Two harmonic bodies in their modes, and the gap between them as a sum over these.

A mode is kept as the velocity :math:`p_j` and the strain-like amplitude
:math:`e_j = \omega_j q_j`, with :math:`q_j = \sum_i a_{ij} \sqrt{m_i} u_i`, so that its motion is a
rotation and a long wave of large amplitude takes no digits from a short one. Everything is counted
from the contact outward, so that a target is its own mirror image, and a rigid wall is a body
without modes. With :math:`c_j` what each mode has of it, the gap follows

.. math:: \dot g = \sum_j c_j p_j, \quad \ddot g = -\sum_j c_j \omega_j e_j, \quad
          g^{(m + 2)} = \sum_j c_j (-\omega_j^2) \dots

and its Taylor series is exact over a window that its rest decides, see ``mode_loops``.
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

# Shapes of unequal masses are matrices, and finding them takes n^3: 0.7 s for 300, 12 s for 1000.
MOST_UNEQUAL = 600


class BodyModes:
    r"""
    Modes j = 1..n-1 of a free body; equal masses by cosine and sine transforms.

    Masses go from the contact outward. `omega` are the frequencies, `contact` is
    :math:`c_j = a_{1j}/\sqrt{m_1}`: the displacement of the particle that meets the other body is
    that of the centre of mass and :math:`\sum_j c_j q_j`. Both are of shape (n - 1,).
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
        # Of one thing in two ways, that which loses fewer digits: m_1 du_1/dt is the first tension.
        by_strain = -self._root * self._modes.strains[0] / (first * self.omega)
        by_particle = self._modes.particles[0] / first**0.5
        sharper = self.omega * first**0.5 > self._root
        self.contact = np.where(sharper, by_strain, by_particle)

    def strain_amplitudes(self, strains: Array) -> Array:
        """Return e_j of strains, both of shape (n - 1,)."""
        if self._modes is None:
            return -self._root * _sine_transform(strains)
        return self._root * (strains @ self._modes.strains)

    def velocity_amplitudes(self, velocities: Array) -> Array:
        """Return p_j, of shape (n - 1,), of velocities of shape (n,)."""
        # The translation is in no mode: without it, a body at rest in itself is exactly so.
        about = velocities - velocities[0]
        if self._modes is None:
            from scipy.fft import dct

            return self.masses[0] ** 0.5 * dct(about, type=2, norm="ortho")[1:]
        return (np.sqrt(self.masses) * about) @ self._modes.particles

    def strains(self, amplitudes: Array) -> Array:
        """Return strains of e_j, both of shape (..., n - 1)."""
        if self._modes is None:
            return -_sine_transform(amplitudes) / self._root
        return (amplitudes @ self._modes.strains.T) / self._root

    def velocities(self, amplitudes: Array) -> Array:
        """Return the velocities about the centre of mass, of shape (n,), of p_j."""
        if self._modes is None:
            from scipy.fft import idct

            moving = np.concatenate(([0.0], amplitudes))
            return idct(moving, type=2, norm="ortho") / self.masses[0] ** 0.5
        return (self._modes.particles @ amplitudes) / np.sqrt(self.masses)


def body_modes(masses: Array, stiffness: float) -> BodyModes:
    """Return the modes of a body, not to be changed; those of the last few are kept."""
    return _kept(masses.tobytes(), stiffness)


@lru_cache(maxsize=4)
def _kept(masses: bytes, stiffness: float) -> BodyModes:
    return BodyModes(np.frombuffer(masses), stiffness)


def _sine_transform(values: Array) -> Array:
    from scipy.fft import dst

    # A transform of nothing is none.
    return dst(values, type=1, norm="ortho") if values.shape[-1] else values


@dataclass
class ModalGap:
    """The gap between two bodies in their modes, of which the first is the translation."""

    strain_modes: Array  #: e_j = omega_j q_j; of shape (n,).
    velocity_modes: Array  #: p_j; of shape (n,).
    omega: Array  #: Frequencies; of shape (n,).
    shape: Array  #: What each mode has of the gap; of shape (n,).
    wall_distance: float = 0.0  #: The gap; before a wall the x of particle 1.

    @property
    def modes(self) -> Modes:
        """The modes as loops take them, to be changed in place."""
        return self.strain_modes, self.velocity_modes, self.omega, self.shape

    @property
    def gap_derivatives(self) -> float:
        """V, with which the centres of mass move apart."""
        return float(self.shape[0] * self.velocity_modes[0])

    @property
    def mean_distance(self) -> float:
        """D, the distance of the mean displacements."""
        vibration = self.shape[1:] @ (self.strain_modes[1:] / self.omega[1:])
        return self.wall_distance - float(vibration)

    def copy(self) -> Self:
        """Return a motion in the same state that goes on independently."""
        return replace(
            self, strain_modes=self.strain_modes.copy(), velocity_modes=self.velocity_modes.copy()
        )

    def drifted(self, duration: float) -> Self:
        """Return a copy in the state after a free flight; contacts are not looked for."""
        later = self.copy()
        mode_loops().rotate(later.modes, duration)
        # x moves by the integral of its velocity; 1 - cos is taken without cancellation.
        vibrating, omega = slice(1, None), self.omega[1:]
        swing = self.velocity_modes[vibrating] * np.sin(omega * duration)
        swing -= 2.0 * self.strain_modes[vibrating] * np.sin(0.5 * omega * duration) ** 2
        later.wall_distance += float(self.shape[0] * self.velocity_modes[0] * duration)
        later.wall_distance += float(self.shape[vibrating] @ (swing / omega))
        return later


class ModalBodies:
    """Both bodies in their modes: the chain's come first, after the translation."""

    def __init__(self, line: Line, stiffness: float) -> None:
        self.line = line
        self.chain = body_modes(line.chain_masses, stiffness)
        self.target: BodyModes | None = None
        if not line.rigid:
            self.target = body_modes(line.target_masses, stiffness)
        self._split = len(line.chain_masses)  # where the target's modes begin

    def at_start(self) -> ModalGap:
        """Return the gap at the start."""
        line, chain = self.line, self.chain
        strains = [chain.strain_amplitudes(line.strains[line.first :])]
        speeds = [chain.velocity_amplitudes(line.velocities[line.first :])]
        if self.target is not None:
            # From the contact outward it goes towards -x: seen in a mirror, it is a chain.
            strains.append(self.target.strain_amplitudes(line.strains[: line.gap][::-1]))
            speeds.append(self.target.velocity_amplitudes(-line.velocities[: line.first][::-1]))
        # Of the relative motion of the centres of mass the mass is the reduced one.
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
        """Return the strains of the chain and of a target, of e_j (..., modes)."""
        chain = self.chain.strains(amplitudes[..., 1 : self._split])
        if self.target is None:
            return chain, np.empty(0)
        return chain, self.target.strains(amplitudes[..., self._split :])

    def velocities(self, amplitudes: Array) -> tuple[Array, Array]:
        """Return the same of velocities about the centres of mass, each outward, of p_j."""
        chain = self.chain.velocities(amplitudes[1 : self._split])
        if self.target is None:
            return chain, np.zeros(1)
        return chain, self.target.velocities(amplitudes[self._split :])
