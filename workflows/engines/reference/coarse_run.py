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

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import EndWatch, look_interval
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.moving import Motion, Stepper
from chaincor.workflows.engines.time_limit import steps_at_once

# Verlet steps in units of the stiffest bond's 1/frequency. While particle 1 is still near the wall
# they move it by less than v0/1e3; later, when their phase errors have grown, it is far away.
COARSE_STEP = 0.1
# Particle 1 must stay off even a wall that has come half its distance nearer.
CLEARANCE = 0.5
# That must be worth this much of v0/sqrt(U''), by which bonds swing.
LEAST_CLEARANCE = 0.1


class CoarseRun:
    """
    A copy of bodies in motion, `moving`, that flies ahead with coarse steps.

    It starts at the `time` since the first contact, with Verlet steps of a size, and may not let
    the gap get smaller than the clearance, nor bonds stretch beyond the ceiling.
    """

    def __init__(
        self,
        moving: Motion,
        time: float,
        step: float,
        clearance: float = -math.inf,
        ceiling: float = math.inf,
    ) -> None:
        self.moving, self.time = moving.copy(), time
        ledger = self.moving.ledger
        ledger["strain_ceiling"] = ceiling
        # What has stretched before is looked at again.
        ledger["strain_max"] = longest_strain(moving)
        self._step, self._clearance = step, clearance

    def fly(self, duration: float) -> bool:
        """
        Fly on for at least a duration.

        False where the gap gets smaller than allowed, or a bond longer: the bodies are there then.
        """
        steps = max(1, math.ceil(duration / self._step))
        done, most = 0, steps_at_once(len(self.moving.strain))
        stepper, state = self.moving.stepper, self.moving.arrays.now
        for begin in range(0, steps, most):
            part = min(most, steps - begin)
            asked = part, self._step, self._clearance, begin == 0, begin + part == steps
            told = self.moving.ledger, state, asked, stepper.rule.parameters
            taken = stepper.kernels.take_coarse_steps(*told)
            done += taken
            if taken < part:
                break
        self.time += done * self._step
        return bool(done == steps)


def highest_frequency(bond: Potential, shortest: float, lightest: float = 1.0) -> float:
    """Return sqrt(U''/m) of the stiffest bond, at the smallest strain, and the least mass."""
    stiffest = max(float(bond.curvature(shortest)), bond.stiffness)
    return math.sqrt(stiffest / lightest)


def coarse_step(bond: Potential, shortest: float, lightest: float = 1.0) -> float:
    """Return the Verlet step for looking ahead, with the smallest strain so far."""
    return COARSE_STEP / highest_frequency(bond, shortest, lightest)


def required_clearance(scene: Scene, distance: float) -> float | None:
    """
    Return how far from the wall the coarse motion must stay to count.

    That is half the distance between the bodies as it is looked ahead from; None where that is too
    short to tell a coarse motion from a contact.
    """
    clearance = CLEARANCE * distance
    least = LEAST_CLEARANCE * scene.impact_velocity / math.sqrt(scene.slow_stiffness)
    return clearance if clearance >= least else None


def longest_strain(moving: Motion) -> float:
    """Return the largest strain of all bonds, the gap left out."""
    strain = moving.strain
    if not moving.at_wall:
        strain = np.delete(strain, moving.line.gap)
    return float(np.max(strain, initial=-1.0))


def coarse_ceiling(bond: Potential) -> float:
    """Strain below which coarse steps tell what exact ones do: no bond comes near to breaking."""
    return bond.convex_strain if math.isfinite(bond.dissociation) else bond.barrier_strain


def find_end(scene: Scene, ahead: CoarseRun, last_contact: float) -> Ending | None:
    """
    Fly ahead, which moves the run, until the end is proved or argued.

    None where the motion came near the wall, or to a bond's breaking. `last_contact` is the time of
    the last one so far.
    """
    particles, stiffness = scene.longest_body, scene.slow_stiffness
    watch = EndWatch(particles, scene.bond, stiffness)
    interval = look_interval(particles, stiffness)
    while True:
        ending = watch.look_at(ahead.time, last_contact, ahead.moving.bodies())
        if ending is not None:
            return ending
        later = watch.next_look(ahead.time, last_contact) - ahead.time
        if not ahead.fly(max(later, interval)):
            return None


def bonds_in_flight(scene: Scene, outcome: Outcome, duration: float) -> tuple[float, float]:
    """
    Return how short and long bonds get in free flight for a time after the last contact.

    The `outcome` has the state right after that; there are two particles at least. Good to some
    parts in 1e3 of their strains; flight ends early where a bond is as no bond may be.
    """
    line, bond = scene.line, scene.bond
    target = np.zeros(line.first), np.zeros(line.first)
    if line.targets:
        target = outcome.target_displacements[::-1], outcome.target_velocities[::-1]
    strains = np.diff(np.concatenate((target[0], outcome.displacements)))
    strains[line.gap] = 0.0
    velocities = np.concatenate((target[1], outcome.velocities))
    step = coarse_step(bond, outcome.bond_min - 1.0, line.lightest)
    stepper = Stepper.of(line, bond, "verlet", step)
    moving = Motion.in_state(stepper, strains, velocities, scene.impact_velocity)
    ceiling = float(moving.ledger["strain_ceiling"])
    ahead = CoarseRun(moving, 0.0, step, ceiling=ceiling)
    ahead.fly(duration)
    ledger = ahead.moving.ledger
    return 1.0 + float(ledger["strain_min"]), 1.0 + float(ledger["strain_max"])
