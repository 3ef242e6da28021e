r"""
The end of a chain that cannot break: from when on energy alone keeps it off the wall.

After the last contact the mean velocity V and the energy I that is not in it are kept. Once the
mean displacement D is larger than particle 1 can be behind it with that energy (``ending``), no
contact comes. When that is can be told beforehand, as D grows by V t; what is left to see is that
particle 1 stays off the wall until then, and coarse steps show that (``look_ahead``). Loops over
many chains look whether it is so already, by bounds worked out for a ladder of energies.
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

# Steps of a run keep the energy to far less than this part of it.
ENERGY_MARGIN = 0.01
# Bounds are worked out down to this part of the largest energy.
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
    Return from when on energy keeps a cold chain off the wall, if it stays off till then.

    It came with the impact velocity, which is all its energy, and has a positive momentum now;
    times are since the first contact. `now` where it is certain already; inf where it never is, or
    not as long as collisions are followed: a bond may break, or the chain is too slow.
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
    """Return how bonds move particle 1 against the mean, all in all and each."""
    beyond = np.cumsum(masses[:0:-1])[::-1]
    return Lever.of(masses), beyond / np.sum(masses)


def next_look(now: float, last_contact: float, seen: float) -> float:
    """Return when to look again; the chain was `seen` near the wall after `now`."""
    return max(seen, last_contact + LOOK_GROWTH * (now - last_contact))


class EndBounds(NamedTuple):
    """What proves ends of chains within a loop."""

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
    Return whether a chain can never come back to the wall, with all the energy that it has.

    `distance` is that of particle 1 from the wall; a loop, for the compiler.
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
