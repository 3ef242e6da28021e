r"""
The end of a collision, argued: why no further hit can come.

Connected fragments are separated by bonds that are stretching with a relative energy above
dissociation. Once the fragments recede from the wall in order of speed, only the first can hit
again, and for it one of two arguments is needed.

*energy*: with particle 1 at the wall, the m - 1 bonds of the fragment must stretch so that
:math:`\sum_i w_i s_i = D`, where D is the mean displacement and :math:`w_i = (m - i)/m \le 1`
sum to W = (m - 1)/2. Where U is convex, Jensen's inequality gives
:math:`\sum U(s_i) \ge \sum w_i U(s_i) \ge W\,U(D/W)`. If that exceeds the fragment's internal
energy, the wall is out of reach, and since D only grows, for ever. This is a proof.

*quiet*: particle 1 has stayed off the wall for longer than sound needs to cross the fragment and
come back, so that every signal that the contacts sent has returned once. This is an argument.

Long chains break into dozens of fragments, some of which keep meeting each other, far from the
wall, for as long as one cares to look. Silence for the whole chain is an argument then too, if the
first fragment is slower than any that the others can become by elastic collisions: of m particles
in a group of M that moves with V and has the energy T of its fragments about it, none is slower
than :math:`V - \sqrt{2 T (M - m)/(m M)}`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lammps_inputs.potential import Potential

# Sound in stretched bonds is slower than at natural length; the quiet time allows for a tenth.
QUIET_ROUND_TRIPS = 1.1

# A collision lasts about two sound crossings; ten times that means something else is going on.
CAP_CROSSINGS = 20.0

LOOKS_PER_CROSSING = 10.0


def quiet_time(particles: int, stiffness: float) -> float:
    """
    Return how long particle 1 must stay off the wall.

    Parameters
    ----------
    particles : int
        Particles of the fragment.
    stiffness : float
        U''(1).

    Returns
    -------
    float
        Time for sound to cross and come back, with the margin.
    """
    return QUIET_ROUND_TRIPS * 2.0 * particles / stiffness**0.5


def longest_collision(particles: int, stiffness: float) -> float:
    """
    Return the cap on the simulated time.

    Parameters
    ----------
    particles : int
        Particles of the chain.
    stiffness : float
        U''(1).

    Returns
    -------
    float
        Time after which an unfinished collision is a named failure.
    """
    return CAP_CROSSINGS * (particles + 5.0) / stiffness**0.5


def look_interval(particles: int, stiffness: float) -> float:
    """
    Return the time between two looks for the end.

    Parameters
    ----------
    particles : int
        Particles of the chain.
    stiffness : float
        U''(1).

    Returns
    -------
    float
        A tenth of the time sound takes to cross the chain and a little more.
    """
    return (particles + 10.0) / stiffness**0.5 / LOOKS_PER_CROSSING


@dataclass(frozen=True)
class Fragments:
    """
    Connected pieces of the chain.

    Attributes
    ----------
    starts : ndarray of shape (fragments,)
        Index of the first particle of each.
    sizes : ndarray of shape (fragments,)
        Particles in each.
    mean_velocities : ndarray of shape (fragments,)
        Centre-of-mass velocity of each.
    """

    starts: NDArray[np.int64]
    sizes: NDArray[np.int64]
    mean_velocities: NDArray[np.float64]


def find_fragments(
    strains: NDArray[np.float64], velocities: NDArray[np.float64], bond: Potential
) -> Fragments:
    """
    Cut the chain where bonds are broken.

    A bond is broken when it stretches and the energy of the relative motion (reduced mass 1/2)
    plus U exceeds dissociation; a long bond that will come back is not.

    Parameters
    ----------
    strains : ndarray of shape (n - 1,)
        Bond lengths less one.
    velocities : ndarray of shape (n,)
        Particle velocities.
    bond : Potential
        The bonds' potential.

    Returns
    -------
    Fragments
        At least one.
    """
    opening = np.diff(velocities)
    if np.isinf(bond.dissociation):
        broken = np.zeros(len(strains), dtype=bool)
    else:
        relative = 0.25 * opening**2 + bond.energy(strains)
        broken = (strains > 0.0) & (opening > 0.0) & (relative > bond.dissociation)
    starts = np.concatenate(([0], np.flatnonzero(broken) + 1))
    sizes = np.diff(np.append(starts, len(velocities)))
    return Fragments(starts, sizes, np.add.reduceat(velocities, starts) / sizes)


def slowest_behind(fragments: Fragments) -> float:
    """
    Return the velocity below which no fragment but the first can come by elastic collisions.

    Parameters
    ----------
    fragments : Fragments
        Two at least, not all in order of speed.

    Returns
    -------
    float
        Smallest velocity that any of them can be left with; -inf if the first meets the second.
    """
    sizes, speeds = fragments.sizes, fragments.mean_velocities
    if speeds[1] <= speeds[0]:
        return -np.inf
    # Neighbours that can meet, directly or after others have, are taken as one group.
    groups: list[tuple[int, float, float]] = []
    for last in range(1, len(sizes)):
        first = last
        slowest = fastest = float(speeds[last])
        while groups and groups[-1][2] >= slowest:
            first = groups.pop()[0]
            slowest, fastest = _reach(sizes[first : last + 1], speeds[first : last + 1])
        groups.append((first, slowest, fastest))
    return groups[0][1]


def _reach(sizes: NDArray[np.int64], speeds: NDArray[np.float64]) -> tuple[float, float]:
    """Return the smallest and largest velocity that elastic collisions of a group allow."""
    mass, least = float(sizes.sum()), float(sizes.min())
    mean = float(np.average(speeds, weights=sizes))
    energy = 0.5 * float(sizes @ (speeds - mean) ** 2)
    most = (2.0 * energy * (mass - least) / (least * mass)) ** 0.5
    return mean - most, mean + most


def argue_end(
    first_displacement: float,
    strains: NDArray[np.float64],
    velocities: NDArray[np.float64],
    since_contact: float,
    bond: Potential,
) -> str | None:
    """
    Return the argument by which no further contact can come, or None where there is none yet.

    Parameters
    ----------
    first_displacement : float
        Distance of particle 1 from the wall.
    strains : ndarray of shape (n - 1,)
        Bond lengths less one.
    velocities : ndarray of shape (n,)
        Particle velocities, positive away from the wall.
    since_contact : float
        Time since the last contact.
    bond : Potential
        The bonds' potential.

    Returns
    -------
    str or None
        ``energy``, ``quiet`` or None.
    """
    if float(np.sum(velocities)) <= 0.0:
        return None
    fragments = find_fragments(strains, velocities, bond)
    speeds = fragments.mean_velocities
    if speeds[0] <= 0.0:
        return None
    if np.any(np.diff(speeds) <= 0.0):
        silent = since_contact > quiet_time(len(velocities), bond.stiffness)
        return "quiet" if silent and speeds[0] < slowest_behind(fragments) else None
    size = int(fragments.sizes[0])
    if size == 1 and first_displacement >= 0.0:
        return "energy"
    inner = strains[: size - 1]
    with np.errstate(over="ignore"):  # an exploded motion, which its energy gives away
        internal = 0.5 * float(np.sum((velocities[:size] - speeds[0]) ** 2))
        internal += float(np.sum(bond.energy(inner)))
    reach = 0.5 * (size - 1)
    weights = np.arange(size - 1, 0, -1) / size
    mean_displacement = first_displacement + float(weights @ inner)
    convex = bond.convex_strain
    if mean_displacement > 0.0 and (
        np.isinf(convex) or internal <= float(bond.energy(np.array(convex)))
    ):
        mean_strain = min(mean_displacement / reach, convex)
        if reach * float(bond.energy(np.array(mean_strain))) > internal:
            return "energy"
    if since_contact > quiet_time(size, bond.stiffness):
        return "quiet"
    return None
