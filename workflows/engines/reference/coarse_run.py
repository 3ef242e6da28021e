"""
Look ahead with coarse steps to show that no further contact comes.

The result of a collision is the state right after its last contact. The later motion is needed only
to show that no contact follows. Particle 1 is then far from the wall. Coarse Verlet steps are
therefore as conclusive as exact steps, unless a bond is near breaking. If a bond is near breaking,
or if the coarse motion comes near the wall, the look-ahead run decides nothing. The engine then
continues the exact run, and starts the next look-ahead run only after the time that the previous
look-ahead run reached. A chain that broke is followed with exact steps for one sound round trip,
and with coarse steps afterwards.
"""

import math

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.end_watch import EndWatch, look_interval
from chaincor.workflows.engines.ending import RISK_ALLOWED, Ending
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.moving import Motion, Stepper
from chaincor.workflows.engines.time_limit import steps_at_once

# Length of a coarse Verlet step, in units of 1/frequency of the stiffest bond. While particle 1 is
# near the wall, the error of its position is below v0/1e3. Later the phase errors are larger, but
# the particle is far from the wall.
COARSE_STEP = 0.1
# Clearance of a coarse run: the distance that particle 1 must keep from the wall, as a fraction of
# its distance at the start of the run.
CLEARANCE = 0.5
# A coarse run is started only if the clearance is at least this fraction of the amplitude of the
# bonds, v0/sqrt(U'').
LEAST_CLEARANCE = 0.1


class CoarseRun:
    """
    Look-ahead run: a copy of the bodies in motion that takes coarse steps.

    The run starts at `time` since the first contact, with Verlet steps of size `step`. It stops if
    the gap gets smaller than `clearance` or if a bond stretches beyond `ceiling`.
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
        run_state = self.moving.run_state
        run_state["strain_ceiling"] = ceiling
        # From now on, `strain_max` records the largest strain of the coarse run alone.
        run_state["strain_max"] = longest_strain(moving)
        self._step, self._clearance = step, clearance

    def fly(self, duration: float) -> bool:
        """
        Advance by at least a duration; return whether the run stayed within its limits.

        If the gap gets too small or a bond too long, stop the run there and return False.
        """
        steps = max(1, math.ceil(duration / self._step))
        done, most = 0, steps_at_once(len(self.moving.strain))
        stepper, state = self.moving.stepper, self.moving.arrays.now
        for begin in range(0, steps, most):
            part = min(most, steps - begin)
            asked = part, self._step, self._clearance, begin == 0, begin + part == steps
            arguments = self.moving.run_state, state, asked, stepper.rule.parameters
            taken = stepper.kernels.take_coarse_steps(*arguments)
            done += taken
            if taken < part:
                break
        self.time += done * self._step
        return bool(done == steps)


def highest_frequency(bond: Potential, shortest: float, lightest: float = 1.0) -> float:
    """Return sqrt(U''/m) with U'' at the smallest strain and the least mass m."""
    stiffest = max(float(bond.curvature(shortest)), bond.stiffness)
    return math.sqrt(stiffest / lightest)


def coarse_step(bond: Potential, shortest: float, lightest: float = 1.0) -> float:
    """Return the Verlet step of look-ahead runs; `shortest` is the smallest strain so far."""
    return COARSE_STEP / highest_frequency(bond, shortest, lightest)


def required_clearance(problem: Problem, distance: float) -> float | None:
    """
    Return the least distance from the wall that a coarse motion must keep.

    The least distance is half the current gap. Return None if half the gap is too small for the
    accuracy of coarse steps.
    """
    clearance = CLEARANCE * distance
    least = LEAST_CLEARANCE * problem.impact_velocity / math.sqrt(problem.slow_stiffness)
    return clearance if clearance >= least else None


def longest_strain(moving: Motion) -> float:
    """Return the largest strain of all bonds; the gap does not count."""
    strain = moving.strain
    if not moving.at_wall:
        strain = np.delete(strain, moving.line.gap)
    return float(np.max(strain, initial=-1.0))


def coarse_ceiling(bond: Potential) -> float:
    """Return the strain up to which no bond is near breaking and coarse steps are reliable."""
    return bond.convex_strain if math.isfinite(bond.dissociation) else bond.barrier_strain


def find_end(
    problem: Problem,
    ahead: CoarseRun,
    last_contact: float,
    risk_allowed: float = RISK_ALLOWED,
    latest: float = math.inf,
) -> Ending | None:
    """
    Advance a look-ahead run until the end of the collision is proved or argued.

    `last_contact` is the time of the last contact so far. An end is argued if the risk of a return
    is at most `risk_allowed`. Return None if the motion comes near the wall, if a bond is near
    breaking, or if no end is found by the time `latest`.
    """
    particles, stiffness = problem.longest_body, problem.slow_stiffness
    watch = EndWatch(particles, problem.bond, stiffness, risk_allowed)
    interval = look_interval(particles, stiffness)
    while ahead.time <= latest:
        ending = watch.look_at(ahead.time, last_contact, ahead.moving.bodies())
        if ending is not None:
            return ending
        later = watch.next_look(ahead.time, last_contact) - ahead.time
        if not ahead.fly(max(later, interval)):
            return None
    return None


def bonds_in_flight(outcome: Outcome, duration: float) -> tuple[float, float]:
    """
    Return the extreme bond lengths in free flight for `duration` after the last contact.

    `outcome` contains the state right after the last contact; both bodies together have at least
    two particles. The bond strains are accurate to some parts in 1e3. The flight ends early if a
    bond leaves its allowed range.
    """
    problem = outcome.problem
    line, bond = problem.line, problem.bond
    target = np.zeros(line.first), np.zeros(line.first)
    if line.targets:
        target = outcome.target_displacements[::-1], outcome.target_velocities[::-1]
    strains = np.diff(np.concatenate((target[0], outcome.displacements)))
    strains[line.gap] = 0.0
    velocities = np.concatenate((target[1], outcome.velocities))
    step = coarse_step(bond, outcome.bond_min - 1.0, line.lightest)
    stepper = Stepper.of(line, bond, "verlet", step)
    moving = Motion.in_state(stepper, strains, velocities, problem.impact_velocity)
    ceiling = float(moving.run_state["strain_ceiling"])
    ahead = CoarseRun(moving, 0.0, step, ceiling=ceiling)
    ahead.fly(duration)
    run_state = ahead.moving.run_state
    return 1.0 + float(run_state["strain_min"]), 1.0 + float(run_state["strain_max"])
