r"""
Harmonic bodies in their modes, and their flight from contact to contact.

A mode is kept as the velocity :math:`p_j` and the strain-like amplitude
:math:`e_j = \omega_j q_j`, so that its motion is a rotation and a long wave of large amplitude
takes no digits from a short one. Particle 1, with :math:`c_j` the shapes at its place, follows

.. math:: \dot x = \sum_j c_j p_j, \quad \ddot x = -\sum_j c_j \omega_j e_j, \quad
          x^{(m + 2)} = \sum_j c_j (-\omega_j^2) \dots

and its Taylor series over one time unit is exact: with :math:`\omega \le 2` and energy E the rest
after m terms is below :math:`2^{m - 1} \sqrt{2 E} / m!`, which at m = 26 is 8e-20 times the root.
"""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.interrupts import steps_at_once

# How long the Taylor series of ``mode_loops`` holds.
WINDOW = 1.0

# The 26 terms of a series and the rotation of a mode, in bond forces.
_WINDOW_WORK = 60

Array = NDArray[np.float64]


def strains_of(strain_modes: Array) -> Array:
    """
    Return the bond strains of modes.

    Parameters
    ----------
    strain_modes : ndarray of shape (..., n)
        e_j = omega_j q_j.

    Returns
    -------
    ndarray of shape (..., n - 1)
        s_i, minus the orthonormal DST-I of e_j.
    """
    from scipy.fft import dst

    return -dst(strain_modes[..., 1:], type=1, norm="ortho")


@dataclass
class ModalGap:
    """
    The gap between two bodies in their modes, of which the first is the translation.

    Attributes
    ----------
    strain_modes, velocity_modes : ndarray of shape (n,)
        e_j = omega_j q_j and p_j.
    omega, shape : ndarray of shape (n,)
        Frequencies, and what each mode has of the gap.
    wall_distance : float
        The gap; before a wall the x of particle 1.
    """

    strain_modes: Array
    velocity_modes: Array
    omega: Array
    shape: Array
    wall_distance: float = 0.0

    def copy(self) -> Self:
        """
        Return a motion that goes on independently.

        Returns
        -------
        ModalGap
            In the same state.
        """
        return replace(
            self, strain_modes=self.strain_modes.copy(), velocity_modes=self.velocity_modes.copy()
        )

    def drifted(self, duration: float) -> Self:
        """
        Return the state after a free flight.

        Parameters
        ----------
        duration : float
            How long; contacts are not looked for.

        Returns
        -------
        ModalGap
            A copy.
        """
        from chaincor.workflows.engines.in_house.loops.mode_loops import rotate

        later = self.copy()
        rotate(later.strain_modes, later.velocity_modes, self.omega, duration)
        # x moves by the integral of its velocity; 1 - cos is taken without cancellation.
        vibrating, omega = slice(1, None), self.omega[1:]
        swing = self.velocity_modes[vibrating] * np.sin(omega * duration)
        swing -= 2.0 * self.strain_modes[vibrating] * np.sin(0.5 * omega * duration) ** 2
        later.wall_distance += float(self.shape[0] * self.velocity_modes[0] * duration)
        later.wall_distance += float(self.shape[vibrating] @ (swing / omega))
        return later


class ModalChain(ModalGap):
    """A free harmonic chain of unit masses in its modes, before a wall."""

    @classmethod
    def at_first_contact(cls, particles: int, speed: float) -> "ModalChain":
        """
        Return the chain right after its first contact.

        Parameters
        ----------
        particles : int
            Particles n.
        speed : float
            v0; all particles have -v0 but the first, which is reflected.

        Returns
        -------
        ModalChain
            With no strain.
        """
        angle = 0.5 * math.pi * np.arange(particles) / particles
        shape = math.sqrt(2.0 / particles) * np.cos(angle)
        shape[0] = math.sqrt(1.0 / particles)
        velocity_modes = 2.0 * speed * shape
        velocity_modes[0] -= speed * math.sqrt(particles)
        return cls(np.zeros(particles), velocity_modes, 2.0 * np.sin(angle), shape)

    @property
    def momentum(self) -> float:
        """Momentum of the chain."""
        return float(self.velocity_modes[0]) * math.sqrt(len(self.omega))

    def strains(self) -> Array:
        """
        Return the bond strains.

        Returns
        -------
        ndarray of shape (n - 1,)
            s_i, minus the orthonormal DST-I of e_j.
        """
        return strains_of(self.strain_modes)

    def velocities(self) -> Array:
        """
        Return the particle velocities.

        Returns
        -------
        ndarray of shape (n,)
            v_i, the inverse DCT-II of p_j.
        """
        from scipy.fft import idct

        return idct(self.velocity_modes, type=2, norm="ortho")

    def fly(self, longest: float) -> tuple[float, float | None]:
        """
        Fly freely to the next contact, or for a given time.

        Parameters
        ----------
        longest : float
            When to stop looking; up to one time unit more is flown.

        Returns
        -------
        flown : float
            Time flown.
        incoming : float or None
            Speed of particle 1 into the wall, not yet reflected; None where there is no contact.
        """
        from chaincor.workflows.engines.in_house.loops.mode_loops import fly

        flown, velocity = 0.0, 1.0
        # A window takes as long as so many bond forces for every mode.
        at_once = WINDOW * steps_at_once(_WINDOW_WORK * len(self.omega))
        while True:
            flown, self.wall_distance, velocity = fly(
                self.strain_modes,
                self.velocity_modes,
                self.omega,
                self.shape,
                self.wall_distance,
                WINDOW,
                flown,
                min(longest, flown + at_once),
            )
            if velocity <= 0.0:
                return flown, -velocity
            if flown >= longest:
                return flown, None

    def reflect(self, incoming: float) -> None:
        """
        Reverse the velocity of particle 1.

        Parameters
        ----------
        incoming : float
            Its speed into the wall.
        """
        self.velocity_modes += 2.0 * incoming * self.shape
