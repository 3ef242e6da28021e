"""Searching, with the in-house integrator, the step that meets an error."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from analysis.restitution import restitution
from lammps_inputs.bond_table import compressed_strain
from lammps_inputs.numerics import Numerics, StepSchemeName
from lammps_inputs.potential import Potential
from lammps_inputs.scene import DEFAULT_TIMESTEPS, Scene
from workflows.engines import modal, reference
from workflows.engines.compositions import COMPOSITIONS
from workflows.engines.outcome import Outcome
from workflows.engines.reference_steps import STEP_SCHEMES
from workflows.error_bars import COARSER_SHARE
from workflows.errors import CrossingError, RunError, TimestepError

# A stage of weight w is stable while 2 |w| H < 2 for the fastest mode; stay a tenth below.
_STABILITY_SHARE = 0.9
# A bond that is compressed to a curvature k needs steps shorter by sqrt(k). Typical errors of eta
# at n = 100 with the steps of DEFAULT_TIMESTEPS; only the first guess depends on them.
_USUAL_ERROR = {"verlet": 2e-6, "order4": 3e-6, "order6": 1e-7, "order8": 1e-9} | {
    "extrapolated14": 5e-9
}
# The same for steps that only the in-house engine can take, up to where they are stable.
_USUAL_STEPS: dict[str, float] = {**DEFAULT_TIMESTEPS, "extrapolated14": 0.8}
_LARGEST_EXTRAPOLATED = 1.2
# An estimate from one step is taken with this reserve.
_RESERVE = 0.3
# A second step a little smaller catches an error that happens to vanish at the first.
_NEIGHBOUR = 0.93
_MODAL_ERROR = 1e-13
_MOST_HALVINGS = 9
_MOST_TRIES = 5
# Too large a step also makes particles meet or bonds break: so many steps, each about half of the
# one before, must say the same.
_CONFIRMATIONS = 4


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


def largest_step(scheme: StepSchemeName, stiffness: float) -> float:
    """
    Return the largest step that is stable with the chain's fastest mode.

    Parameters
    ----------
    scheme : str
        Composition or extrapolation.
    stiffness : float
        U''(1).

    Returns
    -------
    float
        H.
    """
    if STEP_SCHEMES[scheme].extrapolated:
        return _LARGEST_EXTRAPOLATED / stiffness**0.5
    heaviest = max(abs(w) for w in COMPOSITIONS[scheme].weights)
    return _STABILITY_SHARE / (heaviest * stiffness**0.5)


def run_in_house(scene: Scene, scheme: StepSchemeName, timestep: float) -> Outcome:
    """
    Run the in-house integrator with one scheme and step.

    Parameters
    ----------
    scene : Scene
        The collision.
    scheme : str
        Composition or extrapolation.
    timestep : float
        H.

    Returns
    -------
    Outcome
        Raw outcome.
    """
    return reference.run(scene, Numerics(scheme=scheme, timestep=timestep))


def sharpness(scene: Scene) -> float:
    """
    Return how much faster than a harmonic bond the most compressed bond swings.

    Parameters
    ----------
    scene : Scene
        The collision.

    Returns
    -------
    float
        sqrt(U''(shortest)/U''(1)), 1 or more, by a guess at the shortest bond.
    """
    if scene.particles == 1:
        return 1.0
    # A user's own object need not be hashable.
    find = _sharpness if isinstance(scene.potential, str) else _sharpness.__wrapped__
    return find(scene.bond, scene.impact_velocity)


# A sweep asks for the same speeds with many lengths.
@lru_cache(maxsize=10_000)
def _sharpness(bond: Potential, impact_velocity: float) -> float:
    # Two particles that meet at 2 v0 have the energy v0^2 for their bond.
    strain = compressed_strain(bond, impact_velocity**2)
    curvature = float(bond.curvature(strain))
    return math.sqrt(max(1.0, curvature / bond.stiffness))


def guess_step(scene: Scene, scheme: StepSchemeName, goal: float) -> float:
    """
    Guess the step that meets an error.

    Parameters
    ----------
    scene : Scene
        The collision.
    scheme : str
        Composition or extrapolation.
    goal : float
        Error of eta wanted.

    Returns
    -------
    float
        H.
    """
    order = STEP_SCHEMES[scheme].order
    usual = _USUAL_STEPS[scheme] * (goal / _USUAL_ERROR[scheme]) ** (1.0 / order)
    stable = largest_step(scheme, scene.bond.stiffness)
    return min(stable, usual / scene.bond.stiffness**0.5) / sharpness(scene)


def is_believed(refusals: Sequence[RunError]) -> bool:
    """
    Return whether runs at ever smaller steps agree on what stops them.

    Parameters
    ----------
    refusals : sequence of RunError
        What stopped the runs since the last that was not stopped.

    Returns
    -------
    bool
        True where the last few have the same name, one that a smaller step does not cure.
    """
    kinds = [type(refusal) for refusal in refusals[-_CONFIRMATIONS:]]
    return len(kinds) == _CONFIRMATIONS and set(kinds) == {kinds[0]} - {TimestepError}


def converge(scene: Scene, goal: float) -> Converged:
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
    Converged
        The finest run.

    Raises
    ------
    RunError
        What stopped the finest run, or that steps cannot become small enough.
    """
    scheme: StepSchemeName = "order8"
    step = guess_step(scene, scheme, goal / COARSER_SHARE[scheme])
    coarse: Outcome | None = None
    refusals: list[RunError] = []
    seconds = 0.0
    for _ in range(_MOST_HALVINGS):
        try:
            fine = run_in_house(scene, scheme, step)
        except RunError as error:
            refusals.append(error)
            if is_believed(refusals):
                raise
            coarse, step = None, 0.5 * step
            continue
        refusals.clear()
        seconds += fine.seconds
        if coarse is not None:
            difference = abs(eta_of(scene, fine) - eta_of(scene, coarse))
            error_bar = COARSER_SHARE[scheme] * difference
            if error_bar <= goal and len(fine.contact_times) == len(coarse.contact_times):
                return Converged(fine, eta_of(scene, fine), error_bar, seconds)
        coarse, step = fine, 0.5 * step
    if refusals:
        raise refusals[-1]
    raise RunError(
        f"no step was found that resolves this collision to {goal:.1g}; expected bonds that are "
        "not compressed to nothing: lower the speed, or use engine 'reference'"
    )


def exact_modes(scene: Scene) -> Converged:
    """
    Return the exact collision of a harmonic chain, for LAMMPS to follow.

    Parameters
    ----------
    scene : Scene
        A harmonic chain.

    Returns
    -------
    Converged
        With the rounding of modes as its error.

    Raises
    ------
    CrossingError
        If particles pass through each other, which LAMMPS cannot follow.
    """
    outcome = modal.run(scene)
    if outcome.crossed:
        raise CrossingError(
            f"particles of a harmonic chain pass through each other at velocity "
            f"{scene.impact_velocity:g}, which LAMMPS cannot represent (it knows only the "
            "absolute bond length); expected less than about 0.69: use engine 'reference'"
        )
    return Converged(outcome, eta_of(scene, outcome), _MODAL_ERROR, outcome.seconds)


def error_near(scene: Scene, scheme: StepSchemeName, timestep: float, truth: float) -> float:
    """
    Return the error of eta at a step, or at one a little smaller if that is larger.

    Parameters
    ----------
    scene : Scene
        The collision.
    scheme : str
        Composition or extrapolation.
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


def jitter(scene: Scene, scheme: StepSchemeName, timestep: float, eta: float) -> float:
    """
    Return how much eta changes when all roundings change.

    Parameters
    ----------
    scene : Scene
        The collision.
    scheme : str
        Composition.
    timestep : float
        H.
    eta : float
        The in-house eta with this scheme and step.

    Returns
    -------
    float
        Largest change for impact velocities a few units in the last place away.
    """
    v0 = scene.impact_velocity
    worst = 0.0
    for ulps in (-5.0, 3.0):
        nudged = scene.replace(speed=None, velocity=v0 * (1.0 + ulps * sys.float_info.epsilon))
        worst = max(worst, abs(eta_of(nudged, run_in_house(nudged, scheme, timestep)) - eta))
    return worst


def estimate_step(scene: Scene, scheme: StepSchemeName, goal: float, truth: float) -> float | None:
    """
    Estimate, from one run, the step whose error is a goal.

    Parameters
    ----------
    scene : Scene
        The collision.
    scheme : str
        Composition or extrapolation.
    goal : float
        Error of eta wanted.
    truth : float
        Converged eta.

    Returns
    -------
    float or None
        H, with a reserve; None where even a much smaller step does not run.
    """
    order = STEP_SCHEMES[scheme].order
    step = guess_step(scene, scheme, goal)
    for _ in range(_MOST_TRIES):
        try:
            error = abs(eta_of(scene, run_in_house(scene, scheme, step)) - truth)
        except RunError:
            step *= 0.4
            continue
        growth = (_RESERVE * goal / max(error, 1e-17)) ** (1.0 / order)
        return min(largest_step(scheme, scene.bond.stiffness), step * min(max(growth, 0.1), 3.0))
    return None


def find_step(
    scene: Scene, scheme: StepSchemeName, goal: float, truth: float, start: float
) -> float | None:
    """
    Return a step whose error is within a goal, near the largest.

    Parameters
    ----------
    scene : Scene
        The collision.
    scheme : str
        Composition or extrapolation.
    goal : float
        Error of eta wanted.
    truth : float
        Converged eta.
    start : float
        First step to try.

    Returns
    -------
    float or None
        H; None if none was found.
    """
    order = STEP_SCHEMES[scheme].order
    step = start
    for _ in range(_MOST_TRIES):
        error = error_near(scene, scheme, step, truth)
        if error <= goal:
            return step
        shrink = 0.25 if math.isinf(error) else (_RESERVE * goal / error) ** (1.0 / order)
        step *= min(max(shrink, 0.25), 0.8)
    return None
