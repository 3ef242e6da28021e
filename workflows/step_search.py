"""Searching, with the in-house integrator, the step that meets an error."""

import math
from dataclasses import dataclass

from analysis.restitution import restitution
from lammps_inputs.numerics import Numerics
from lammps_inputs.scene import DEFAULT_TIMESTEPS, Scene, Scheme
from workflows.engines import reference
from workflows.engines.compositions import COMPOSITIONS
from workflows.engines.outcome import Outcome
from workflows.errors import CrossingError, RunError

# A stage of weight w is stable while 2 |w| H < 2 for the fastest mode; stay a tenth below.
_STABILITY_SHARE = 0.9
# A second step a little smaller catches an error that happens to vanish at the first.
_NEIGHBOUR = 0.93
_CONVERGENCE_SHARE = {"order8": 0.125}
_MOST_HALVINGS = 9
_MOST_TRIES = 5


@dataclass(frozen=True)
class Converged:
    """
    A collision by the in-house integrator, refined until two steps agree.

    Attributes
    ----------
    outcome : Outcome
        The finer run.
    restitution : float
        Its eta.
    error : float
        Its error, from the difference to twice the step.
    seconds : float
        Integration time of all runs it took.
    """

    outcome: Outcome
    restitution: float
    error: float
    seconds: float


def eta_of(scene: Scene, outcome: Outcome) -> float:
    """
    Return the restitution of an outcome.

    Parameters
    ----------
    scene : Scene
        The collision.
    outcome : Outcome
        A run of it.

    Returns
    -------
    float
        eta.
    """
    return float(restitution(outcome.velocities, scene.impact_velocity))


def largest_step(scheme: Scheme, stiffness: float) -> float:
    """
    Return the largest composed step that is stable with the chain's fastest mode.

    Parameters
    ----------
    scheme : str
        Composition.
    stiffness : float
        U''(1).

    Returns
    -------
    float
        H.
    """
    heaviest = max(abs(w) for w in COMPOSITIONS[scheme].weights)
    return _STABILITY_SHARE / (heaviest * stiffness**0.5)


def run_in_house(scene: Scene, scheme: Scheme, timestep: float) -> Outcome:
    """
    Run the in-house integrator with one scheme and step.

    Parameters
    ----------
    scene : Scene
        The collision.
    scheme : str
        Composition.
    timestep : float
        H.

    Returns
    -------
    Outcome
        Raw outcome.
    """
    return reference.run(scene, Numerics(scheme=scheme, timestep=timestep))


def converge(scene: Scene, goal: float) -> Converged | None:
    """
    Refine the in-house integrator until its error is below a goal.

    Parameters
    ----------
    scene : Scene
        The collision.
    goal : float
        Error of eta wanted.

    Returns
    -------
    Converged or None
        None where steps cannot become small enough.

    Raises
    ------
    CrossingError
        If particles would pass through each other whatever the step.
    """
    step = DEFAULT_TIMESTEPS["order8"] * min(2.0, max(0.5, (goal / 1e-9) ** 0.125))
    coarse: Outcome | None = None
    seconds = 0.0
    for _ in range(_MOST_HALVINGS):
        try:
            fine = run_in_house(scene, "order8", step)
        except CrossingError:
            raise
        except RunError:
            coarse, step = None, 0.5 * step
            continue
        seconds += fine.seconds
        if coarse is not None:
            difference = abs(eta_of(scene, fine) - eta_of(scene, coarse))
            error = _CONVERGENCE_SHARE["order8"] * difference
            if error <= goal and len(fine.contact_times) == len(coarse.contact_times):
                return Converged(fine, eta_of(scene, fine), error, seconds)
        coarse, step = fine, 0.5 * step
    return None


def error_near(scene: Scene, scheme: Scheme, timestep: float, truth: float) -> float:
    """
    Return the error of eta at a step, or at one a little smaller if that is larger.

    Parameters
    ----------
    scene : Scene
        The collision.
    scheme : str
        Composition.
    timestep : float
        H.
    truth : float
        Converged eta.

    Returns
    -------
    float
        Error; inf where the step is too large to run at all.
    """
    worst = 0.0
    for step in (timestep, _NEIGHBOUR * timestep):
        try:
            outcome = run_in_house(scene, scheme, step)
        except RunError:
            return math.inf
        worst = max(worst, abs(eta_of(scene, outcome) - truth))
    return worst


def find_step(scene: Scene, scheme: Scheme, goal: float, truth: float) -> float | None:
    """
    Return the largest step found whose error is within a goal.

    Parameters
    ----------
    scene : Scene
        The collision.
    scheme : str
        Composition.
    goal : float
        Error of eta wanted.
    truth : float
        Converged eta.

    Returns
    -------
    float or None
        H; None if none was found.
    """
    order = COMPOSITIONS[scheme].order
    most = largest_step(scheme, scene.bond.stiffness)
    step = min(most, DEFAULT_TIMESTEPS[scheme] * (goal / 1e-6) ** (1.0 / order))
    best = None
    for _ in range(_MOST_TRIES):
        error = error_near(scene, scheme, step, truth)
        if error <= goal:
            best = step if best is None else max(best, step)
            if error > 0.1 * goal or step >= most:
                break
        elif best is not None:
            break
        growth = 0.25 if math.isinf(error) else (0.6 * goal / max(error, 1e-17)) ** (1.0 / order)
        step = min(most, step * min(max(growth, 0.25), 3.0))
    return best
