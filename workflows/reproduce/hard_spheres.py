"""An exact event-driven run of hard spheres against a wall, in rational numbers."""

from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True)
class HardSphereRun:
    """The outcome of a collision of hard spheres, exact."""

    particles: int  #: Number of spheres n.
    restitution: Fraction  #: Ratio of translational energies.
    #: Hits of the wall, and collisions between neighbours.
    contacts: int
    exchanges: int  #: See ``contacts``.
    vibration: Fraction  #: Kinetic energy left relative to the centre of mass.


def run_hard_spheres(particles: int, gap: Fraction = Fraction(1, 7)) -> HardSphereRun:
    """
    Follow hard spheres from event to event until none can come.

    Spheres of diameter 1 - gap start at distance 1 from one another with velocity -1, the first
    one at the wall. Between events everything flies freely; at an event two neighbours exchange
    their velocities, or sphere 1 reverses its own. Positions, velocities and times are rational,
    so nothing is rounded.

    `gap` is the free space between neighbours at the start.
    """
    # Shrunk to points: position i less i diameters.
    positions = [gap * i for i in range(particles)]
    velocities = [Fraction(-1)] * particles
    contacts = exchanges = 0
    while True:
        # Event i is between i - 1 and i; event 0 is the wall.
        waits = {}
        if velocities[0] < 0:
            waits[0] = -positions[0] / velocities[0]
        for i in range(1, particles):
            closing = velocities[i - 1] - velocities[i]
            if closing > 0:
                waits[i] = (positions[i] - positions[i - 1]) / closing
        if not waits:
            break
        wait = min(waits.values())
        positions = [x + v * wait for x, v in zip(positions, velocities, strict=True)]
        for event in (i for i, due in waits.items() if due == wait):
            if event == 0:
                velocities[0] = -velocities[0]
                contacts += 1
            else:
                velocities[event - 1 : event + 1] = velocities[event - 1 : event + 1][::-1]
                exchanges += 1
    mean = sum(velocities, Fraction(0)) / particles
    vibration = sum(((v - mean) ** 2 for v in velocities), Fraction(0)) / 2
    return HardSphereRun(particles, mean * mean, contacts, exchanges, vibration)
