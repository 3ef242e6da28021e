r"""
Bound the reach of the end particle of a fragment, and estimate the risk of its ejection.

Bond strains :math:`s_i` displace the end particle of a fragment, relative to the mean of the
fragment, by :math:`D = \sum_i w_i s_i`. Here :math:`w_i` is the share of the mass beyond bond i;
for m equal masses it is :math:`w_i = i/m`. Let :math:`\kappa` be the smallest :math:`2 U/s^2` of
all bonds whose energy is at most I. The Cauchy-Schwarz inequality gives :math:`D^2 \le 2 I \sum_i
w_i^2/\kappa`. If U is convex, Jensen's inequality gives :math:`U(D/W) \le I w_{m-1}/W`, where
:math:`w_{m-1}` is the largest weight and :math:`W = \sum_i w_i`. If a fragment has enough energy to
break a bond, its displacement has no bound, but its speed has: beyond the displacement that takes
0.9 of the breaking energy, only the rest of the energy is left for motion.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential

# An end particle that exceeds a certain displacement has spent this fraction of the breaking
# energy; only the rest of the energy is left for its motion.
PAID = 0.9
# Estimates of risk assume that each particle vibrates this number of times.
VIBRATIONS = 100.0
# The estimated risk of an escape is at least this large if the energy suffices for the escape.
_LEAST_RISK = 1e-300
# Bounds are computed and cached for a geometric sequence of energies. This constant is the
# logarithm of the ratio between neighbouring energies.
ENERGY_LADDER = math.log(1.03)


def breaking_energy(bond: Potential) -> float:
    """Return the energy that breaks a bond, by dissociation or over a barrier; inf if none does."""
    return min(bond.dissociation, bond.barrier)


class Lever(NamedTuple):
    """Weights w_i with which the bond strains of a fragment displace an end particle."""

    particles: int  #: Number of particles of the fragment.
    #: Sum of the weights w_i.
    total: float
    squares: float  #: Sum of the squares of the weights.
    largest: float  #: Largest weight.
    #: Mass of the end particle.
    mass: float
    whole: float  #: Mass of the fragment.

    @classmethod
    def of(cls, masses: NDArray[np.float64]) -> "Lever":
        """Return the lever of the first particle of a fragment with these masses."""
        whole = float(np.sum(masses))
        weights = np.cumsum(masses[:0:-1]) / whole
        largest = float(np.max(weights, initial=0.0))
        total, squares = float(np.sum(weights)), float(weights @ weights)
        return cls(len(masses), total, squares, largest, float(masses[0]), whole)

    @property
    def rest(self) -> float:
        """Mass of the fragment without its end particle."""
        return self.whole - self.mass


@lru_cache(maxsize=1024)
def equal_lever(particles: int) -> Lever:
    """Return the lever of the first particle of a fragment with masses of 1."""
    return Lever.of(np.ones(particles))


def reach(bond: Potential, energy: float, lever: Lever) -> float:
    """
    Return the largest difference between the displacements of an end particle and of the mean.

    `energy` bounds the total energy of the bonds. The distance is inf if this energy suffices to
    break a bond.
    """
    if lever.particles == 1 or energy <= 0.0:
        return 0.0
    breaking = breaking_energy(bond)
    if energy >= breaking:
        return math.inf
    longest, softest = _extent(bond, _on_ladder(bond, energy, breaking))
    total = lever.total
    far = total * longest
    if softest > 0.0:
        far = min(far, math.sqrt(2.0 * energy * lever.squares / softest))
    if longest <= bond.convex_strain:
        mean = energy * lever.largest / total
        far = min(far, total * _extent(bond, _on_ladder(bond, mean, breaking))[0])
    return far


def _on_ladder(bond: Potential, energy: float, breaking: float) -> float:
    """Return the next higher energy of the sequence, or `energy` if that would be `breaking`."""
    rung = math.ceil(math.log(energy / bond.stiffness) / ENERGY_LADDER)
    higher = bond.stiffness * math.exp(rung * ENERGY_LADDER)
    return higher if higher < breaking else energy


@lru_cache(maxsize=8192)
def _extent(bond: Potential, energy: float) -> tuple[float, float]:
    """Return the largest strain and the least 2 U/s^2 of bonds with at most this energy."""
    lowest, longest = bond.strain_range(energy)
    strains = np.linspace(lowest, longest, 66)
    strains = strains[strains != 0.0]
    with np.errstate(divide="ignore"):  # the energy at zero length may be infinite
        softest = 2.0 * float(np.min(bond.energy(strains) / strains**2))
    return longest, min(bond.stiffness, softest)


def escape_risk(
    bond: Potential, energy: float, lever: Lever, speed: float, patience: float
) -> float:
    r"""
    Return the estimated probability that a fragment ejects its end particle at a speed u.

    An ejection needs the energy :math:`E^* = U(\infty) + \frac12 u^2 \frac{m_1 M}{M - m_1}` with
    the masses :math:`m_1` of the particle and M of the fragment. With less energy, an ejection is
    impossible. With more energy, the estimate follows the theory of unimolecular decay. The m - 1
    vibrations share the energy I freely; during each period, one vibration has the energy
    :math:`E^*` or more with the probability :math:`(1 - E^*/I)^{m-2}`. A fragment that decays
    ejects its particle with this energy in :math:`((I - E^*)/(I - U(\infty)))^{m-2}` of the cases,
    and cools. If a bond has a barrier, beyond which it releases energy without bound, :math:`E^*`
    is the height of the barrier at any speed. If no bond binds the particles, no energy needs to
    gather, because the particles pass their velocities on.

    `energy` is the internal energy I. `speed` is u, relative to the mean velocity of the fragment;
    the result is 1 if u is zero or less. `patience` is the number of vibrations.
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
    # In a long fragment, the estimate may underflow to zero. Zero would mean that an escape is
    # impossible.
    return min(1.0, max(_LEAST_RISK, min(patience * decays, times * part**freedoms)))
