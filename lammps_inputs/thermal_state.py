r"""
Random equilibrium states of warm bodies at a temperature.

Bond lengths are independent and distributed as :math:`\exp(-U/T)`. Velocities have Maxwell's
distribution. Their mass-weighted mean is subtracted, and the bodies therefore have exactly the
momentum of cold bodies.

Free flight does not change the equilibrium. At the first contact, the vibrations therefore have
random phases, under two conditions: the initial distance between the centres of mass must not
depend on the random state, and it must exclude an earlier contact. A fixed initial distance of
particle 1 would favour some phases.

The random bits come from NumPy's PCG64, seeded by a SeedSequence. These bits do not depend on the
machine or the version. Strains and velocities computed from them can differ in their last digits,
because exponentials differ between processors.
"""

import math
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.equilibrium import (
    BondDistribution,
    bond_distribution,
    kept_by_bond,
)
from chaincor.lammps_inputs.bonds.potential import Potential

DEFAULT_SEED = 1
LARGEST_SEED = 2**63 - 1  # the largest whole number of the store's database
GENERATOR = "PCG64"
# Largest probability that bodies in equilibrium overlap at their initial distance.
OVERLAP_RISK = 1e-12
# Number of classes into which bonds are grouped according to their weight in the length of a body.
_SHARES = 256
# Values of lambda at which the bound is computed, in units of 1/width; the smallest bound is used.
_SLOPES = 2.0 ** (np.arange(-16.0, 49.0) / 8.0)


class WarmStates(NamedTuple):
    """States of two bodies for S seeds, from the contact outward."""

    gaps: Array  #: Distance of particle 1 from the target; of shape (S,).
    #: Strains of the chain, of shape (S, n - 1).
    strains: Array
    #: Velocities of the chain along x, relative to its centre of mass, of shape (S, n).
    velocities: Array
    #: Strains of a free target, of shape (S, M - 1); a wall has no columns.
    target_strains: Array
    #: Velocities of a free target along x, relative to its centre of mass, of shape (S, M).
    target_velocities: Array


def draw(
    bond: Potential, temperature: float, masses: Array, target_masses: Array, seeds: list[int]
) -> WarmStates:
    """
    Draw the states of two bodies in equilibrium at k_B T, with one state per seed.

    The masses of the chain and of a free target are in order from the contact outward. The wall has
    no masses. Raises SceneError if the bond has no equilibrium at this temperature.
    """
    distribution = bond_distribution(bond, temperature)
    bodies = (masses, target_masses)
    drawn = [_draw_body(distribution, temperature, m, seeds, i) for i, m in enumerate(bodies)]
    weights = [_shares_of_length(each) for each in bodies]
    margin = start_margin(bond, temperature, np.concatenate(weights))
    longer = np.zeros(len(seeds))
    for (strains, _), share in zip(drawn, weights, strict=True):
        longer += np.sum(share * (strains - distribution.mean), axis=-1)
    gaps = margin - longer
    # About one state in 1e12 would overlap. Its distance is increased by the margin again.
    while margin > 0.0 and np.any(gaps <= 0.0):
        gaps[gaps <= 0.0] += margin
    return WarmStates(gaps, *drawn[0], *drawn[1])


def _draw_body(
    distribution: BondDistribution, temperature: float, masses: Array, seeds: list[int], body: int
) -> tuple[Array, Array]:
    """Return strains, and velocities relative to the centre of mass, with one row per seed."""
    from scipy.special import ndtri

    count = len(masses)
    numbers = np.array([_uniform_numbers(seed, body, 2 * count) for seed in seeds])
    numbers = numbers.reshape(len(seeds), 2 * count)
    velocities = np.sqrt(temperature / masses) * ndtri(numbers[:, 0::2])
    if count < 2:
        velocities = np.zeros_like(velocities)
    else:
        momentum = np.sum(masses * velocities, axis=-1, keepdims=True)
        velocities -= momentum / np.sum(masses)
    return distribution.strains(np.ascontiguousarray(numbers[:, 1 : 2 * count - 1 : 2])), velocities


def _uniform_numbers(seed: int, body: int, count: int) -> Array:
    """
    Return uniform numbers from 53 random bits each; adding half a bit excludes 0 and 1.

    Number 2 i gives the velocity of particle i, and number 2 i + 1 the next bond. The first
    particles of a long and of a short chain therefore have equal initial states.
    """
    bits = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(body,))).random_raw(count)
    return ((bits >> np.uint64(11)).astype(float) + 0.5) * 2.0**-53


def _shares_of_length(masses: Array) -> Array:
    """Return the weight of each bond in the distance from particle 1 to the centre of mass."""
    if len(masses) < 2:
        return np.zeros(0)
    beyond = np.cumsum(masses[:0:-1])[::-1]
    return beyond / np.sum(masses)


def start_margin(bond: Potential, temperature: float, shares: Array) -> float:
    r"""
    Return the initial distance between the centres of mass minus its mean at a contact.

    The distance from particle 1 to the centre of mass is :math:`y = \sum_j w_j (1 + s_j)`, where
    :math:`w_j` is the fraction of the mass beyond bond j. According to Chernoff's bound, y exceeds
    its mean by d with a probability of at most :math:`\exp(\sum_j K(\lambda w_j) - \lambda d)` at
    any :math:`\lambda > 0`, where K is the cumulant generating function of a strain. The result is
    the smallest d for which this bound is `OVERLAP_RISK`; it is 0 without bonds. `shares` are the
    w_j of both bodies.
    """
    # Weights are rounded up. The bound remains valid, because K increases with the weight.
    rounded, counts = np.unique(np.ceil(np.asarray(shares) * _SHARES), return_counts=True)
    return _margin(bond, temperature, tuple(rounded / _SHARES), tuple(counts.tolist()))


@kept_by_bond
def _margin(
    bond: Potential, temperature: float, shares: tuple[float, ...], counts: tuple[int, ...]
) -> float:
    if not shares:
        return 0.0
    distribution = bond_distribution(bond, temperature)
    needed = -math.log(OVERLAP_RISK)
    width = math.sqrt(distribution.variance * float(np.sum(np.square(shares) * counts)))

    # For a Gaussian the minimum is at sqrt(2 ln(1/risk)) = 7.4. The smallest value on a fixed grid
    # is at most 0.1 % above the minimum. The result of an iterative search would depend on the
    # processor.
    slopes = _SLOPES / width
    moments = distribution.log_moment(np.multiply.outer(slopes, np.array(shares)))
    return float(np.min((moments @ np.array(counts, dtype=float) + needed) / slopes))
