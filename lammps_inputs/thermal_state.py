r"""
Warm bodies: a state of equilibrium at a temperature, drawn from a seed.

Bond lengths are independent and distributed as :math:`\exp(-U/T)`; velocities are Maxwell's, from
which the mass-weighted mean is taken: the momentum is that of the cold bodies, exactly.

Equilibrium does not change while the bodies fly. So their vibrations are in a phase that tells
nothing of the first contact, provided that their centres of mass start at a distance that does not
depend on what was drawn, and so far away that they cannot yet have met. To place particle 1 at a
distance of its own would choose phases.

The bits of a seed are those of NumPy's PCG64, seeded by a SeedSequence, which no machine and no
version changes. What is made of them differs in last digits, as exponentials of processors do.
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
LARGEST_SEED = 2**63 - 1  # the largest whole number of a database
GENERATOR = "PCG64"
# Probability that bodies in equilibrium overlap at the distance they start from.
OVERLAP_RISK = 1e-12
# Bonds are told apart by so many sizes of their share in the length of a body.
_SHARES = 256
# Where the least bound is looked for, in units of 1/width.
_SLOPES = 2.0 ** (np.arange(-16.0, 49.0) / 8.0)


class WarmStates(NamedTuple):
    """States of two bodies, one for each seed; from the contact outward."""

    gaps: Array  #: Distance of particle 1 from the target; of shape (S,).
    #: Of the chain. Velocities along x, relative to the centre of mass; of shape (S, n - 1) and (S,
    #: n).
    strains: Array
    velocities: Array  #: See ``strains``.
    #: Of a free target; without columns for the wall; of shape (S, M - 1) and (S, M).
    target_strains: Array
    target_velocities: Array  #: See ``target_strains``.


def draw(
    bond: Potential, temperature: float, masses: Array, target_masses: Array, seeds: list[int]
) -> WarmStates:
    """
    Draw the states of two bodies in equilibrium at k_B T, one for each seed.

    Masses are of the chain and of a free target, from the contact outward; none for the wall.
    Raises SceneError if the bond has no equilibrium at this temperature.
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
    # One draw in 1e12 would overlap: it starts once more as much farther away.
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
    Return numbers between 0 and 1, neither included: 53 random bits and a half of the last.

    Number 2 i is for the velocity of particle i, 2 i + 1 for the bond behind it: a longer chain
    begins like a shorter one.
    """
    bits = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(body,))).random_raw(count)
    return ((bits >> np.uint64(11)).astype(float) + 0.5) * 2.0**-53


def _shares_of_length(masses: Array) -> Array:
    """Return how much each bond adds to the distance from particle 1 to the centre of mass."""
    if len(masses) < 2:
        return np.zeros(0)
    beyond = np.cumsum(masses[:0:-1])[::-1]
    return beyond / np.sum(masses)


def start_margin(bond: Potential, temperature: float, shares: Array) -> float:
    r"""
    Return how much farther than on average the centres of mass must be from each other at first.

    The distance from particle 1 to the centre of mass is :math:`y = \sum_j w_j (1 + s_j)`, with the
    part :math:`w_j` of the mass beyond bond j. By Chernoff's bound it exceeds its mean by d with a
    probability of at most :math:`\exp(\sum_j K(\lambda w_j) - \lambda d)` at any
    :math:`\lambda > 0`, where K is the cumulant generating function of a strain: d is the least at
    which this is `OVERLAP_RISK`; 0 without bonds. `shares` are the w_j of both bodies.
    """
    # Shares rounded upward: the bound holds the more, as K rises with them.
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

    # A Gaussian's is at sqrt(2 ln(1/risk)) = 7.4. Values on a fixed grid, of which the least is at
    # most 0.1 % above the minimum: what a search ends with would change with the processor.
    slopes = _SLOPES / width
    moments = distribution.log_moment(np.multiply.outer(slopes, np.array(shares)))
    return float(np.min((moments @ np.array(counts, dtype=float) + needed) / slopes))
