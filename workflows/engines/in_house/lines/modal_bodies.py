"""Both harmonic bodies in their modes, and the gap between them as a sum over these."""

import math

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.in_house.lines.body_modes import BodyModes, body_modes
from chaincor.workflows.engines.in_house.mode_flight import ModalGap

Array = NDArray[np.float64]


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
