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

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.chain_frames import ChainState
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
    closing = 0.5 * (speed - before.velocities[0])
    leaving = 0.5 * (speed + after.velocities[0])
    ahead = max(float(before.displacements[0]), 0.0) / closing if closing > 0.0 else np.inf
    since = max(float(after.displacements[0]), 0.0) / leaving if leaving > 0.0 else np.inf
    duration = after.time - before.time
    return min(ahead, 10.0 * duration), min(since, 10.0 * duration)


def reintegrate_contacts(
    state: ChainState,
    end_time: float,
    bond: Potential,
    masses: NDArray[np.float64] | None = None,
) -> tuple[list[float], list[float]]:
    """
    Integrate from a frame to a later time and return the contacts on the way.

    Only the particles whose motion can reach the wall in that time are followed.

    Returns times and incoming speeds in order, empty if the integration fails.
    """
    from scipy.integrate import solve_ivp

    m = np.ones(state.velocities.size) if masses is None else masses
    pace = _PARTICLES_PER_TIME * np.sqrt(bond.stiffness / float(np.min(m)))
    count = int(pace * (end_time - state.time))
    count = min(count + _MORE_PARTICLES, state.velocities.size)
    u, v = state.displacements[:count].copy(), state.velocities[:count].copy()
    size = float(np.max(np.abs(v)))

    def motion(_time: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        pull = -bond.force(np.diff(y[:count]))
        acceleration = np.zeros(count)
        acceleration[:-1] += pull
        acceleration[1:] -= pull
        return np.concatenate((y[count:], acceleration / m[:count]))

    def distance(_time: float, y: NDArray[np.float64]) -> float:
        return y[0]

    distance.terminal = True  # type: ignore[attr-defined]
    distance.direction = -1  # type: ignore[attr-defined]

    times: list[float] = []
    speeds: list[float] = []
    time = state.time
    while True:
        # At a contact the position is zero but for rounding, which must not count as another.
        if u[0] <= 1e-14 * size and v[0] < 0.0:
            times.append(time)
            speeds.append(-float(v[0]))
            v[0] = -v[0]
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
            u[0] = 0.0
        elif path.status == 0:
            return times, speeds
