r"""
Equilibrium states of warm bodies at a temperature, drawn from a seed.

Bond lengths are independent and distributed as :math:`\exp(-U/T)`. Velocities have Maxwell's
distribution, less their mass-weighted mean, so that the momentum equals the momentum of cold bodies
exactly.

The flight of the bodies does not change their equilibrium. The phase of the vibrations is therefore
independent of the first contact, provided that the initial distance of the centres of mass does not
depend on the drawn state and excludes an earlier contact. A fixed initial distance of particle 1
would select phases.

The random bits come from NumPy's PCG64, seeded by a SeedSequence. They do not depend on the machine
or the version. The numbers made from them can differ in last digits, as exponentials do between
processors.
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
# Bodies in equilibrium overlap at their initial distance with at most this probability.
OVERLAP_RISK = 1e-12
# Bonds are grouped into this many classes by their share in the length of a body.
_SHARES = 256
# The smallest bound is searched on this grid, in units of 1/width.
_SLOPES = 2.0 ** (np.arange(-16.0, 49.0) / 8.0)


class WarmStates(NamedTuple):
    """States of two bodies for each seed, from the contact outward."""

    gaps: Array  #: Distance of particle 1 from the target; of shape (S,).
    #: Strains of the chain, of shape (S, n - 1).
    strains: Array
    #: Velocities of the chain along x, relative to its centre of mass, of shape (S, n).
    velocities: Array
    #: Strains of a free target, of shape (S, M - 1); without columns for the wall.
    target_strains: Array
    #: Velocities of a free target along x, relative to its centre of mass, of shape (S, M).
    target_velocities: Array


def draw(
    bond: Potential, temperature: float, masses: Array, target_masses: Array, seeds: list[int]
) -> WarmStates:
    """
    Draw the states of two bodies in equilibrium at k_B T, one for each seed.

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
    # One draw in 1e12 would overlap. It starts farther away by the same distance again.
    while margin > 0.0 and np.any(gaps <= 0.0):
        gaps[gaps <= 0.0] += margin
    return WarmStates(gaps, *drawn[0], *drawn[1])


def _draw_body(
    distribution: BondDistribution, temperature: float, masses: Array, seeds: list[int], body: int
) -> tuple[Array, Array]:
    """Return strains and velocities, relative to the centre of mass, with a row for each seed."""
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
    Return numbers between 0 and 1, both excluded, from 53 random bits plus half of the last bit.

    Number 2 i belongs to the velocity of particle i, and 2 i + 1 to the bond behind it, so that a
    longer chain begins like a shorter chain.
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
    Return the initial distance of the centres of mass beyond its mean at a contact.

    The distance from particle 1 to the centre of mass is :math:`y = \sum_j w_j (1 + s_j)`, with the
    part :math:`w_j` of the mass beyond bond j. By Chernoff's bound it exceeds its mean by d with a
    probability of at most :math:`\exp(\sum_j K(\lambda w_j) - \lambda d)` at any
    :math:`\lambda > 0`, where K is the cumulant generating function of a strain. The result is the
    smallest d at which this bound is `OVERLAP_RISK`, and 0 without bonds. `shares` are the w_j of
    both bodies.
    """
    # Shares are rounded upward. The bound stays valid, because K increases with the share.
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
    # is at most 0.1 % above the minimum. The end of an iterative search would depend on the
    # processor.
    slopes = _SLOPES / width
    moments = distribution.log_moment(np.multiply.outer(slopes, np.array(shares)))
    return float(np.min((moments @ np.array(counts, dtype=float) + needed) / slopes))
