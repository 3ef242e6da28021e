"""Searching, with the in-house integrator, the step that meets an error."""

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.convergence import Converged
from chaincor.workflows.accuracy.in_house_runs import eta_of, run_in_house
from chaincor.workflows.accuracy.refining import Policy, Try, by_order, refine
from chaincor.workflows.accuracy.step_guess import effective_order, guess_step, largest_step

# An estimate from one step is taken with this reserve: the next step's error is a different draw,
# and to miss the goal costs another search, while 0.3 costs a tenth of the step at order 8. It
# decides costs only, as the step found is proved.
_RESERVE = 0.3
_MOST_TRIES = 5


def _error_at(scene: Scene, scheme: StepSchemeName, step: float, truth: Converged) -> float:
    """Return the error of eta at a step; RunError where it is too large to run at all."""
    outcome = run_in_house(scene, scheme, step, truth.outcome)
    return max(abs(eta_of(scene, outcome) - truth.restitution), 1e-17)


def estimate_step(
    scene: Scene, scheme: StepSchemeName, goal: float, truth: Converged
) -> float | None:
    """
    Estimate, from one run and with a reserve, the step whose error is a goal.

    None where even a much smaller step does not run.
    """
    order = effective_order(scene, scheme)

    def attempt(step: float) -> Try[float]:
        error = _error_at(scene, scheme, step, truth)
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
        error = _error_at(scene, scheme, step, truth)
        smaller = step * by_order(_RESERVE * goal, error, order, 0.25)
        return Try(step, error, error, done=error <= goal, following=smaller)

    last = refine(start, attempt, Policy(_MOST_TRIES, refused=0.25, believed=False))[-1]
    return last.step if last.done else None
