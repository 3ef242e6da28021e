"""
When between two frames contacts were, in one of two ways.

*reintegration*, where the bond is known: the chain near the wall is integrated from the first of
the two frames with exact impacts (DOP853 with event location). Contacts come out to the
precision of the dump however far apart the frames are, and the momentum they give is checked
against that of the second frame.

*interpolation*, where it is not: between a frame and the contact particle 1 moves with about the
mean of its two velocities. The two sides must fill the time between the frames; if they do not,
there was more than one contact and the frames are too far apart to tell.
"""

from collections.abc import Sequence

import numpy as np

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential

# Tolerance of the reintegration: that of the best dumps.
_RELATIVE_TOLERANCE = 1e-12
# Bonds carry sound at a speed of 1 to about 2; particles farther than this cannot matter.
_PARTICLES_PER_TIME = 3.0
_MORE_PARTICLES = 30


def interpolate_contact(before: ChainState, after: ChainState, speed: float) -> tuple[float, float]:
    """
    Return how long after one frame and how long before the next a contact happened.

    On each side particle 1 covers its distance from the wall at the mean of its velocity in the
    frame and at the contact; the error is of third order in the time.

    The two estimates are independent: they add up to the time between the frames as far as they are
    right. Neither is longer than ten times that, also where particle 1 does not move towards the
    wall.
    """
    closing = 0.5 * (speed - before.opening)
    leaving = 0.5 * (speed + after.opening)
    ahead = max(before.gap, 0.0) / closing if closing > 0.0 else np.inf
    since = max(after.gap, 0.0) / leaving if leaving > 0.0 else np.inf
    duration = after.time - before.time
    return min(ahead, 10.0 * duration), min(since, 10.0 * duration)


def reintegrate_contacts(
    state: ChainState, end_time: float, bond: Potential, masses: Sequence[Array]
) -> tuple[list[float], list[float]]:
    """
    Integrate from a frame to a later time and return the contacts on the way.

    Only the particles whose motion can reach the contact in that time are followed. `masses` are
    those of the chain and of a free target, each from the contact outward.

    Returns times and closing speeds in order, empty if the integration fails.
    """
    from scipy.integrate import solve_ivp

    near = [_near(body, end_time, bond, m) for body, m in zip(state.bodies, masses, strict=True)]
    counts = [m.size for _, _, m in near]
    count, first = sum(counts), [0, *counts[:-1]]
    m = np.concatenate([m for _, _, m in near])
    u = np.concatenate([u for u, _, _ in near])
    v = np.concatenate([v for _, v, _ in near])
    size = float(np.max(np.abs(v)))
    # In a mirror a target is a chain: the gap is the sum of the first displacements.
    front = np.array(first)
    contact_mass = 1.0 / float(np.sum(1.0 / m[front]))

    def motion(_time: float, y: Array) -> Array:
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
        # At a contact the gap is zero but for rounding, which must not count as another.
        if gap <= 1e-14 * size and closing > 0.0:
            times.append(time)
            speeds.append(closing)
            v[front] += 2.0 * contact_mass * closing / m[front]
        if time >= end_time:
            return times, speeds
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
        if not path.success:
            return [], []
        u, v = path.y[:count, -1], path.y[count:, -1]
        time = float(path.t[-1])
        if path.status == 1:
            u[0] -= float(np.sum(u[front]))
        elif path.status == 0:
            return times, speeds


def _near(
    body: ChainState, end_time: float, bond: Potential, masses: Array
) -> tuple[Array, Array, Array]:
    """Return displacements, velocities and masses of particles that the contact may feel."""
    pace = _PARTICLES_PER_TIME * np.sqrt(bond.stiffness / float(np.min(masses)))
    count = int(pace * (end_time - body.time))
    count = min(count + _MORE_PARTICLES, body.velocities.size)
    return body.displacements[:count], body.velocities[:count], masses[:count]
