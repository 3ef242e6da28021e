"""The reference solution: the in-house integrator, refined until it has converged."""

from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.in_house_runs import eta_of
from chaincor.workflows.accuracy.irregular import refine_irregularly
from chaincor.workflows.accuracy.regular import refine_regularly
from chaincor.workflows.accuracy.step_guess import is_smooth
from chaincor.workflows.engines.in_house import modal
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import rounding_error
from chaincor.workflows.errors import CrossingError

# Of the exact propagator, which only rounds: against itself in higher precision it is below this.
MODAL_ERROR = 1e-13
# What steps of LAMMPS are tried with in-house is compiled for this one, too.
_SCHEME: StepSchemeName = "order8"


@dataclass(frozen=True)
class Converged:
    """A collision by the in-house integrator, refined until runs at several steps agree."""

    outcome: Outcome  #: The finest run.
    #: The run at the next larger step, which differs by more than the error; the same where it has
    #: no step.
    coarse: Outcome
    restitution: float  #: Its eta.
    error: float  #: Its error, rounding included.
    seconds: float  #: Integration time of all runs it took.
    kinked: bool = False  #: Whether bonds pass kinks, where no scheme has an order above 2.


def converge(scene: Scene, goal: float) -> Converged:
    """
    Refine the in-house integrator until its error is below a goal, or steps help no more.

    Raises RunError, what stopped the finest runs.
    """
    floor = rounding_error("reference", scene)
    if is_smooth(scene):
        found = refine_regularly(scene, goal, _SCHEME, floor, None)
    else:
        found = refine_irregularly(scene, goal, floor)
    eta, error = eta_of(scene, found.fine), found.error + floor
    return Converged(found.fine, found.proofs[-1], eta, error, found.seconds, found.kinked)


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
    return Converged(outcome, outcome, eta_of(scene, outcome), error, outcome.seconds)


def modal_error(scene: Scene) -> float:
    """
    Return the error of eta of an exact propagation, beyond that of a plain chain at a wall.

    Light particles between heavy ones, and long bodies that bounce often, amplify rounding: what
    some changes of all roundings change, with a reserve of three.
    """
    return 0.0 if scene.line.plain else 3.0 * modal.rounding_sensitivity(scene)
