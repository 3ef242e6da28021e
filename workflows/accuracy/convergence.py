"""Refining the in-house integrator until it has converged."""

import math
import sys
from dataclasses import dataclass

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.in_house_runs import eta_of, run_in_house
from chaincor.workflows.accuracy.irregular import refine_irregularly
from chaincor.workflows.accuracy.refining import Policy, Try, refine, that_ran
from chaincor.workflows.accuracy.step_guess import guess_step, is_smooth
from chaincor.workflows.engines.in_house import modal, stepping
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.errors import CrossingError, RunError

# Of the exact propagator, which only rounds: against itself in higher precision it is below this.
MODAL_ERROR = 1e-13
# Error over the difference of two runs, at h and 2h, that no third one checks: by theory 0.004; so
# much is what 300 scenes that break and graze needed.
SHARE_ALONE = 0.4
# A guess is wrong by less than 500; what so small a step does not resolve, none of use will.
_MOST_HALVINGS = 9
# Steps for this error resolve whatever amplifies rounding.
_SENSITIVITY_GOAL = 1e-9


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
    kinked : bool
        Whether bonds pass kinks, where no scheme has an order above 2.
    """

    outcome: Outcome
    restitution: float
    error: float
    seconds: float
    kinked: bool = False


def converge(scene: Scene, goal: float) -> Converged:
    """
    Refine the in-house integrator until its error is below a goal.

    Of bonds whose smoothness is not known, the error may be above the goal. Raises RunError, what
    stopped the finest run, or that steps cannot become small enough.
    """
    scheme: StepSchemeName = "order8"
    if not is_smooth(scene):
        found = refine_irregularly(scene, goal, scheme)
        eta = eta_of(scene, found.fine)
        return Converged(found.fine, eta, found.error, found.seconds, found.kinked)
    halving = _Halving(scene, scheme, goal)
    step = guess_step(scene, scheme, goal / SHARE_ALONE)
    last = refine(step, halving.attempt, Policy(_MOST_HALVINGS))[-1]
    if last.refusal is not None:
        raise last.refusal
    if last.found is None or not last.done:
        raise RunError(
            f"no step was found that resolves this collision to {goal:.1g}; expected bonds that "
            "are not compressed to nothing: lower the speed, or use engine 'reference'"
        )
    return Converged(last.found, eta_of(scene, last.found), last.error, halving.seconds)


@dataclass
class _Halving:
    """Runs at steps of which each is half of the one before, with which it is compared."""

    scene: Scene
    scheme: StepSchemeName
    goal: float
    known: Outcome | None = None
    coarse: Outcome | None = None
    seconds: float = 0.0

    def attempt(self, step: float) -> Try[Outcome]:
        scene, coarse, self.coarse = self.scene, self.coarse, None
        fine = run_in_house(scene, self.scheme, step, self.known)
        self.known, self.coarse = self.known or fine, fine
        self.seconds += fine.seconds
        error, alike = math.inf, False
        if coarse is not None:
            error = SHARE_ALONE * abs(eta_of(scene, fine) - eta_of(scene, coarse))
            alike = len(fine.contact_times) == len(coarse.contact_times)
        return Try(step, error, fine, error <= self.goal and alike, 0.5 * step)


def exact_modes(scene: Scene) -> Converged:
    """
    Return the exact collision of a harmonic chain, for LAMMPS to follow.

    Its error is the rounding of modes. Raises CrossingError if particles pass through each other,
    which LAMMPS cannot follow.
    """
    outcome = modal.run(scene)
    if outcome.crossed:
        raise CrossingError(
            f"particles of a harmonic chain pass through each other at velocity "
            f"{scene.impact_velocity:g}, which LAMMPS cannot represent (it knows only the "
            "absolute bond length); expected less than about 0.69: use engine 'reference'"
        )
    error = max(MODAL_ERROR, modal_error(scene))
    return Converged(outcome, eta_of(scene, outcome), error, outcome.seconds)


def modal_error(scene: Scene) -> float:
    """
    Return the error of eta of an exact propagation, beyond that of a plain chain at a wall.

    Light particles between heavy ones, and long bodies that bounce often, amplify rounding: what
    some changes of all roundings change, with a reserve of three.
    """
    return 0.0 if scene.line.plain else 3.0 * modal.rounding_sensitivity(scene)


def nudged_change(
    scene: Scene, scheme: StepSchemeName, step: float, plain: Outcome, enough: float = math.inf
) -> float:
    """
    Return how much eta of a run changes for impact velocities a few units of rounding away.

    That is the largest change, or the first that is `enough`.
    """
    worst, eta = 0.0, eta_of(scene, plain)
    for ulps in (-5.0, 3.0):
        change = 1.0 + ulps * sys.float_info.epsilon
        if scene.line.uniform:
            nudged, near = scene.replace(speed=None, velocity=change * scene.impact_velocity), step
        else:  # given velocities are not changed: another step rounds everything as well
            nudged, near = scene, change * step
        other = run_in_house(nudged, scheme, near, plain)
        worst = max(worst, abs(eta_of(nudged, other) - eta))
        if worst >= enough:
            break
    return worst


def find_rounding_sensitivity(scene: Scene) -> float:
    """
    Return how much eta changes when all roundings change.

    That is the largest change for impact velocities a few units in the last place away, with a step
    that depends on the scene alone; for bonds that fixed steps can follow.
    """
    # A warm chain that comes slowly is thrown back to the target long after it was there.
    follow = scene.temperature is not None

    def attempt(step: float) -> Try[float]:
        plain = stepping.run(scene, Numerics(scheme="order8", timestep=step), follow=follow)
        return Try(step, 0.0, nudged_change(scene, "order8", step, plain), done=True)

    step = guess_step(scene, "order8", _SENSITIVITY_GOAL)
    found = that_ran(refine(step, attempt, Policy(_MOST_HALVINGS + 1)))[-1].found
    assert found is not None
    return found
