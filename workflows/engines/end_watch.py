"""How long a collision is followed, the bodies that leave each other, and the watch for its end."""

import math
from collections.abc import Sequence

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.ending import (
    RISK_ALLOWED,
    RISK_AT_STAKE,
    Ending,
    approach,
    evaporation,
    return_risk,
    sound_round_trip,
)
from chaincor.workflows.engines.fragment_bounds import reach
from chaincor.workflows.engines.fragments import Body, Fragments

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

# Each of two bodies has this part at least of the way, and of the speed, between both.
_LEAST_SHARE = 0.05

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


def bodies_of(line: Line, bond: Potential, strains: Array, velocities: Array) -> list[Body]:
    """
    Return the bodies of a line as :class:`EndWatch` looks at them, one or two.

    A wall, and a single particle, only stand before the other body. Two chains are divided by a
    plane in uniform motion that leaves each the more of the way and of the speed the hotter it is.
    `strains` are those of the N - 1 bonds along x, with the gap, `velocities` the N ones along x.
    """
    gap = float(strains[line.gap])
    chain = Body(0.0, strains[line.first :], velocities[line.first :], line.chain_masses)
    target = Body(
        0.0, strains[: line.gap][::-1], -velocities[: line.first][::-1], line.target_masses
    )
    if line.first == 1:
        return [_seen_from(chain, gap, float(target.velocities[0]))]
    if len(chain.velocities) == 1:
        return [_seen_from(target, gap, float(chain.velocities[0]))]
    parted = [body.pieces(bond) for body in (chain, target)]
    places = [float(pieces.displacements[0]) for pieces in parted]
    speeds = [float(pieces.speeds[0]) for pieces in parted]
    energies = [max(float(p.energies[0]), 0.0) if p.sizes[0] > 1 else 0.0 for p in parted]
    both = list(zip(energies, parted, strict=True))
    heats = [math.sqrt(energy / float(pieces.weights[0])) for energy, pieces in both]
    widths = [math.sqrt(energy * int(pieces.sizes[0])) for energy, pieces in both]
    way = gap + places[0] + places[1]
    near = _share(*widths) * way
    plane = speeds[0] - _share(*heats) * (speeds[0] + speeds[1])
    return [
        _seen_from(chain, near - places[0], -plane),
        _seen_from(target, way - near - places[1], plane),
    ]


def _seen_from(body: Body, distance: float, receding: float) -> Body:
    """Return a body whose first particle is so far from a plane that recedes from it."""
    return body._replace(first_displacement=distance, velocities=body.velocities + receding)


def _share(first: float, second: float) -> float:
    total = first + second
    share = first / total if total > 0.0 else 0.5
    return min(max(share, _LEAST_SHARE), 1.0 - _LEAST_SHARE)


class EndWatch:
    """
    Looks for the end of a collision, and remembers for how long it has been argued.

    Particles are those of the chain, the stiffness is U''(1) over the mean mass, by default that of
    the bond.
    """

    def __init__(self, particles: int, bond: Potential, stiffness: float | None = None) -> None:
        self._bond = bond
        self._particles = particles
        self._stiffness = bond.stiffness if stiffness is None else stiffness
        self._quiet = sound_round_trip(particles, self._stiffness)
        self._last_contact = -math.inf
        self._calm_since = 0.0
        self._first_sizes: tuple[int, ...] = ()
        self._arrival = 0.0

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
        coming = sum(_mean_velocity(body) for body in bodies) <= 0.0
        if coming and not late:
            return None
        parted = [body.pieces(bond) for body in bodies]
        if coming:
            self._is_awaited(now, parted)
            return None
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

    def _is_awaited(self, now: float, parted: Sequence[Fragments]) -> bool:
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
