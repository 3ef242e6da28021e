r"""
Bound the reach of the end particle of a fragment, and estimate the risk of its ejection.

Inside a fragment, the end particle is displaced from its place relative to the mean by :math:`D =
\sum_i w_i s_i`, where :math:`w_i` is the share of the mass beyond bond i; with equal masses
:math:`w_i = i/m`. Let :math:`\kappa` be the smallest :math:`2 U/s^2` of bonds with energy I or
less. Cauchy and Schwarz give :math:`D^2 \le 2 I \sum_i w_i^2/\kappa`. If U is convex, Jensen gives
:math:`U(D/W) \le I w_{m-1}/W` with the largest weight, :math:`w_{m-1}`, and :math:`W = \sum_i w_i`.
A fragment with enough energy to break a bond has another bound: beyond the displacement that costs
0.9 of a broken bond, only the rest of the energy is left for motion.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential

# This fraction of the energy of a broken bond counts as spent once an end particle is far out.
PAID = 0.9
# Estimates of risk assume this number of vibrations for each particle.
VIBRATIONS = 100.0
# An escape that the energy allows has at least this risk.
_LEAST_RISK = 1e-300
# Bounds are computed and cached for a geometric sequence of energies with this ratio.
ENERGY_LADDER = math.log(1.03)


def breaking_energy(bond: Potential) -> float:
    """Return the energy that breaks a bond, by dissociation or over its barrier; inf if none."""
    return min(bond.dissociation, bond.barrier)


class Lever(NamedTuple):
    """Effect of the bonds of a fragment on the distance of an end particle from the mean."""

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
        """Mass of all but the end particle."""
        return self.whole - self.mass


@lru_cache(maxsize=1024)
def equal_lever(particles: int) -> Lever:
    """Return the lever of the first particle of a fragment with masses of 1."""
    return Lever.of(np.ones(particles))


def reach(bond: Potential, energy: float, lever: Lever) -> float:
    """
    Return the largest distance of an end particle from its place relative to the mean.

    `energy` is the largest energy of all bonds together. The distance is inf if this energy
    suffices to break a bond.
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
    """Return the next energy of the sequence, or `energy` if the next one would break the bond."""
    rung = math.ceil(math.log(energy / bond.stiffness) / ENERGY_LADDER)
    higher = bond.stiffness * math.exp(rung * ENERGY_LADDER)
    return higher if higher < breaking_energy(bond) else energy


@lru_cache(maxsize=8192)
def _extent(bond: Potential, energy: float) -> tuple[float, float]:
    """Return the longest strain of bonds with at most an energy, and their least 2 U/s^2."""
    lowest, longest = bond.strain_range(energy)
    strains = np.linspace(lowest, longest, 66)
    strains = strains[strains != 0.0]
    with np.errstate(divide="ignore"):  # a bond of zero length
        softest = 2.0 * float(np.min(bond.energy(strains) / strains**2))
    return longest, min(bond.stiffness, softest)


def escape_risk(
    bond: Potential, energy: float, lever: Lever, speed: float, patience: float
) -> float:
    r"""
    Return the estimated probability that a fragment ejects its end particle with a speed.

    An ejection needs the energy :math:`E^* = U(\infty) + \frac12 u^2 \frac{m_1 M}{M - m_1}` with
    the masses :math:`m_1` of the particle and M of the fragment. With less energy, an ejection is
    impossible. With more, it is judged like unimolecular decay. The energy I is shared freely by m
    - 1 vibrations, and one of them has E* or more with the probability :math:`(1 - E^*/I)^{m-2}`,
    at each vibration. A fragment that decays at all does so with this energy in :math:`((I -
    E^*)/(I - U(\infty)))^{m-2}` of the cases, and cools. Over a barrier, beyond which a bond gains
    energy without bound, :math:`E^*` is the barrier alone, whatever the speed. If nothing binds the
    particles, no energy needs to gather, because they pass their velocities on.

    `energy` is the internal energy and `speed` is relative to the mean of the fragment. The result
    is 1 for a speed of zero or less. `patience` is the number of vibrations.
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
    # An unlikely escape never counts as impossible, even in a long fragment.
    return min(1.0, max(_LEAST_RISK, min(patience * decays, times * part**freedoms)))
