"""Solve scenes to a tolerance with the reference engine, and converge runs for other engines."""

from dataclasses import replace

from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.accuracy.bounded_run import BoundedRun, bounded_run
from chaincor.workflows.accuracy.fixed_steps import refine_regularly, solve_with_fixed_steps
from chaincor.workflows.accuracy.irregular import refine_irregularly
from chaincor.workflows.accuracy.reference_runs import (
    ConvergedRun,
    find_rounding_sensitivity,
)
from chaincor.workflows.accuracy.refining import Attempt, Policy, refine, steps_record
from chaincor.workflows.accuracy.solvers import (
    ADAPTIVE_STEPS,
    EXACT_MODES,
    FIXED_STEPS,
    HARD_SPHERES,
    REFERENCE_SOLVERS,
    solver_of,
)
from chaincor.workflows.accuracy.step_guess import is_smooth
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import hard_sphere, modal
from chaincor.workflows.engines.rounding import rounding_error, rounding_matters
from chaincor.workflows.errors import CrossingError, RunError
from chaincor.workflows.measured import measured

# The error of an adaptive run, divided by its differences to runs at ten and a hundred times its
# accuracy. The lower limit of 0.3 is nearly three times the largest value of 20 scenes, because
# these scenes are few.
_ADAPTIVE_SHARES = tuple(measured("adaptive_share", 0.3) * weight for weight in (1.0, 0.4))
# Kinks make the error fall irregularly, so the shares are three times as large as without kinks, as
# for fixed steps.
_IRREGULAR_SHARES = tuple(3.0 * share for share in _ADAPTIVE_SHARES)
# Columns of beads have many kinks, so they have shares of their own. In 665 random columns of 2 to
# 15 beads at three accuracies, 5 runs in 2000 exceed the larger of 3.0 and 1.0 times the
# differences, by a factor of 1.45 at most.
_BEAD_SHARES = (4.0, 1.5)
_MOST_REFINEMENTS = 15
# If adaptive steps would take hours, the limit of hard spheres is used with its own error bar,
# provided that it is good to three digits.
_ROUGH_SPHERES = 1e-3
# The exact propagator has rounding errors alone. A comparison with higher precision shows that they
# are below this limit.
MODAL_ERROR = 1e-13


def solve_with_reference(
    problem: Problem, target_error: float, sensitivity: float, known: Outcome | None = None
) -> BoundedRun:
    """
    Run a scene with the cheapest reference solver, an exact one if possible.

    `sensitivity` is the rounding sensitivity of eta, if it matters. `known` is the collision
    followed to its end at some step; by default this is done here.
    """
    solver = solver_of(problem, REFERENCE_SOLVERS)
    if solver is EXACT_MODES:
        outcome = EXACT_MODES.run(problem)
        return bounded_run(outcome, modal_error(problem), outcome)
    if solver is FIXED_STEPS:
        if is_smooth(problem):
            return solve_with_fixed_steps(problem, target_error, sensitivity, known)
        return _solve_irregularly(problem, target_error, sensitivity)
    if problem.bond.only_pushes:
        return _solve_with_adaptive_steps(problem, target_error)
    deviation = hard_sphere.deviation(problem)
    reached = deviation + rounding_error("reference", problem)
    refused = ADAPTIVE_STEPS.refusal(problem)
    if reached <= target_error or (refused is not None and deviation <= _ROUGH_SPHERES):
        return _as_spheres(problem, deviation)
    if refused is not None:
        raise RunError(
            f"{refused}, and the limit of hard spheres has an error of up to {deviation:.1g}. "
            "Take fewer particles or another speed"
        )
    stepped = _solve_with_adaptive_steps(problem, target_error)
    return _as_spheres(problem, deviation) if reached < stepped.error else stepped


def _as_spheres(problem: Problem, deviation: float) -> BoundedRun:
    """Return the result of hard spheres; the errors of its times, speeds and modes are unknown."""
    return bounded_run(HARD_SPHERES.run(problem), deviation, {})


def _solve_irregularly(problem: Problem, target_error: float, sensitivity: float) -> BoundedRun:
    """Refine without assuming an order, because bonds of users may have kinks."""
    found = refine_irregularly(problem, target_error, rounding_error("reference", problem))
    if found.stalled or rounding_matters("reference", problem, target_error):
        sensitivity = sensitivity or find_rounding_sensitivity(problem)
    return bounded_run(found.outcome, found.error, found.proofs[0], found.tries, sensitivity)


def _solve_with_adaptive_steps(problem: Problem, target_error: float) -> BoundedRun:
    """Run the adaptive integrator at increasing accuracy until three runs agree."""
    floor = rounding_error("reference", problem)
    shares = _ADAPTIVE_SHARES if problem.bond.smooth else _IRREGULAR_SHARES
    shares = _BEAD_SHARES if problem.bond.only_pushes else shares
    accuracy = max(target_error, floor)
    runs = [ADAPTIVE_STEPS.run(problem, None, k * accuracy) for k in (1.0, 10.0)]

    def attempt(accuracy: float) -> Attempt[Outcome]:
        fine = ADAPTIVE_STEPS.run(problem, None, accuracy)
        # The error sometimes shrinks by less than ten, and one difference can be small by chance.
        eta = fine.eta
        error = max(share * abs(run.eta - eta) for share, run in zip(shares, runs[:2], strict=True))
        runs.insert(0, fine)
        done = error + floor <= target_error or accuracy < 1e-14
        return Attempt(accuracy, error, fine, done, 0.1 * accuracy)

    tries = refine(0.1 * accuracy, attempt, Policy(_MOST_REFINEMENTS, retried=()))
    return bounded_run(runs[0], tries[-1].error, runs[1], steps_record(tries, "accuracy"))


def converge(problem: Problem, target_error: float) -> ConvergedRun:
    """
    Refine the reference engine until its error is below a target, or finer steps do not help.

    Harmonic chains are exact. The error includes rounding. Raises the RunError that stopped the
    finest runs.
    """
    if EXACT_MODES.supports(problem):
        return exact_modes(problem)
    floor = rounding_error("reference", problem)
    if problem.bond.only_pushes:
        solved = _solve_with_adaptive_steps(problem, target_error)
        run, step = solved.outcome, solved.bar.step or 0.0
        return ConvergedRun(run, [*solved.others], run.eta, step + floor, run.seconds)
    if is_smooth(problem):
        # Trial steps for LAMMPS use this compiled scheme, too.
        found = refine_regularly(problem, target_error, "order8", floor, None)
    else:
        found = refine_irregularly(problem, target_error, floor)
    return replace(found, error=found.error + floor)


def exact_modes(problem: Problem) -> ConvergedRun:
    """
    Return the exact collision of a harmonic chain, for comparison with LAMMPS.

    Its error is the rounding of modes. Raises CrossingError if particles pass through each other,
    which LAMMPS cannot follow.
    """
    outcome = EXACT_MODES.run(problem)
    if outcome.crossed:
        raise CrossingError(
            "particles of a harmonic chain pass through each other at velocity "
            f"{problem.impact_velocity:g}, which LAMMPS cannot represent because it knows "
            "only the absolute bond length. Use engine 'reference', or a velocity below "
            "about 0.69"
        )
    error = max(MODAL_ERROR, modal_error(problem))
    return ConvergedRun(outcome, [outcome], outcome.eta, error, outcome.seconds)


def modal_error(problem: Problem) -> float:
    """
    Return the error of eta of an exact propagation, beyond that of a plain chain at a wall.

    Light particles between heavy ones, and long bodies with many contacts, amplify rounding. The
    error is three times the largest effect of several changes of all rounding errors.
    """
    return 0.0 if problem.line.is_standard else 3.0 * modal.rounding_sensitivity(problem)
