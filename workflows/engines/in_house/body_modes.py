r"""
The modes of one free harmonic body, and what each has of the particle that meets the other body.

Everything is counted from the contact outward, so that a target is its own mirror image. A mode is
kept as in ``mode_flight``: the velocity :math:`p_j` and the strain-like :math:`e_j = \omega_j q_j`,
with :math:`q_j = \sum_i a_{ij} \sqrt{m_i} u_i`.
"""

from functools import lru_cache

import numpy as np

from chaincor.analysis.modes import are_equal, free_modes, mode_frequencies
from chaincor.lammps_inputs.arrays import Array

# Shapes of unequal masses are matrices, and finding them takes n^3: 0.7 s for 300, 12 s for 1000.
MOST_UNEQUAL = 600


class BodyModes:
    r"""
    Modes j = 1..n-1 of a free body; equal masses by cosine and sine transforms.

    Parameters
    ----------
    masses : ndarray of shape (n,)
        From the contact outward.
    stiffness : float
        U''(1).

    Attributes
    ----------
    omega : ndarray of shape (n - 1,)
        Frequencies.
    contact : ndarray of shape (n - 1,)
        :math:`c_j = a_{1j}/\sqrt{m_1}`: the displacement of particle 1 is that of the centre of
        mass and :math:`\sum_j c_j q_j`.
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
    """
    Return the modes of a body, not to be changed; those of the last few are kept.

    `masses`, of shape (n,), go from the contact outward; `stiffness` is U''(1).
    """
    return _kept(masses.tobytes(), stiffness)


@lru_cache(maxsize=4)
def _kept(masses: bytes, stiffness: float) -> BodyModes:
    return BodyModes(np.frombuffer(masses), stiffness)


def _sine_transform(values: Array) -> Array:
    from scipy.fft import dst

    # A transform of nothing is none.
    return dst(values, type=1, norm="ortho") if values.shape[-1] else values
