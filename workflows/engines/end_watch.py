"""Search for the end of a collision, and limit the time for which a collision is followed."""

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

# A collision is followed for FOLLOWED_TIMES times the time between its first and its last contact,
# plus LEAST_CROSSINGS sound crossings, but at most for MOST_CROSSINGS sound crossings. These three
# constants are choices. In a test of many scenes (`tests/judge/plain.py`), which follows collisions
# for 20 times their duration, no contact comes after these limits.
FOLLOWED_TIMES = 21.0
LEAST_CROSSINGS, MOST_CROSSINGS = 5.0, 200.0
# A fragment that approaches the wall is followed if it arrives there within this number of sound
# crossings.
ARRIVAL_CROSSINGS = 200.0
# Unbroken bodies that still vibrate are followed until it is certain whether they touch again, but
# at most for this number of sound crossings after the last contact.
CERTAIN_CROSSINGS = 2000.0

# An end is argued after a waiting time. The waiting time starts again if the first fragment loses
# or gains particles, because the disturbance may reach the other end of the fragment. Particles
# evaporate from the far end of a long fragment. A fragment of n particles may therefore lose or
# gain n/EVAPORATING particles before the waiting time starts again.
EVAPORATING = 400

# Two nearly equal motions of a hot chain stay nearly equal for this time after the last contact.
# The unit is the time that sound takes through one bond.
EARLY = 100.0

# A moving plane separates two bodies. Each body gets at least this share of the distance between
# the bodies, and of their relative speed.
_LEAST_SHARE = 0.05

LOOKS_PER_CROSSING = 10.0
# The next check comes when the time since the last contact has grown by this factor.
LOOK_GROWTH = 1.4


def longest_collision(particles: int, stiffness: float, last_contact: float) -> float:
    """Return the time since the first contact after which an unproved end is argued or open."""
    crossing = (particles + 5.0) / stiffness**0.5
    followed = FOLLOWED_TIMES * last_contact + LEAST_CROSSINGS * crossing
    return min(followed, MOST_CROSSINGS * crossing)


def look_interval(particles: int, stiffness: float) -> float:
    """Return the time between two checks for the end while contacts still occur."""
    return (particles + 10.0) / stiffness**0.5 / LOOKS_PER_CROSSING


def bodies_of(line: Line, bond: Potential, strains: Array, velocities: Array) -> list[Body]:
    """
    Return the one or two bodies that :class:`EndWatch` examines.

    A wall, or a single particle, is only an obstacle for the other body and is not returned. A
    plane in uniform motion divides two chains; the hotter chain gets the larger share of their
    distance and relative speed. `strains` contains the N - 1 strains along x, including the gap;
    `velocities` contains the N velocities along x.
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
    """Return the body relative to a plane at a distance that recedes from the body at a speed."""
    return body._replace(first_displacement=distance, velocities=body.velocities + receding)


def _share(first: float, second: float) -> float:
    total = first + second
    share = first / total if total > 0.0 else 0.5
    return min(max(share, _LEAST_SHARE), 1.0 - _LEAST_SHARE)


class EndWatch:
    """
    Search for the end of a collision, and record for how long the end could have been argued.

    `particles` is the number of particles of the chain. `stiffness` is U''(1) divided by the mean
    mass; by default it is the stiffness of the bond. An end is argued if the risk of a return stays
    below `risk_allowed` for a sound round trip.
    """

    def __init__(
        self,
        particles: int,
        bond: Potential,
        stiffness: float | None = None,
        risk_allowed: float = RISK_ALLOWED,
    ) -> None:
        self._bond, self._risk_allowed = bond, risk_allowed
        self._particles = particles
        self._stiffness = bond.stiffness if stiffness is None else stiffness
        self._quiet = sound_round_trip(particles, self._stiffness)
        self._early = min(0.5 * self._quiet, EARLY / self._stiffness**0.5)
        #: Risk of a return at the last check before nearly equal motions begin to differ; 1 if
        #: there was no check before that time.
        self.early_risk = 1.0
        self._last_contact = -math.inf
        self._calm_since = 0.0
        self._first_sizes: tuple[int, ...] = ()
        self._arrival = 0.0

    def look_at(self, now: float, last_contact: float, bodies: Sequence[Body]) -> Ending | None:
        """
        Return the end of the collision, or None if the bodies must be followed further.

        No contact comes if there is a plane, at any position and speed, to which neither body
        returns. `bodies` are the chain and, if it is free, the target. `now` is the present time,
        `last_contact` the time of the last contact so far.
        """
        bond = self._bond
        if last_contact != self._last_contact:
            self._last_contact = self._calm_since = last_contact
            self.early_risk = 1.0
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
        if now - last_contact <= self._early:
            self.early_risk = risk
        sizes = tuple(int(pieces.sizes[0]) for pieces in parted)
        changes = zip(sizes, self._first_sizes, strict=True)
        changed = any(abs(size - first) > first // EVAPORATING for size, first in changes)
        if risk > self._risk_allowed or changed:
            self._calm_since, self._first_sizes = now, sizes
        if risk <= self._risk_allowed and now - self._calm_since > self._quiet:
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
        Return whether it will soon be certain that unbroken bodies touch, or that they do not.

        Let D be the difference between the mean displacements of both bodies, and R the sum of
        their reaches. If the bodies approach, they touch before D falls to -R, because their first
        particles cannot lie farther behind the means. If the bodies recede, they cannot touch once
        D exceeds R, because their first particles cannot lie farther ahead of the means.
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
        """Return the time limit for following the collision; later if a fragment approaches."""
        longest = longest_collision(self._particles, self._stiffness, last_contact)
        return max(longest, self._arrival)

    def next_look(self, now: float, last_contact: float) -> float:
        """Return the time of the next check, no later than the end can first be argued."""
        later = last_contact + LOOK_GROWTH * (now - last_contact)
        argued = self._calm_since + self._quiet * (1.0 + 1e-12)
        calm = self._calm_since < now
        return argued if calm and now < argued < later else later


def _mean_velocity(body: Body) -> float:
    if body.masses is None:
        return float(np.add.reduce(body.velocities)) / len(body.velocities)
    return float(np.sum(body.masses * body.velocities)) / float(np.sum(body.masses))
