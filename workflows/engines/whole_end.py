r"""
Find the time after which an unbroken chain has too little energy to reach the wall.

After the last contact, the mean velocity V and the internal energy I are constant. The energy I
allows particle 1 to lie at most a certain distance behind the mean position (``ending``). No
contact comes once the mean displacement D exceeds this distance. The time at which D exceeds this
distance is known in advance, because D grows as V t. A run with coarse steps shows that particle 1
stays off the wall until then (``look_ahead``). Loops over many chains check whether this time has
passed; they use bounds that are tabulated for a sequence of energies.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.end_watch import LOOK_GROWTH, longest_collision
from chaincor.workflows.engines.fragment_bounds import ENERGY_LADDER, Lever, breaking_energy, reach

# Upper bound on the relative energy error of a run; true errors are far smaller.
ENERGY_MARGIN = 0.01
# `EndBounds` tabulates bounds for energies down to this fraction of the largest energy.
_LEAST_ENERGY = 1e-4


def certain_at(
    bond: Potential,
    impact_velocity: float,
    momentum: float,
    wall_distance: float,
    strains: Array,
    now: float,
    last_contact: float,
    masses: Array | None = None,
) -> float:
    """
    Return the time after which a cold chain has too little energy to reach the wall.

    The result assumes that no contact comes before this time. All energy of the chain comes from
    its impact velocity, and its momentum is now positive. Times count from the first contact. The
    result is `now` if the end is already certain. It is inf if a bond may break, or if the end
    becomes certain only after the time for which collisions are followed.
    """
    particles = len(strains) + 1
    lever, shares = _equal_leverage(particles) if masses is None else _leverage(masses)
    speed = momentum / lever.whole
    inner = 0.5 * lever.whole * ((1.0 + ENERGY_MARGIN) * impact_velocity**2 - speed**2)
    if not speed > 0.0 or inner >= breaking_energy(bond):
        return math.inf
    free = inner - 0.5 * speed * speed * lever.whole / lever.rest * lever.mass
    displacement = wall_distance + float(np.sum(shares * strains))
    certain = now + max(reach(bond, free, lever) - displacement, 0.0) / speed
    followed = longest_collision(particles, bond.stiffness * particles / lever.whole, last_contact)
    return certain if certain <= followed else math.inf


@lru_cache(maxsize=64)
def _equal_leverage(particles: int) -> tuple[Lever, Array]:
    return _leverage(np.ones(particles))


def _leverage(masses: Array) -> tuple[Lever, Array]:
    """Return the lever of particle 1 in a whole chain, and the weight of each bond."""
    beyond = np.cumsum(masses[:0:-1])[::-1]
    return Lever.of(masses), beyond / np.sum(masses)


def next_look(now: float, last_contact: float, seen: float) -> float:
    """Return the time of the next check, not before the end `seen` of the coarse run."""
    return max(seen, last_contact + LOOK_GROWTH * (now - last_contact))


class EndBounds(NamedTuple):
    """Bounds with which a compiled loop proves that collisions are over."""

    masses: Array  #: Masses of the chain; empty if the loop proves no ends; of shape (n,).
    #: Mass :math:`m_1 M/(M - m_1)` for particle 1 of mass :math:`m_1` in a chain of mass M.
    lever: float
    #: Logarithm of the smallest tabulated energy.
    log_least: float
    log_rung: float  #: Logarithm of the ratio between neighbouring energies.
    #: For each tabulated energy, the largest difference between the displacement of particle 1 and
    #: the mean displacement; of shape (rungs,).
    reaches: Array
    interval: float  #: Time that sound takes through one bond.

    @classmethod
    def none(cls) -> "EndBounds":
        """Return bounds that prove nothing."""
        return cls(np.empty(0), 0.0, 0.0, 1.0, np.empty(0), 0.0)

    @staticmethod
    def rung_above(bond: Potential, energy: float) -> int:
        """Return the index of the first tabulated energy above an energy."""
        return math.ceil(math.log(1.1 * energy / bond.stiffness) / ENERGY_LADDER)

    @classmethod
    def of(cls, line: Line, bond: Potential, top: int) -> "EndBounds":
        """Return bounds for chains with energies up to the tabulated energy of index `top`."""
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
    Return whether a chain has too little energy to ever return to the wall.

    `distance` is the distance of particle 1 from the wall. The function is compiled.
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
    # To reach the wall, particle 1 must move against the mean velocity, which takes this energy.
    free -= 0.5 * speed * speed * bounds.lever
    if free <= 0.0:
        return True
    rung = int(np.ceil((np.log(free) - bounds.log_least) / bounds.log_rung))
    if rung >= bounds.reaches.shape[0]:
        return False
    return moment / whole > bounds.reaches[max(rung, 0)]
