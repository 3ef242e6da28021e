"""
Detection of contacts in a sequence of frames.

Only the wall can change the momentum of the chain. A contact with incoming speed v_q adds exactly 2
m_1 v_q, and nothing decreases the momentum. Therefore, if the momentum rises by P between two
frames, there was a contact. If there was only one contact, its incoming speed is P/(2 m_1). For a
free target, m_1 is replaced by the reduced mass of the two particles at the contact, and v_q by the
closing speed. If the second frame was written right after a contact, particle 1 is at the wall and
has the speed P/(2 m_1); the frame itself then shows the contact. Otherwise one of two methods finds
the time and the number of contacts.

*reintegration*, if the bond is known: the part of the chain near the wall is integrated from the
first of the two frames, with exact impacts (DOP853 with event location). The contacts have the
precision of the dump, however far the frames are apart. The momentum of these contacts is compared
with the second frame.

*interpolation*, if the bond is unknown: between a frame and the contact, particle 1 moves at about
the mean of its velocities at these two times. The two frames give the time to the contact and the
time since the contact. If the sum of both differs from the time between the frames, there was more
than one contact, and the frames are too far apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential

# Even in a dump of full precision, a contact slower than this fraction of v0 cannot be
# distinguished from rounding.
_SMALLEST_SPEED = 1e-9
# Interpolation estimates the time from the first frame to the contact, and the time from the
# contact to the second frame. Their sum may differ by this fraction from the time between the
# frames.
_GAP = 0.25
# Relative precision of times in the default format. Other formats are more precise.
_MARGIN = 1e-6
# Largest difference, in units of v0, between the momentum transferred at the detected contacts and
# the change of momentum in the dump. If the difference is larger, a contact may be missing.
_LARGEST_MISS = 0.5
# Largest speed of particle 1 between two frames, divided by the largest speed of any particle in
# these two frames.
_FASTEST = 2.0
# Tolerance of the reintegration, for dumps with all digits.
_RELATIVE_TOLERANCE = 1e-12
# Particles farther away than this number of bonds per unit of time, plus _MORE_PARTICLES, cannot
# affect a contact. Sound crosses only 1 to about 2 bonds in a unit of time.
_PARTICLES_PER_TIME = 3.0
_MORE_PARTICLES = 30
# Limits on the force evaluations of a reintegration, because a spoilt frame may require very small
# steps. They are ten times what harmonic chains need.
_EVALUATIONS, _MORE_EVALUATIONS, _MOST_EVALUATIONS = 400.0, 20_000, 100_000


@dataclass(frozen=True)
class DetectedContacts:
    """Contacts detected in a dump."""

    #: Times of the contacts, measured like the times in the dump, of shape (f,).
    times: Array
    speeds: Array  #: Incoming speeds of particle 1, of shape (f,).
    method: str  #: Method: ``reintegration`` or ``interpolation``.
    unresolved: int  #: Number of intervals between frames with an unknown number of contacts.
    #: Largest difference, for any pair of successive frames, between the momentum transferred at
    #: the detected contacts and the change of momentum in the dump, in units of v0; 0 for
    #: interpolation, which takes the momentum from the dump.
    worst_miss: float
    #: Longest interval between two frames with a contact between them, if no frame shows the state
    #: at this contact.
    largest_gap: float
    #: Number of intervals between frames in which the momentum rises although particle 1 cannot
    #: have reached the wall.
    unexplained: int = 0
    #: Largest decrease of the momentum below an earlier value, in units of M v0; 0 if rounding
    #: explains the decrease.
    largest_fall: float = 0.0


class ContactDetector:
    """
    Detector of contacts in a stream of frames; `last_time` is the time of the last contact.

    `masses` are those of the chain and of a free target, each from the contact outward.
    `velocity_resolution` is half a unit of the last printed digit in a velocity near v0. `soft`
    bodies overlap in a contact; for them only the momentum is used, and no contacts are listed.
    """

    def __init__(
        self,
        impact_velocity: float,
        masses: Sequence[Array],
        bond: Potential | None = None,
        velocity_resolution: float = 0.0,
        soft: bool = False,
    ):
        self._velocity, self._masses, self._bond, self._soft = impact_velocity, masses, bond, soft
        # Mass of particle 1, or the reduced mass of the two particles at the contact.
        contact_mass = float(masses[0][0])
        for target in masses[1:]:
            contact_mass /= 1.0 + contact_mass / target[0]
        self._contact_mass = contact_mass
        # Momentum before the collision, divided by the contact mass.
        self._initial = float(np.sum(masses[0])) / contact_mass * impact_velocity
        # The rounding errors of n velocities in two frames add up like a random walk.
        spread = np.sqrt(np.sum((masses[0] / contact_mass) ** 2))
        self._rounding = velocity_resolution, spread, np.floor(np.log10(impact_velocity))
        self._previous: ChainState | None = None
        self.last_time: float | None = None
        self._times: list[float] = []
        self._speeds: list[float] = []
        self._unresolved = self._unexplained = 0
        self._worst_miss = self._largest_gap = self._largest_fall = 0.0
        self._momentum = self._peak = 0.0

    def add_known(self, time: float, speed: float) -> None:
        """Record a contact that is known without detection, with its incoming speed."""
        self.last_time = time
        self._times.append(time)
        self._speeds.append(speed)

    def feed(self, state: ChainState) -> None:
        """Detect contacts between the previous state and the given state."""
        before, self._previous = self._previous, state
        if before is None:
            return
        # A contact changes the closing speed by the change of momentum divided by the contact mass.
        change = float(np.sum(self._masses[0] * (state.velocities - before.velocities)))
        given = change / self._contact_mass
        slack = self._threshold(before, state)
        self._momentum += given
        self._peak = max(self._peak, self._momentum)
        fall = self._peak - self._momentum
        if fall > slack:
            self._largest_fall = max(self._largest_fall, fall / self._initial)
        if given <= slack:
            return
        if self._soft:
            self.last_time = state.time
            return
        # A frame that was written right after a contact shows the contact's time and speed.
        speed = 0.5 * given
        if state.gap == 0.0 and abs(state.gap_velocity - speed) <= slack:
            self.add_known(state.time, speed)
            return
        duration = state.time - before.time
        self._largest_gap = max(self._largest_gap, duration)
        self._unexplained += _out_of_reach(before, state, speed)
        if self._bond is None or duration <= 0.0:
            self._interpolate(before, state, speed)
        else:
            self._reintegrate(before, state, given)

    def result(self) -> DetectedContacts:
        """Return the contacts found so far, in order of time."""
        return DetectedContacts(
            np.array(self._times),
            np.array(self._speeds),
            "none" if self._soft else "interpolation" if self._bond is None else "reintegration",
            self._unresolved,
            self._worst_miss,
            self._largest_gap,
            self._unexplained,
            self._largest_fall,
        )

    def _threshold(self, before: ChainState, after: ChainState) -> float:
        # If velocities are ten times as large as v0, the unit of their last printed digit is also
        # ten times as large.
        largest = max(np.max(np.abs(before.velocities)), np.max(np.abs(after.velocities)))
        resolution, spread, usual = self._rounding
        coarser = 10.0 ** (np.floor(np.log10(max(largest, self._velocity))) - usual)
        rounding = 8.0 * coarser * resolution * spread
        return max(2.0 * _SMALLEST_SPEED * self._velocity, float(rounding))

    def _interpolate(self, before: ChainState, after: ChainState, speed: float) -> None:
        duration = after.time - before.time
        ahead, since = interpolate_contact(before, after, speed)
        if abs(ahead + since - duration) > _GAP * duration:
            self._unresolved += 1
        # The error of an estimate grows with the cube of the time from its frame. The nearer frame
        # therefore has the larger weight.
        total = ahead**3 + since**3
        weight = ahead**3 / total if total > 0.0 else 0.5
        time = before.time + (1.0 - weight) * ahead + weight * (duration - since)
        self.add_known(float(np.clip(time, before.time, after.time)), speed)

    def _reintegrate(self, before: ChainState, after: ChainState, given: float) -> None:
        assert self._bond is not None
        # A frame written at a contact may show the state before or after it. The search therefore
        # goes slightly beyond the second frame. The momentum then decides which of the last
        # contacts belong to this pair of frames.
        margin = _MARGIN * (after.time - before.time + abs(after.time))
        times, speeds = reintegrate_contacts(before, after.time + margin, self._bond, self._masses)
        doubtful = sum(time > after.time - margin for time in times)
        counts = range(len(times) - doubtful, len(times) + 1)
        count = min(counts, key=lambda k: abs(2.0 * sum(speeds[:k]) - given))
        times, speeds = times[:count], speeds[:count]
        miss = abs(2.0 * sum(speeds) - given) / self._velocity
        self._worst_miss = max(self._worst_miss, miss)
        if not times or not miss < _LARGEST_MISS:
            self._interpolate(before, after, 0.5 * given)
            self._unresolved += 1
            return
        for known in zip(times, speeds, strict=True):
            self.add_known(*known)


def _out_of_reach(before: ChainState, after: ChainState, speed: float) -> bool:
    """Return whether particle 1 cannot have reached the wall between two frames."""
    way = max(before.gap, 0.0) + max(after.gap, 0.0)
    speeds = np.abs(np.concatenate((before.all_velocities, after.all_velocities, [speed])))
    return way > _FASTEST * float(np.max(speeds)) * (after.time - before.time)


def interpolate_contact(before: ChainState, after: ChainState, speed: float) -> tuple[float, float]:
    """
    Estimate the time from a frame to a contact, and from the contact to the next frame.

    Between a frame and the contact, particle 1 is assumed to move at the mean of its velocities at
    these two times. The error is of third order in the time between them.

    The two estimates are independent. If both are right, their sum is the time between the frames.
    If particle 1 does not move towards the wall, or moves slowly, an estimate is ten times the time
    between the frames.
    """
    closing = 0.5 * (speed - before.gap_velocity)
    leaving = 0.5 * (speed + after.gap_velocity)
    ahead = max(before.gap, 0.0) / closing if closing > 0.0 else np.inf
    since = max(after.gap, 0.0) / leaving if leaving > 0.0 else np.inf
    duration = after.time - before.time
    return min(ahead, 10.0 * duration), min(since, 10.0 * duration)


class _TooManyEvaluationsError(Exception):
    """A reintegration evaluates the forces too often."""


def reintegrate_contacts(
    state: ChainState, end_time: float, bond: Potential, masses: Sequence[Array]
) -> tuple[list[float], list[float]]:
    """
    Integrate from a frame to a later time, and return the contacts in between.

    Only particles that can affect the contact in this time are integrated. `masses` are those of
    the chain and of a free target, each from the contact outward.

    Returns the times and closing speeds of the contacts; both lists are empty if the integration
    fails or takes too long.
    """
    from scipy.integrate import solve_ivp

    near = [_near(body, end_time, bond, m) for body, m in zip(state.bodies, masses, strict=True)]
    counts = [m.size for _, _, m in near]
    count, first = sum(counts), [0, *counts[:-1]]
    m = np.concatenate([m for _, _, m in near])
    u = np.concatenate([u for u, _, _ in near])
    v = np.concatenate([v for _, v, _ in near])
    size = float(np.max(np.abs(v)))
    # The target is mirrored. The gap is therefore the sum of both first displacements.
    front = np.array(first)
    contact_mass = 1.0 / float(np.sum(1.0 / m[front]))

    needed = _EVALUATIONS * _rate(bond, m) * (end_time - state.time) + _MORE_EVALUATIONS
    left = iter(range(int(min(needed, _MOST_EVALUATIONS))))

    def motion(_time: float, y: Array) -> Array:
        if next(left, None) is None:
            raise _TooManyEvaluationsError
        acceleration = np.zeros(count)
        for begin, many in zip(first, counts, strict=True):
            body = slice(begin, begin + many)
            acceleration[body] = np.diff(bond.force(np.diff(y[body])), prepend=0.0, append=0.0)
        return np.concatenate((y[count:], -acceleration / m))

    def distance(_time: float, y: Array) -> float:
        return float(np.sum(y[front]))

    distance.terminal = True  # type: ignore[attr-defined]
    distance.direction = -1  # type: ignore[attr-defined]

    times: list[float] = []
    speeds: list[float] = []
    time = state.time
    while True:
        gap, closing = float(np.sum(u[front])), -float(np.sum(v[front]))
        # Right after a contact the gap is zero except for rounding, which must not cause another
        # contact.
        if gap <= 1e-14 * size and closing > 0.0:
            times.append(time)
            speeds.append(closing)
            v[front] += 2.0 * contact_mass * closing / m[front]
        if time >= end_time:
            return times, speeds
        try:
            with np.errstate(all="ignore"):
                path = solve_ivp(
                    motion,
                    (time, end_time),
                    np.concatenate((u, v)),
                    method="DOP853",
                    rtol=_RELATIVE_TOLERANCE,
                    atol=_RELATIVE_TOLERANCE * size,
                    events=distance,
                )
        except _TooManyEvaluationsError:
            return [], []
        if not path.success:
            return [], []
        u, v = path.y[:count, -1], path.y[count:, -1]
        time = float(path.t[-1])
        if path.status == 1:
            u[0] -= float(np.sum(u[front]))
        elif path.status == 0:
            return times, speeds


def _rate(bond: Potential, masses: Array) -> float:
    """Return the square root of the bond's stiffness divided by the smallest mass."""
    return float(np.sqrt(bond.stiffness / float(np.min(masses))))


def _near(
    body: ChainState, end_time: float, bond: Potential, masses: Array
) -> tuple[Array, Array, Array]:
    """Return displacements, velocities and masses of particles that can affect the contact."""
    pace = _PARTICLES_PER_TIME * _rate(bond, masses)
    count = int(pace * (end_time - body.time))
    count = min(count + _MORE_PARTICLES, body.velocities.size)
    return body.displacements[:count], body.velocities[:count], masses[:count]
