"""The start of a collision as the first frame shows it: how fast the chain comes in."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

StartKind = Literal["incoming", "reflected", "late"]


@dataclass(frozen=True)
class Start:
    """
    What the first frame says.

    Attributes
    ----------
    kind : str
        ``incoming``: every particle still has the velocity -v0; ``reflected``: particle 1 has
        just been turned round; ``late``: the collision is under way.
    impact_velocity : float or None
        v0 > 0; None for a late start.
    """

    kind: StartKind
    impact_velocity: float | None


def find_start(velocities: NDArray[np.float64], resolution: NDArray[np.float64]) -> Start:
    """
    Read the impact speed off the velocities in the first frame, particle 1 first.

    `resolution` is the half-width of the interval that each printed velocity stands for.
    """
    outer = velocities[1:] if velocities.size > 1 else -np.abs(velocities)
    speed = -float(outer[-1])
    # In flight, forces of the rounding of positions disturb velocities by next to nothing.
    slack = max(4.0 * float(np.max(resolution)), 1e-9 * speed)
    if not speed > 0.0 or np.any(np.abs(outer + speed) > slack):
        return Start("late", None)
    if abs(velocities[0] + speed) <= slack:
        return Start("incoming", speed)
    if abs(velocities[0] - speed) <= slack:
        return Start("reflected", speed)
    return Start("late", None)
