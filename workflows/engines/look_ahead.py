"""
Looking ahead: cheap motion that shows that no further contact comes.

The result of a collision is the state right after its last contact. What follows only has to show
that it was the last, and particle 1 keeps so clear of the wall then that coarse Verlet steps show
it as well as exact ones, as long as no bond comes near to breaking. Where one does, or where the
coarse motion comes near the wall, nothing has been said: the engine goes on exactly from where it
was, and does not look ahead again before that moment. Chains that broke are followed exactly until
sound has had the time to cross them and come back, and coarsely from then on.
"""

import math
from typing import Protocol

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import Body, EndWatch, look_interval
from chaincor.workflows.engines.ending import Ending

# Verlet steps in units of the stiffest bond's 1/frequency. While particle 1 is still near the wall
# they move it by less than v0/1e3; later, when their phase errors have grown, it is far away.
COARSE_STEP = 0.1
# Particle 1 must stay off even a wall that has come half its distance nearer.
CLEARANCE = 0.5
# That must be worth this much of v0/sqrt(U''), by which bonds swing.
LEAST_CLEARANCE = 0.1


class Coast(Protocol):
    """Bodies that fly ahead with coarse steps."""

    time: float
    """Time since the first contact."""

    def fly(self, duration: float) -> bool:
        """Fly on for at least `duration`; return False where the coarse motion stops counting."""

    def bodies(self) -> list[Body]:
        """Return the bodies as the end of a collision looks at them."""


def coarse_step(bond: Potential, shortest: float, lightest: float = 1.0) -> float:
    """
    Return the Verlet step for looking ahead: a tenth of sqrt(m/U'') of the stiffest bond.

    `shortest` is the smallest strain so far, with which the steps shrink, `lightest` the mass of
    the lightest particle.
    """
    stiffest = max(float(bond.curvature(shortest)), bond.stiffness)
    return COARSE_STEP / math.sqrt(stiffest / lightest)


def required_clearance(scene: Scene, distance: float) -> float | None:
    """
    Return how far from the wall the coarse motion must stay to count.

    That is half the distance between the bodies as it is looked ahead from; None where that is too
    short to tell a coarse motion from a contact.
    """
    clearance = CLEARANCE * distance
    least = LEAST_CLEARANCE * scene.impact_velocity / math.sqrt(scene.slow_stiffness)
    return clearance if clearance >= least else None


def find_end(scene: Scene, coast: Coast, last_contact: float) -> Ending | None:
    """
    Fly ahead, which moves the coast, until the end is proved or argued.

    None where the motion came near the wall, or to a bond's breaking. `last_contact` is the time of
    the last one so far.
    """
    particles, stiffness = scene.span, scene.slow_stiffness
    watch = EndWatch(particles, scene.bond, stiffness)
    interval = look_interval(particles, stiffness)
    while True:
        ending = watch.look_at(coast.time, last_contact, coast.bodies())
        if ending is not None:
            return ending
        later = watch.next_look(coast.time, last_contact) - coast.time
        if not coast.fly(max(later, interval)):
            return None
