r"""
Bounds on one piece of a chain: how far its end particle gets, and how likely it is thrown out.

Inside a piece, the end particle is displaced from where the mean has it by
:math:`D = \sum_i w_i s_i`, in which :math:`w_i` is the part of the mass beyond bond i; with equal
masses :math:`w_i = i/m`. With :math:`\kappa` the smallest
:math:`2 U/s^2` that bonds of energy I or less can have, Cauchy and Schwarz give
:math:`D^2 \le 2 I \sum_i w_i^2/\kappa`, and where U is convex, Jensen
:math:`U(D/W) \le I w_{m-1}/W` with the largest of them, :math:`w_{m-1}`, and
:math:`W = \sum_i w_i`. A piece whose energy suffices to break
a bond is bounded otherwise: what lies farther out than the displacement that costs 0.9 of a broken
bond has only the rest of the energy to move with.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential

# Energy of a broken bond that is taken as paid once an end particle is far out.
PAID = 0.9
# Vibrations a particle with which risks are reckoned.
VIBRATIONS = 100.0
# Of an escape for which there is energy.
_LEAST_RISK = 1e-300
# Bounds are worked out for energies on a ladder of this ratio, and kept.
ENERGY_LADDER = math.log(1.03)


def breaking_energy(bond: Potential) -> float:
    """Return the energy that a bond cannot hold, of dissociation or its barrier; inf for none."""
    return min(bond.dissociation, bond.barrier)


class Lever(NamedTuple):
    """How the bonds of a piece move one of its end particles against its mean."""

    particles: int  #: Of the piece.
    #: Sum of the weights w_i, and of their squares.
    total: float
    squares: float  #: See ``total``.
    largest: float  #: The largest of them.
    #: Of the end particle, and of the piece.
    mass: float
    whole: float  #: See ``mass``.

    @classmethod
    def of(cls, masses: NDArray[np.float64]) -> "Lever":
        """Return that of the first particle of a piece with these masses."""
        whole = float(np.sum(masses))
        weights = np.cumsum(masses[:0:-1]) / whole
        largest = float(np.max(weights, initial=0.0))
        total, squares = float(np.sum(weights)), float(weights @ weights)
        return cls(len(masses), total, squares, largest, float(masses[0]), whole)

    @property
    def rest(self) -> float:
        """Mass of all but the end particle."""
        return self.whole - self.mass


def reach(bond: Potential, energy: float, lever: Lever) -> float:
    """
    Return how far an end particle can get from where the mean of its piece has it.

    `energy` is all that the bonds can have; inf where it suffices to break one.
    """
    if lever.particles == 1 or energy <= 0.0:
        return 0.0
    if energy >= breaking_energy(bond):
        return math.inf
    longest, softest = _extent(bond, _on_ladder(bond, energy))
    total = lever.total
    far = total * longest
    if softest > 0.0:
        far = min(far, math.sqrt(2.0 * energy * lever.squares / softest))
    if longest <= bond.convex_strain:
        mean = energy * lever.largest / total
        far = min(far, total * _extent(bond, _on_ladder(bond, mean))[0])
    return far


def _on_ladder(bond: Potential, energy: float) -> float:
    """Return an energy that is a little higher, one of few; never one that breaks the bond."""
    rung = math.ceil(math.log(energy / bond.stiffness) / ENERGY_LADDER)
    higher = bond.stiffness * math.exp(rung * ENERGY_LADDER)
    return higher if higher < breaking_energy(bond) else energy


@lru_cache(maxsize=8192)
def _extent(bond: Potential, energy: float) -> tuple[float, float]:
    """Return the longest strain of bonds that hold an energy at most, and the least 2 U/s^2."""
    lowest, longest = bond.strain_range(energy)
    strains = np.linspace(lowest, longest, 66)
    strains = strains[strains != 0.0]
    with np.errstate(divide="ignore"):  # a bond compressed to nothing
        softest = 2.0 * float(np.min(bond.energy(strains) / strains**2))
    return longest, min(bond.stiffness, softest)


def escape_risk(
    bond: Potential, energy: float, lever: Lever, speed: float, patience: float
) -> float:
    r"""
    Estimate how likely a piece is to throw its end particle out with a speed.

    The energy that takes is :math:`E^* = U(\infty) + \frac12 u^2 \frac{m_1 M}{M - m_1}` with the
    masses :math:`m_1` of the particle and M of the piece. Less than that is a proof. More is judged
    as unimolecular decay is: of m - 1 vibrations that share the energy I freely, one has E* or more
    with the probability :math:`(1 - E^*/I)^{m-2}`, at each vibration; and a piece that decays at
    all does so with that much in :math:`((I - E^*)/(I - U(\infty)))^{m-2}` of the cases, and cools.
    Over a barrier, beyond which a bond gains energy without bound, :math:`E^*` is the barrier
    alone, whatever the speed. Where nothing binds, nothing needs to gather: particles hand their
    velocities on.

    `energy` is the internal one; `speed` is relative to the mean of the piece, and no escape is
    possible with less than none; `patience` is how many vibrations are reckoned with.
    """
    if lever.particles == 1:
        return 0.0
    if speed <= 0.0:
        return 1.0
    breaking = breaking_energy(bond)
    needed = breaking
    if math.isinf(bond.barrier):
        needed += 0.5 * speed * speed * lever.whole / lever.rest * lever.mass
    if energy < needed:
        return 0.0
    if breaking == 0.0:
        return 1.0
    freedoms = lever.particles - 2
    decays = math.exp(freedoms * math.log1p(-needed / energy)) if energy > needed else 0.0
    part = (energy - needed) / (energy - breaking)
    times = energy / breaking
    # What is only unlikely is never taken for impossible, however long the piece.
    return min(1.0, max(_LEAST_RISK, min(patience * decays, times * part**freedoms)))
