r"""
The end of a chain that cannot break: from when on energy alone keeps it off the wall.

After the last contact the mean velocity V and the energy I that is not in it are kept. Once the
mean displacement D is larger than particle 1 can be behind it with that energy (``ending``), no
contact comes. When that is can be told beforehand, as D grows by V t; what is left to see is that
particle 1 stays off the wall until then, and coarse steps show that (``look_ahead``).
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.end_watch import LOOK_GROWTH, longest_collision
from chaincor.workflows.engines.piece_bounds import Lever, breaking_energy, reach

# Steps of a run keep the energy to far less than this part of it.
ENERGY_MARGIN = 0.01


def certain_at(
    bond: Potential,
    impact_velocity: float,
    momentum: float,
    wall_distance: float,
    strains: NDArray[np.float64],
    now: float,
    last_contact: float,
    masses: NDArray[np.float64] | None = None,
) -> float:
    """
    Return from when on energy keeps a cold chain off the wall, if it stays off till then.

    Parameters
    ----------
    bond : Potential
        Of all bonds.
    impact_velocity, momentum : float
        With which it came, cold, so that it is all its energy; and what it has now, positive.
    wall_distance : float
        Of particle 1.
    strains : ndarray of shape (n - 1,)
        Bond lengths less one.
    now, last_contact : float
        Since the first contact.
    masses : ndarray of shape (n,), optional
        1 by default.

    Returns
    -------
    float
        `now` where it is certain already; inf where it never is, or not as long as collisions are
        followed: a bond may break, or the chain is too slow.
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
def _equal_leverage(particles: int) -> tuple[Lever, NDArray[np.float64]]:
    return _leverage(np.ones(particles))


def _leverage(masses: NDArray[np.float64]) -> tuple[Lever, NDArray[np.float64]]:
    """Return how bonds move particle 1 against the mean, all in all and each."""
    beyond = np.cumsum(masses[:0:-1])[::-1]
    return Lever.of(masses), beyond / np.sum(masses)


def next_look(now: float, last_contact: float, seen: float) -> float:
    """Return when to look again; the chain was `seen` near the wall after `now`."""
    return max(seen, last_contact + LOOK_GROWTH * (now - last_contact))
