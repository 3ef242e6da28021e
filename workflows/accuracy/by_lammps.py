"""Solve a scene to a tolerance with LAMMPS: choose its numerics, and measure the error."""

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.run_files import NO_FILES, RunFiles
from chaincor.lammps_inputs.scene_parts.scene_fields import TableStyle
from chaincor.lammps_inputs.schemes import COMPOSITIONS, StepSchemeName
from chaincor.workflows.accuracy.bounded_run import (
    TABLE_SENSITIVITY,
    BoundedRun,
    bounded_run,
    differences,
    error_bar,
)
from chaincor.workflows.accuracy.cost_model import cost_model
from chaincor.workflows.accuracy.pilot_run import PilotRun, pilot_run
from chaincor.workflows.accuracy.reference_runs import (
    estimate_step,
    find_step,
    largest_difference,
)
from chaincor.workflows.accuracy.refining import (
    Attempt,
    Policy,
    by_order,
    completed_attempts,
    refine,
    steps_record,
)
from chaincor.workflows.accuracy.solvers import LAMMPS, solver_of
from chaincor.workflows.accuracy.step_guess import (
    STEP_SHARE,
    effective_order,
    granular_step,
    guess_step,
    largest_step,
)
from chaincor.workflows.accuracy.step_proof import share_of_difference
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import (
    amplified_rounding,
    coarsening,
    rounding_error,
    rounding_of_steps,
)
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.engines.time_limit import time_limit
from chaincor.workflows.errors import (
    BondRangeError,
    CrossingError,
    LostAtomsError,
    RunError,
    TimestepError,
)
from chaincor.workflows.measured import measured

# The error from the bond table may be at most this fraction of the tolerance. A more accurate table
# costs little, whereas a smaller step costs much.
_TABLE_SHARE = 0.01
# The target error of the reference run is only this fraction of the tolerance, because the error
# bar includes the error of the reference run.
REFERENCE_SHARE = 0.03
# These schemes may be chosen for a tolerance, because their errors have been measured.
# SCRIPTED_SCHEMES work in scripts, LAMMPS_SCHEMES in runs that Python controls.
SCRIPTED_SCHEMES: tuple[StepSchemeName, ...] = tuple(
    name for name in COMPOSITIONS if name in measured("usual_error")
)
LAMMPS_SCHEMES: tuple[StepSchemeName, ...] = (*SCRIPTED_SCHEMES, "extrapolated12")
_ALWAYS: StepSchemeName = "order8"
# Error of a LAMMPS step, divided by the error of an equal step of the reference engine. A step of
# LAMMPS consists of kick, drift and kick; a step of the reference engine begins with a drift.
_LAMMPS_OVER_REFERENCE = 2.0
# The error of a LAMMPS run is measured by a second run, whose step is longer by this factor.
COARSER = 2.0
# Both runs together cost as much as LAMMPS_RUNS single runs. Their expected time may be at most
# _TIME_SHARE times the time that is left, because forecasts are correct only within a factor of
# two.
LAMMPS_RUNS = 1.0 + 1.0 / COARSER
_TIME_SHARE = 0.5
_MOST_REFINEMENTS = 5
# LAMMPS may raise these errors, although the reference engine has finished the collision. The cause
# is then too long a step.
_CURED_BY_STEPS = (TimestepError, LostAtomsError, CrossingError, BondRangeError)
# Extrapolated steps are used only if their rounding error is at most this fraction of the
# tolerance. The fraction affects only the cost.
_ROUNDING_SHARE = 0.4
# Largest work of Verlet steps for bonds that pass kinks, in steps times bonds. It takes about a
# minute, at some 20 ns per bond and 1 us per step.
_MOST_BOND_STEPS = 1e9


class LammpsSearch:
    """
    Search for the numerics of LAMMPS.

    Runs of the reference engine choose the numerics, and LAMMPS runs check the choice. The search
    continues with ever smaller steps or more accurate tables. Each step has a second run at twice
    the step. `sensitivity` is the rounding sensitivity of eta, 0 if it does not matter; `schemes`
    are the schemes to choose from.
    """

    def __init__(
        self,
        problem: Problem,
        target_error: float,
        sensitivity: float,
        schemes: Sequence[StepSchemeName] = LAMMPS_SCHEMES,
        files: RunFiles = NO_FILES,
    ) -> None:
        self.files = files
        self.problem, self.target_error, self.sensitivity = problem, target_error, sensitivity
        amplified = amplified_rounding("lammps", sensitivity, problem)
        self.floor = max(rounding_error("lammps", problem), amplified)
        # Target error of the step. It is at least the rounding error, below which a smaller step
        # does not help.
        self.reachable = max(target_error - self.floor, self.floor)
        solver_of(problem, (LAMMPS,))  # check that LAMMPS can run the scene
        self.pilot = pilot_run(problem, REFERENCE_SHARE * self.reachable, files=files)
        usual = usual_schemes(problem, self.reachable, schemes, sensitivity)
        self.numerics = choose_numerics(problem, self.reachable, self.pilot, usual)

    def within_time(self, numerics: Numerics) -> Numerics:
        """Return numerics with a longer, but stable, step if the runs would take too long."""
        limit, problem = time_limit(), self.problem
        if limit.end == math.inf:
            return numerics
        lasts = self.pilot.end.last_contact_time
        expected = LAMMPS_RUNS * cost_model().integration(problem, numerics, lasts)
        available = max(_TIME_SHARE * limit.left, 1e-3)
        if expected <= available:
            return numerics
        limit.was_short = True
        longest = largest_step(numerics.scheme, problem.fast_stiffness) / COARSER
        longer = min(numerics.timestep * expected / available, longest)
        return replace(numerics, timestep=max(longer, numerics.timestep))

    def attempt(self, step: float) -> Attempt[tuple[Outcome, Outcome]]:
        """Run LAMMPS at a step and at twice this step."""
        problem, reference_run, target_error = self.problem, self.pilot.reference, self.target_error
        numerics = self.numerics = replace(self.numerics, timestep=step)
        fine, coarse = lammps.run_at_steps(
            problem, numerics, (step, COARSER * step), files=self.files
        )
        order = effective_order(problem, numerics.scheme)
        steps_record = share_of_difference(order, COARSER) * largest_difference(fine, [coarse])
        error = max(steps_record, abs(fine.eta - reference_run.restitution)) + reference_run.error
        # If a late contact is in doubt in the reference run, it is also in doubt in this run.
        doubt = reference_run.outcome.ending.missed_momentum
        fine = replace(fine, ending=fine.ending.doubted(doubt))
        bar = error_bar(fine, error, self.sensitivity)
        assert bar.total is not None
        done = (
            bar.total <= target_error
            or bar.rounding + bar.ending > target_error
            or error < 0.3 * self.floor
        )
        done |= reference_run.kinked and step <= least_step(
            problem, self.pilot.end.last_contact_time
        )
        smaller = numerics
        wanted = STEP_SHARE * self.reachable
        if error > wanted:
            smaller = replace(numerics, timestep=step * by_order(wanted, error, order, 0.3))
        elif numerics.force_error is not None:
            smaller = replace(numerics, force_error=0.1 * numerics.force_error)
        else:
            done = True  # the rest of the error comes from the table or from rounding
        done |= not done and self.within_time(smaller) is not smaller
        if not done:
            self.numerics = smaller
        return Attempt(step, error, (fine, coarse), done, smaller.timestep)

    def reference_error(self) -> float:
        """Return the total error of eta in the pilot run."""
        found = self.pilot.reference
        bar = error_bar(found.outcome, found.error, self.sensitivity)
        assert bar.total is not None
        return bar.total


def solve_with_lammps(
    problem: Problem,
    target_error: float,
    sensitivity: float,
    schemes: Sequence[StepSchemeName] = LAMMPS_SCHEMES,
    files: RunFiles = NO_FILES,
) -> BoundedRun:
    """
    Solve a scene to a target error with LAMMPS, and measure the error with both engines.

    The error at a step h is the larger of two differences, plus the error of the reference run. One
    is the difference from the reference run; the other is the difference from a LAMMPS run at 2h,
    multiplied by the share that the order of the scheme predicts. For `sensitivity` and `schemes`
    see :class:`LammpsSearch`.
    """
    started = time.perf_counter()
    search = LammpsSearch(problem, target_error, sensitivity, schemes, files)
    chosen = time.perf_counter() - started
    search.numerics = search.within_time(search.numerics)
    policy = Policy(_MOST_REFINEMENTS, retried=_CURED_BY_STEPS)
    ran = completed_attempts(refine(search.numerics.timestep, search.attempt, policy))
    error, runs = ran[-1].error, ran[-1].found
    assert runs is not None
    fine, coarse = runs
    # Both LAMMPS runs may share an error, which the comparison with the reference run reveals. The
    # error of the reference run is less than its difference from its own run at the next larger
    # step.
    reference = search.pilot.reference
    apart = [differences(fine, run) for run in (coarse, search.pilot.outcome)]
    own = differences(search.pilot.outcome, reference.proofs[-1])
    farther = {name: max(each[name] for each in apart) + own[name] for name in apart[0]}
    found = bounded_run(fine, error, farther, steps_record(ran), sensitivity)
    if found.error > target_error and search.numerics.scheme not in COMPOSITIONS:
        # Composed steps cost more, but do not amplify rounding errors.
        return solve_with_lammps(problem, target_error, sensitivity, SCRIPTED_SCHEMES, files)
    found.details["choice"] |= {
        "seconds": chosen,
        "reference_restitution": reference.restitution,
        "reference_error": search.reference_error(),
        # Error bar without the reference run, from the difference between the two LAMMPS runs.
        "error_alone": found.error - error + largest_difference(fine, [coarse]),
    }
    details = found.details | {"scouting": search.pilot.beside(fine)}
    return replace(found, details=details, others=(coarse, search.pilot.outcome))


def choose_numerics(
    problem: Problem,
    tolerance: float,
    pilot: PilotRun,
    schemes: Sequence[StepSchemeName],
) -> Numerics:
    """
    Return the numerics of LAMMPS for a tolerance: scheme, step and table.

    The result has the first of `schemes` that reaches the tolerance. For unequal masses, two bodies
    and warm chains, the schemes are first sorted by their costs, each estimated from one run. If
    bonds pass kinks, the scheme is Verlet, which is then as accurate as any other scheme and far
    faster.
    """
    if problem.bond.only_pushes:
        return Numerics(scheme="verlet", timestep=granular_step(problem, tolerance))
    reference_run = pilot.reference
    numerics = Numerics(scheme="verlet", bond_range=pilot.table_range())
    # A spline cannot represent a kink. Linear interpolation can, if a row of the table lies at the
    # kink.
    style: TableStyle = "linear" if reference_run.kinked and problem.bond.kinks else "spline"
    if problem.bond.is_tabulated:
        force_error = _TABLE_SHARE * tolerance * problem.impact_velocity / TABLE_SENSITIVITY[style]
        numerics = replace(numerics, force_error=force_error)
    if reference_run.kinked:
        target_error = coarser_target_error(problem, "verlet", tolerance)
        start = guess_step(problem, "verlet", target_error)
        found = find_step(problem, "verlet", target_error, reference_run, start) or 0.1 * start
        step = max(found / COARSER, least_step(problem, pilot.end.last_contact_time))
        return replace(numerics, timestep=step, table=style)
    target_errors = {scheme: coarser_target_error(problem, scheme, tolerance) for scheme in schemes}
    guessed: Iterable[tuple[StepSchemeName, float]] = (
        (scheme, estimate)
        for scheme in schemes
        if (estimate := estimate_step(problem, scheme, target_errors[scheme], reference_run))
        is not None
    )
    if not problem.line.has_equal_masses:
        # Sort the schemes by the costs that the estimated steps imply. Long flights between
        # contacts, and heavy particles among light particles, amplify errors. Low orders, which are
        # usually cheapest, may then cost most.
        guessed = sorted(guessed, key=lambda each: STEP_SCHEMES[each[0]].evaluations / each[1])
    for scheme, guess in guessed:
        coarse = find_step(problem, scheme, target_errors[scheme], reference_run, guess)
        if coarse is not None:
            return replace(numerics, scheme=scheme, timestep=coarse / COARSER)
    raise RunError(
        f"no scheme and time step reach an error of {tolerance:.1g} here. Give a "
        "looser tolerance or a lower speed, or try engine 'reference'"
    )


def coarser_target_error(problem: Problem, scheme: StepSchemeName, target_error: float) -> float:
    """Return the error of the reference engine at `COARSER` times the step that LAMMPS needs."""
    share = share_of_difference(effective_order(problem, scheme), COARSER)
    return STEP_SHARE * target_error / (_LAMMPS_OVER_REFERENCE * share)


def least_step(problem: Problem, duration: float) -> float:
    """Return the smallest Verlet step with which a run of some duration takes about a minute."""
    return duration * problem.all_particles / _MOST_BOND_STEPS


def usual_schemes(
    problem: Problem,
    tolerance: float,
    schemes: Sequence[StepSchemeName] = LAMMPS_SCHEMES,
    sensitivity: float = 0.0,
) -> list[StepSchemeName]:
    """Return the schemes that LAMMPS can use for a tolerance, the usually cheapest one first."""
    serving = [
        scheme
        for scheme in schemes
        if is_supported_by_lammps(problem, scheme, tolerance, sensitivity)
    ]
    table = measured("lammps_schemes")
    usual = [name for name in serving if tolerance > table.get(name, math.inf)]
    # For each scheme, `table` contains the tolerance above which the scheme is usually the
    # cheapest.
    first = max(usual, key=lambda name: table[name], default=_ALWAYS)
    # The other schemes follow, those of similar order first.
    others = SCRIPTED_SCHEMES if first == "verlet" else SCRIPTED_SCHEMES[::-1]
    return [first, *(name for name in others if name != first)]


def is_supported_by_lammps(
    problem: Problem, scheme: StepSchemeName, tolerance: float, sensitivity: float = 0.0
) -> bool:
    """
    Return whether LAMMPS may use a scheme for a tolerance.

    Extrapolated steps may be used for cold chains at a wall, for which their errors were measured,
    and only if their rounding error is far enough below the tolerance. For `sensitivity` see
    :class:`LammpsSearch`.
    """
    if scheme in COMPOSITIONS:
        return True
    rounding = rounding_of_steps(problem, scheme, largest_step(scheme, problem.fast_stiffness))
    amplified = amplified_rounding("lammps", coarsening(scheme) * sensitivity, problem)
    return problem.line.is_standard and max(rounding, amplified) <= _ROUNDING_SHARE * tolerance
