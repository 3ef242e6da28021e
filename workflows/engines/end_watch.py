"""How long a collision is followed, and the watch that looks for its end."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
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
from chaincor.workflows.engines.piece_bounds import reach
from chaincor.workflows.engines.pieces import Pieces, find_pieces

# A collision is followed for so many times its own length and a few times that of one sound
# crossing, and for so many crossings however late contacts come. Choices: the judge of many scenes
# (`benchmarks/judge/plain.py`) runs on to 20 times, and so finds none that was not waited for.
FOLLOWED_TIMES = 21.0
LEAST_CROSSINGS, MOST_CROSSINGS = 5.0, 200.0
# A piece that approaches the wall is waited for, if it arrives within so many crossings.
ARRIVAL_CROSSINGS = 200.0
# Whole bodies that still vibrate are waited for as long as they need to meet for certain, or to be
# too far apart for it: up to so many crossings after the last contact.
CERTAIN_CROSSINGS = 2000.0

# An argument begins anew where the first piece loses or gains particles: what that stirs up may
# come to its other end. Of a long one, whose far end boils, one in so many may come and go.
EVAPORATING = 400

LOOKS_PER_CROSSING = 10.0
# Looks get rarer with the time since the contact.
LOOK_GROWTH = 1.4


def longest_collision(particles: int, stiffness: float, last_contact: float) -> float:
    """Return the time after the first contact at which an end not argued is open."""
    crossing = (particles + 5.0) / stiffness**0.5
    followed = FOLLOWED_TIMES * last_contact + LEAST_CROSSINGS * crossing
    return min(followed, MOST_CROSSINGS * crossing)


def look_interval(particles: int, stiffness: float) -> float:
    """Return the time between two looks for the end while contacts follow one another."""
    return (particles + 10.0) / stiffness**0.5 / LOOKS_PER_CROSSING


class Body(NamedTuple):
    """A body that leaves another: the chain, or a free target."""

    #: How far its particle at the contact is from a plane between both bodies; for the chain at a
    #: wall, from that.
    first_displacement: float
    strains: Array  #: Bond lengths less one, from the contact outward; of shape (n - 1,).
    velocities: Array  #: Relative to that plane, positive away from it; of shape (n,).
    masses: Array | None = None  #: None where all are 1; of shape (n,).


class EndWatch:
    """
    Looks for the end of a collision, and remembers for how long it has been argued.

    Parameters
    ----------
    particles : int
        Particles of the chain.
    bond : Potential
        The bonds' potential.
    stiffness : float, optional
        U''(1) over the mean mass; that of the bond by default.
    """

    def __init__(self, particles: int, bond: Potential, stiffness: float | None = None) -> None:
        self._bond = bond
        self._particles = particles
        self._stiffness = bond.stiffness if stiffness is None else stiffness
        self._quiet = quiet_time(particles, self._stiffness)
        self._last_contact = -math.inf
        self._calm_since = 0.0
        self._first_sizes: tuple[int, ...] = ()
        self._arrival = 0.0

    def look(
        self,
        now: float,
        last_contact: float,
        first_displacement: float,
        strains: Array,
        velocities: Array,
    ) -> Ending | None:
        """Look at a chain at a wall alone, given as to :func:`argue_end`; see :meth:`look_at`."""
        return self.look_at(now, last_contact, [Body(first_displacement, strains, velocities)])

    def look_at(self, now: float, last_contact: float, bodies: Sequence[Body]) -> Ending | None:
        """
        Look at one body that leaves the wall, or at two that leave each other.

        No contact comes where neither body comes back to one plane between them, wherever that is
        and however fast it moves. Bodies are the chain, and a target if it is free; times are now,
        and that of the last contact so far. Returns None where they must be followed on.
        """
        bond = self._bond
        if last_contact != self._last_contact:
            self._last_contact = self._calm_since = last_contact
            self._first_sizes, self._arrival = tuple(len(body.velocities) for body in bodies), 0.0
        late = now > self.followed_until(last_contact)
        if sum(_mean_velocity(body) for body in bodies) <= 0.0:
            if late:
                parted = [find_pieces(*body[:3], bond, body.masses) for body in bodies]
                self._is_awaited(now, parted)
            return None
        parted = [find_pieces(*body[:3], bond, body.masses) for body in bodies]
        risk = min(1.0, sum(return_risk(pieces, bond) for pieces in parted))
        if risk == 0.0:
            return Ending("proved")
        sizes = tuple(int(pieces.sizes[0]) for pieces in parted)
        changes = zip(sizes, self._first_sizes, strict=True)
        changed = any(abs(size - first) > first // EVAPORATING for size, first in changes)
        if risk > RISK_ALLOWED or changed:
            self._calm_since, self._first_sizes = now, sizes
        if risk <= RISK_ALLOWED and now - self._calm_since > self._quiet:
            return Ending("argued")
        if not late or self._is_awaited(now, parted):
            return None
        speed = sum(float(pieces.speeds[0]) for pieces in parted)
        if speed > 0.0:
            at_stake = 0.0
            if risk > RISK_AT_STAKE:
                at_stake = sum(evaporation(pieces, bond) for pieces in parted)
            return Ending("argued", momentum_at_stake=at_stake)
        if speed < 0.0:
            apart = sum(float(pieces.displacements[0]) for pieces in parted)
            arrival = now + 1.1 * apart / -speed
            crossing = self._particles / self._stiffness**0.5
            if now < arrival < ARRIVAL_CROSSINGS * crossing:
                self._arrival = arrival
                return None
        return Ending("open", approach(*parted))

    def _is_awaited(self, now: float, parted: Sequence[Pieces]) -> bool:
        """
        Return whether it will soon be certain that whole bodies meet, or that they do not.

        They meet before their mean displacements D have come so near that their first particles
        cannot be far enough behind, and not once these cannot be far enough ahead: when D is as
        large as both can reach.
        """
        if any(len(pieces.sizes) > 1 for pieces in parted):
            return False
        apart = sum(float(pieces.displacements[0]) for pieces in parted)
        speed = sum(float(pieces.speeds[0]) for pieces in parted)
        far = sum(reach(self._bond, float(p.energies[0]), p.lever) for p in parted)
        crossing = self._particles / self._stiffness**0.5
        latest = max(self._last_contact, 0.0) + CERTAIN_CROSSINGS * crossing
        way = far - apart if speed > 0.0 else far + apart
        if speed == 0.0 or not 0.0 < way < math.inf:
            return False
        certain = now + 1.1 * way / abs(speed)
        if not now < certain < latest:
            return False
        self._arrival = certain
        return True

    def followed_until(self, last_contact: float) -> float:
        """Return until when the collision is followed; later with a piece under way to the wall."""
        longest = longest_collision(self._particles, self._stiffness, last_contact)
        return max(longest, self._arrival)

    def next_look(self, now: float, last_contact: float) -> float:
        """Return when to look again: seldom, but not past the moment of an argument."""
        later = last_contact + LOOK_GROWTH * (now - last_contact)
        argued = self._calm_since + self._quiet * (1.0 + 1e-12)
        calm = self._calm_since < now
        return argued if calm and now < argued < later else later


def _mean_velocity(body: Body) -> float:
    if body.masses is None:
        return float(np.mean(body.velocities))
    return float(np.sum(body.masses * body.velocities)) / float(np.sum(body.masses))
