"""Solve scenes to a tolerance with the reference engine."""

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
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import hard_sphere, modal
from chaincor.workflows.engines.rounding import rounding_error, rounding_matters
from chaincor.workflows.errors import CrossingError, RunError
from chaincor.workflows.measured import measured

# The error of an adaptive run is estimated from its differences from two runs with ten times and a
# hundred times its target error. The estimate is the larger of both differences, each multiplied by
# one of these ratios. The lower limit of 0.3 is nearly three times the largest ratio among 20
# scenes, because 20 scenes are few.
_ADAPTIVE_SHARES = tuple(measured("adaptive_share", 0.3) * weight for weight in (1.0, 0.4))
# If bonds have kinks, the error falls irregularly. As for fixed steps, the ratios are therefore
# three times as large as without kinks.
_IRREGULAR_SHARES = tuple(3.0 * share for share in _ADAPTIVE_SHARES)
# Columns of beads have many kinks and therefore other ratios. Among 665 random columns of 2 to 15
# beads at three accuracies, the errors of 5 runs in 2000 exceed the bound with the ratios 3.0 and
# 1.0, by a factor of at most 1.45.
_BEAD_SHARES = (4.0, 1.5)
_MOST_REFINEMENTS = 15
# If adaptive steps would take hours, the limit of hard spheres is used, with its own error bar,
# provided that this error is at most _ROUGH_SPHERES.
_ROUGH_SPHERES = 1e-3
# The exact propagator has only rounding errors. A comparison with higher precision shows that these
# errors are below this limit.
MODAL_ERROR = 1e-13


def solve_with_reference(
    problem: Problem, target_error: float, sensitivity: float, known: Outcome | None = None
) -> BoundedRun:
    """
    Solve a scene with the cheapest solver of the reference engine, an exact one if possible.

    `sensitivity` is the rounding sensitivity of eta, 0 if it does not matter. `known` is an outcome
    of this collision whose end is known; without it, this function searches for the end.
    """
    solver = solver_of(problem, REFERENCE_SOLVERS)
    if solver is EXACT_MODES:
        outcome = EXACT_MODES.run(problem)
        return bounded_run(outcome, modal_error(problem), outcome)
    if solver is FIXED_STEPS:
        if problem.is_smooth:
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
    """Return the limit of hard spheres; the errors of times, speeds and modes are unknown."""
    return bounded_run(HARD_SPHERES.run(problem), deviation, {})


def _solve_irregularly(problem: Problem, target_error: float, sensitivity: float) -> BoundedRun:
    """Refine the steps without assuming an order, because bonds of users may have kinks."""
    found = refine_irregularly(problem, target_error, rounding_error("reference", problem))
    if found.stalled or rounding_matters("reference", problem, target_error):
        sensitivity = sensitivity or find_rounding_sensitivity(problem)
    return bounded_run(found.outcome, found.error, found.proofs[0], found.tries, sensitivity)


def _solve_with_adaptive_steps(problem: Problem, target_error: float) -> BoundedRun:
    """Run the adaptive engine at increasing accuracy until three runs agree."""
    floor = rounding_error("reference", problem)
    shares = _ADAPTIVE_SHARES if problem.bond.smooth else _IRREGULAR_SHARES
    shares = _BEAD_SHARES if problem.bond.only_pushes else shares
    accuracy = max(target_error, floor)
    runs = [ADAPTIVE_STEPS.run(problem, None, k * accuracy) for k in (1.0, 10.0)]

    def attempt(accuracy: float) -> Attempt[Outcome]:
        fine = ADAPTIVE_STEPS.run(problem, None, accuracy)
        # Two differences are used, because one difference may be small by chance, and because the
        # error sometimes shrinks by less than a factor of ten.
        eta = fine.eta
        error = max(share * abs(run.eta - eta) for share, run in zip(shares, runs[:2], strict=True))
        runs.insert(0, fine)
        done = error + floor <= target_error or accuracy < 1e-14
        return Attempt(accuracy, error, fine, done, 0.1 * accuracy)

    tries = refine(0.1 * accuracy, attempt, Policy(_MOST_REFINEMENTS, retried=()))
    return bounded_run(runs[0], tries[-1].error, runs[1], steps_record(tries, "accuracy"))


def converge(problem: Problem, target_error: float) -> ConvergedRun:
    """
    Run the reference engine at ever smaller steps until its error is below a target.

    The refinement also ends if smaller steps do not help. Results for harmonic chains are exact.
    The error includes rounding. Raises the RunError that stopped the smallest steps.
    """
    if EXACT_MODES.supports(problem):
        return exact_modes(problem)
    floor = rounding_error("reference", problem)
    if problem.bond.only_pushes:
        solved = _solve_with_adaptive_steps(problem, target_error)
        run, step = solved.outcome, solved.bar.step or 0.0
        return ConvergedRun(run, [*solved.others], run.eta, step + floor, run.seconds)
    if problem.is_smooth:
        # Trial steps for LAMMPS also use this scheme; its loop is then compiled already.
        found = refine_regularly(problem, target_error, "order8", floor, None)
    else:
        found = refine_irregularly(problem, target_error, floor)
    return replace(found, error=found.error + floor)


def exact_modes(problem: Problem) -> ConvergedRun:
    """
    Return the exact result for a harmonic chain, for comparison with LAMMPS.

    Its only error is rounding in the modes. Raises CrossingError if particles pass through each
    other, because LAMMPS cannot compute this motion.
    """
    outcome = EXACT_MODES.run(problem)
    if outcome.crossed:
        raise CrossingError(
            "particles of a harmonic chain pass through each other at velocity "
            f"{problem.impact_velocity:g}. LAMMPS knows only the absolute bond length and cannot "
            "represent this motion. Use engine 'reference', or a velocity below about 0.69"
        )
    error = max(MODAL_ERROR, modal_error(problem))
    return ConvergedRun(outcome, [outcome], outcome.eta, error, outcome.seconds)


def modal_error(problem: Problem) -> float:
    """
    Return the additional error of eta in an exact propagation of unusual bodies.

    The error is zero for a cold chain of equal masses at a wall. Light particles between heavy
    ones, and long bodies with many contacts, amplify rounding. Their error is three times the
    largest change of eta when all rounding errors change.
    """
    return 0.0 if problem.line.is_standard else 3.0 * modal.rounding_sensitivity(problem)
