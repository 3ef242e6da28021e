r"""
Two harmonic bodies in their modes, and the gap between them as a sum over these.

A mode is kept as the velocity :math:`p_j` and the strain-like amplitude
:math:`e_j = \omega_j q_j`, so that its motion is a rotation and a long wave of large amplitude
takes no digits from a short one. With :math:`c_j` what each mode has of it, the gap follows

.. math:: \dot g = \sum_j c_j p_j, \quad \ddot g = -\sum_j c_j \omega_j e_j, \quad
          g^{(m + 2)} = \sum_j c_j (-\omega_j^2) \dots

and its Taylor series is exact over a window that its rest decides, see ``mode_loops``. A rigid wall
is a body without modes.
"""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.in_house.body_modes import BodyModes, body_modes


@dataclass
class ModalGap:
    """The gap between two bodies in their modes, of which the first is the translation."""

    #: e_j = omega_j q_j and p_j; of shape (n,).
    strain_modes: Array
    velocity_modes: Array  #: See ``strain_modes``.
    #: Frequencies, and what each mode has of the gap; of shape (n,).
    omega: Array
    shape: Array  #: See ``omega``.
    wall_distance: float = 0.0  #: The gap; before a wall the x of particle 1.

    def copy(self) -> Self:
        """Return a motion in the same state that goes on independently."""
        return replace(
            self, strain_modes=self.strain_modes.copy(), velocity_modes=self.velocity_modes.copy()
        )

    def drifted(self, duration: float) -> Self:
        """Return a copy in the state after a free flight; contacts are not looked for."""
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


class ModalBodies:
    """Both bodies in their modes: the chain's come first, after the translation."""

    def __init__(self, line: Line, stiffness: float) -> None:
        self.line = line
        self.chain = body_modes(line.chain_masses, stiffness)
        self.target: BodyModes | None = None
        if not line.rigid:
            self.target = body_modes(line.target_masses, stiffness)
        self._split = len(line.chain_masses)

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

    def chain_part(self, amplitudes: Array) -> Array:
        """Return the chain's of all amplitudes (..., modes)."""
        return amplitudes[..., 1 : self._split]

    def target_part(self, amplitudes: Array) -> Array:
        """Return the target's."""
        return amplitudes[..., self._split :]


def opening_velocity(gap: ModalGap) -> float:
    """Return V, with which the centres of mass move apart."""
    return float(gap.shape[0] * gap.velocity_modes[0])


def mean_distance(gap: ModalGap) -> float:
    """Return D, the distance of the mean displacements."""
    vibration = gap.shape[1:] @ (gap.strain_modes[1:] / gap.omega[1:])
    return gap.wall_distance - float(vibration)
