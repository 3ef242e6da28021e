r"""
What proves the end of a chain before a wall within a compiled loop.

With all energy that is not in the motion of its centre of mass the chain cannot stretch back to the
wall (``ending``). How far it can is worked out beforehand, for a ladder of energies.
"""

import math
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.piece_bounds import ENERGY_LADDER, Lever, reach
from chaincor.workflows.engines.whole_end import ENERGY_MARGIN

# Bounds are worked out down to this part of the largest energy.
_LEAST_ENERGY = 1e-4


class EndBounds(NamedTuple):
    """What proves an end."""

    masses: Array  #: Of the chain; none where ends are not proved in the loop; of shape (n,).
    lever: float  #: :math:`m_1 M/(M - m_1)` of particle 1 and the chain.
    #: Logarithm of the smallest energy of the ladder, and of the ratio of its rungs.
    log_least: float
    log_rung: float  #: See ``log_least``.
    #: How far particle 1 can be from where the mean has it, with that energy; of shape (rungs,).
    reaches: Array
    interval: float  #: Time that sound takes over a bond.

    @classmethod
    def none(cls) -> "EndBounds":
        """Return what proves nothing."""
        return cls(np.empty(0), 0.0, 0.0, 1.0, np.empty(0), 0.0)

    @staticmethod
    def rung_above(bond: Potential, energy: float) -> int:
        """Return the rung of the ladder of energies that is above one."""
        return math.ceil(math.log(1.1 * energy / bond.stiffness) / ENERGY_LADDER)

    @classmethod
    def of(cls, line: Line, bond: Potential, top: int) -> "EndBounds":
        """Return what proves ends of chains of energies up to a rung."""
        masses, lever = line.chain_masses, Lever.of(line.chain_masses)
        count = math.ceil(-math.log(_LEAST_ENERGY) / ENERGY_LADDER)
        energies = bond.stiffness * np.exp(np.arange(top - count, top + 1) * ENERGY_LADDER)
        return cls(
            masses=masses,
            lever=lever.whole * lever.mass / lever.rest if lever.rest > 0.0 else 0.0,
            log_least=math.log(float(energies[0])),
            log_rung=ENERGY_LADDER,
            reaches=np.array([reach(bond, float(energy), lever) for energy in energies]),
            interval=(line.mean_mass / bond.stiffness) ** 0.5,
        )


def is_over(
    distance: float, strain: Array, velocity: Array, energy: float, bounds: EndBounds
) -> bool:
    """
    Return whether the chain can never come back to the wall.

    Parameters
    ----------
    distance : float
        Of particle 1 from the wall.
    strain : ndarray of shape (n - 1,)
        Bond lengths less one.
    velocity : ndarray of shape (n,)
        Positive away from the wall.
    energy : float
        All energy of the chain.
    bounds : EndBounds
        What proves it.
    """
    masses = bounds.masses
    whole = 0.0
    momentum = 0.0
    place = distance
    moment = 0.0
    for i in range(masses.shape[0]):
        if i > 0:
            place += strain[i - 1]
        whole += masses[i]
        momentum += masses[i] * velocity[i]
        moment += masses[i] * place
    speed = momentum / whole
    if not speed > 0.0:
        return False
    free = energy * (1.0 + ENERGY_MARGIN) - 0.5 * whole * speed * speed
    # For particle 1 to meet the wall it must move against the mean.
    free -= 0.5 * speed * speed * bounds.lever
    if free <= 0.0:
        return True
    rung = int(np.ceil((np.log(free) - bounds.log_least) / bounds.log_rung))
    if rung >= bounds.reaches.shape[0]:
        return False
    return moment / whole > bounds.reaches[max(rung, 0)]
