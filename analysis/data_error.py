"""How far restitution may be from that of the run, because a dump prints few digits."""

import numpy as np

from chaincor.analysis.dumps.collision_frames import CollisionFrames
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.masses import mass_resolution
from chaincor.analysis.followed import Followed


def restitution_precision(
    reading: CollisionFrames, seen: Followed, e: float, speed_given: bool
) -> float:
    """
    Propagate the half-units of printed numbers into eta.

    Parameters
    ----------
    reading : CollisionFrames
        The frames, read to the end.
    seen : Followed
        What they show.
    e : float
        The ratio of speeds.
    speed_given : bool
        Whether the impact speed is exact; one that was read has the resolution of the dump.

    Returns
    -------
    float
        A bound, not a deviation.
    """
    masses, state, digits = seen.masses, seen.last, reading.digits
    epsilon = float(np.finfo(float).eps)

    def off(frame: DumpFrame, steps: int) -> float:
        """Return how far the relative velocity in a frame may be off."""
        half = reading.layout.by_body(frame.resolution("vx", digits))
        printed = sum(
            float(np.sum(m * h)) / float(np.sum(m)) for m, h in zip(masses, half, strict=True)
        )
        # The run itself goes on to at most one frame more, each step rounding every velocity, and
        # LAMMPS adds up n products in an order of its own, each addition rounding.
        sizes = zip(masses, state.bodies, strict=True)
        return printed + sum(
            (m.size + steps) * epsilon * float(np.sum(m * np.abs(body.velocities))) / np.sum(m)
            for m, body in sizes
        )

    read = 0.0
    if not speed_given:
        largest = float(np.max(reading.first.resolution("vx", digits)))
        read = largest if len(masses) == 1 else off(reading.first, 0)
    error = 2.0 * abs(e) * (off(reading.last, reading.last_interval) + abs(e) * read)
    uncertain = mass_resolution(reading.first, reading.layout, masses[0])
    miss = np.abs(state.velocities / seen.velocity - e)
    total = float(np.sum(masses[0]))
    return error / seen.velocity + 2.0 * abs(e) * float(uncertain @ miss) / total
