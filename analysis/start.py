"""The start of a collision as the first frame shows it: how fast the chain comes in."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from chaincor.lammps_inputs.arrays import Array

StartKind = Literal["incoming", "reflected", "moving", "turned", "late"]


@dataclass(frozen=True)
class Start:
    """What the first frame says."""

    #: ``incoming``: every particle still has the velocity -v0; ``reflected``: particle 1 has just
    #: been turned round; ``moving`` and ``turned``: the same of a chain that comes with inner
    #: motion, known by its momentum; ``late``: the collision is under way.
    kind: StartKind
    impact_velocity: float | None  #: v0 > 0 as the velocities say it; None where they alone do not.

    @property
    def moving(self) -> bool:
        """Whether the chain comes with inner motion."""
        return self.kind in ("moving", "turned")


def find_start(velocities: Array, resolution: Array) -> Start:
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


def find_moving_start(
    velocities: Array, masses: Array, impact_velocity: float, slack: float, at_wall: bool
) -> StartKind:
    """
    Tell by its momentum whether a chain with inner motion has met the wall.

    Parameters
    ----------
    velocities, masses : ndarray of shape (n,)
        Of the first frame, particle 1 first.
    impact_velocity : float
        v0, which such velocities do not show.
    slack : float
        By how much the velocity of the centre of mass may differ.
    at_wall : bool
        Whether particle 1 is at the wall: then it may just have been turned round.

    Returns
    -------
    str
        ``moving``, ``turned`` or ``late``.
    """
    total = float(np.sum(masses))
    mean = float(masses @ velocities) / total
    if abs(mean + impact_velocity) <= slack:
        return "moving"
    before = mean - 2.0 * float(masses[0] * velocities[0]) / total
    return "turned" if at_wall and abs(before + impact_velocity) <= slack else "late"
