"""Find the range of bond lengths between two moments of a collision."""

import math

from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.coarse_run import CoarseRun, coarse_step
from chaincor.workflows.engines.reference.moving import Motion, Stepper

# Number of steps between two checks whether the first contact has come.
_APPROACH_STEPS = 64


def bonds_from_start(outcome: Outcome) -> tuple[float, float]:
    """
    Return the extreme bond lengths from the initial state to the last contact.

    The `outcome` has the range from the first contact on. The motion before the first contact is
    followed with coarse steps. In a cold chain no bond moves before the first contact.
    """
    problem = outcome.problem
    line, bond = problem.line, problem.bond
    shortest, longest = outcome.bond_min, outcome.bond_max
    # Beads have no bond table, and fixed steps cannot follow their motion.
    if line.cold or problem.longest_body == 1 or bond.only_pushes:
        return shortest, longest
    step = coarse_step(bond, shortest - 1.0, line.lightest)
    stepper = Stepper.of(line, bond, "verlet", step)
    moving = Motion.in_state(stepper, line.strains, line.velocities, problem.impact_velocity)
    ceiling = float(moving.run_state["strain_ceiling"])
    ahead = CoarseRun(moving, 0.0, step, clearance=0.0, ceiling=ceiling)
    ahead.fly(problem.approach_time)
    low, high = (float(ahead.moving.run_state[name]) for name in ("strain_min", "strain_max"))
    return min(shortest, 1.0 + low), max(longest, 1.0 + high)


def bonds_to_contact(like: Outcome, contacts: int, last: float) -> tuple[float, float] | None:
    """
    Return the extreme bond lengths from the first contact to a later contact.

    The later contact is number `contacts` and begins at the time `last` since the first contact.
    Scheme and step are those of the reference run `like`. Return None if the motion has another
    number of contacts at `last`, or if fixed steps do not resolve the motion.
    """
    problem = like.problem
    if like.timestep is None or problem.longest_body == 1:
        return None
    step = like.timestep
    moving = Motion.at_start(problem, Stepper.of(problem.line, problem.bond, like.scheme, step))
    run_state = moving.run_state
    bookkeeping.never_argue(run_state)
    latest = math.ceil(problem.approach_time / step)
    while run_state["contacts"] == 0 and run_state["steps"] <= latest:
        if not _advance(moving, int(run_state["steps"]) + _APPROACH_STEPS):
            return None
    target_steps = math.ceil((float(run_state["first_contact"]) + last) / step) + 1
    if not _advance(moving, target_steps):
        return None
    while run_state["touching"]:  # wait until soft bodies part
        target_steps += 1
        if not _advance(moving, target_steps):
            return None
    if run_state["contacts"] != contacts:
        return None
    return 1.0 + float(run_state["contact_min"]), 1.0 + float(run_state["contact_max"])


def _advance(moving: Motion, target_steps: int) -> bool:
    """Take steps until `target_steps` are done; return whether all strains were allowed."""
    while (status := moving.advance(target_steps)) == bookkeeping.FULL:
        moving.make_room()
    return status == bookkeeping.DONE
