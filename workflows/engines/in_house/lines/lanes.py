r"""
Steps of many chains side by side, one in each lane of the processor's vector units.

A chain of ten is too short for them: its loops begin and end more than they run. Here chains of one
step H lie interleaved, number i of lane k at :math:`i L + k`, and loops run over all of them; the
motion is that of ``line_stages`` before a rigid wall, away from contacts.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house.stages import State
from chaincor.workflows.engines.schemes import Mixture, Splitting

Array = NDArray[np.float64]

# L: a few vectors of any processor, so that no lane is left over, which would be rounded otherwise.
LANES = 16


class Lanes(NamedTuple):
    """
    What the chains side by side are, and room to move them.

    Attributes
    ----------
    old, new, trial : State
        Strains and velocities, of shape (n L,) and ((n + 1) L,); the gaps and the wall come first.
    forces : ndarray of shape (n L,)
        Scratch; 0 for the gaps.
    weights : ndarray of shape ((n + 1) L,)
        Inverse masses.
    """

    old: State
    new: State
    trial: State
    forces: Array
    weights: Array

    @classmethod
    def of(cls, inverse: Array) -> "Lanes":
        """Return room for chains of these inverse masses, that of the wall first."""
        bonds = (len(inverse) - 1) * LANES
        old, new, trial = (State(np.zeros(bonds), np.zeros(bonds + LANES)) for _ in range(3))
        return cls(old, new, trial, np.zeros(bonds), np.repeat(inverse, LANES))

    def unnamed(self) -> tuple:
        """Return plain tuples, as compiled functions take them sooner."""
        return *(tuple(state) for state in self[:3]), *self[3:]


def build_lane_leap(force: Callable, split: bool, register: Callable) -> Callable:
    """
    Return one step of all lanes.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain, ``force(strain, parameters)``; known to the compiler.
    split : bool
        Whether steps are split; else they are extrapolated.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``leap(old, new, trial, forces, weights, step, fractions, bond)``: from old strains and
        velocities to new ones.
    """

    @register
    def stage(
        strain: Array,
        velocity: Array,
        forces: Array,
        weights: Array,
        drift: float,
        kick: float,
        bond: Any,
    ) -> None:
        bonds = strain.shape[0]
        for j in range(bonds):
            strain[j] += drift * (velocity[j + LANES] - velocity[j])
        # The gaps, which come first, have none.
        for j in range(LANES, bonds):
            forces[j] = force(strain[j], bond)
        for j in range(LANES, bonds):
            velocity[j] += kick * weights[j] * (forces[j - LANES] - forces[j])
        for j in range(bonds, bonds + LANES):
            velocity[j] += kick * weights[j] * forces[j - LANES]

    @register
    def drift(strain: Array, velocity: Array, time: float) -> None:
        for j in range(strain.shape[0]):
            strain[j] += time * (velocity[j + LANES] - velocity[j])

    @register
    def copy(old: Array, new: Array) -> None:
        for j in range(old.shape[0]):
            new[j] = old[j]

    def leap_split(
        old: State,
        new: State,
        _trial: State,
        forces: Array,
        weights: Array,
        step: float,
        fractions: Splitting,
        bond: Any,
    ) -> None:
        parts, kicks = fractions
        strain, velocity = new
        copy(old[0], strain)
        copy(old[1], velocity)
        for k in range(kicks.shape[0]):
            stage(strain, velocity, forces, weights, parts[k] * step, kicks[k] * step, bond)
        drift(strain, velocity, parts[-1] * step)

    def leap_extrapolated(
        old: State,
        new: State,
        trial: State,
        forces: Array,
        weights: Array,
        step: float,
        fractions: Mixture,
        bond: Any,
    ) -> None:
        shares, counts = fractions
        first_strain, first_velocity = old
        new_strain, new_velocity = new
        strain, velocity = trial
        copy(first_strain, new_strain)
        copy(first_velocity, new_velocity)
        for row in range(shares.shape[0]):
            share, count = shares[row], int(counts[row])
            short = step / count
            copy(first_strain, strain)
            copy(first_velocity, velocity)
            stage(strain, velocity, forces, weights, 0.5 * short, short, bond)
            for _ in range(count - 1):
                stage(strain, velocity, forces, weights, short, short, bond)
            drift(strain, velocity, 0.5 * short)
            # Mixed are differences, whose shares sum to 1.
            for j in range(strain.shape[0]):
                new_strain[j] += share * (strain[j] - first_strain[j])
            for j in range(velocity.shape[0]):
                new_velocity[j] += share * (velocity[j] - first_velocity[j])

    return leap_split if split else leap_extrapolated
