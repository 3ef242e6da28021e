"""Searching, with the in-house integrator, the step that meets an error."""

import math

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.convergence import Converged
from chaincor.workflows.accuracy.in_house_runs import eta_of, run_in_house
from chaincor.workflows.accuracy.refining import Policy, Try, by_order, refine
from chaincor.workflows.accuracy.step_guess import effective_order, guess_step, largest_step
from chaincor.workflows.errors import RunError

# An estimate from one step is taken with this reserve: the next step's error is a different draw,
# and to miss the goal costs another search, while 0.3 costs a tenth of the step at order 8. It
# decides costs only, as the step found is proved.
_RESERVE = 0.3
# A second step a little smaller catches an error that happens to vanish at the first: far enough
# for other phases of the contacts, near enough for the same size of error.
_NEIGHBOUR = 0.93
_MOST_TRIES = 5


def _error_near(scene: Scene, scheme: StepSchemeName, timestep: float, truth: Converged) -> float:
    """
    Return the error of eta at a step, or at one a little smaller if that is larger.

    It is inf where the step is too large to run at all.
    """
    worst = 0.0
    for step in (timestep, _NEIGHBOUR * timestep):
        try:
            outcome = run_in_house(scene, scheme, step, truth.outcome)
        except RunError:
            return math.inf
        worst = max(worst, abs(eta_of(scene, outcome) - truth.restitution))
    return worst


def estimate_step(
    scene: Scene, scheme: StepSchemeName, goal: float, truth: Converged
) -> float | None:
    """
    Estimate, from one run and with a reserve, the step whose error is a goal.

    None where even a much smaller step does not run.
    """
    order = effective_order(scene, scheme)

    def attempt(step: float) -> Try[float]:
        outcome = run_in_house(scene, scheme, step, truth.outcome)
        error = max(abs(eta_of(scene, outcome) - truth.restitution), 1e-17)
        growth = by_order(_RESERVE * goal, error, order, 0.1, 3.0)
        return Try(step, error, growth, done=True)

    policy = Policy(_MOST_TRIES, refused=0.4, believed=False)
    last = refine(guess_step(scene, scheme, goal), attempt, policy)[-1]
    if last.found is None:
        return None
    return min(largest_step(scheme, scene.fast_stiffness), last.step * last.found)


def find_step(
    scene: Scene, scheme: StepSchemeName, goal: float, truth: Converged, start: float
) -> float | None:
    """Return a step whose error is within a goal, near the largest; None if none was found."""
    order = effective_order(scene, scheme)

    def attempt(step: float) -> Try[float]:
        error = _error_near(scene, scheme, step, truth)
        smaller = step * by_order(_RESERVE * goal, error, order, 0.25)
        return Try(step, error, error, done=error <= goal, following=smaller)

    last = refine(start, attempt, Policy(_MOST_TRIES))[-1]
    return last.step if last.done else None
