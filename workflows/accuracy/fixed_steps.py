"""Solve scenes with smooth bonds to a tolerance, with fixed steps."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.bounded_run import BoundedRun, bounded_run, ending_error
from chaincor.workflows.accuracy.reference_runs import (
    LONG,
    ConvergedRun,
    differ,
    difference_to,
    nudged_change,
    refined,
    run_reference,
)
from chaincor.workflows.accuracy.refining import Attempt, Policy, by_order, refine
from chaincor.workflows.accuracy.step_guess import STEP_SHARE, effective_order, guess_step
from chaincor.workflows.accuracy.step_proof import (
    COARSER,
    distinguishing_step,
    proved_error,
    usual_share,
)
from chaincor.workflows.engines.ending import sound_round_trip
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import amplified_rounding, rounding_error, rounding_matters
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.measured import measured

# For each scheme, the target error above which it is usually the cheapest.
_SCHEMES: dict[StepSchemeName, float] = measured("reference_schemes")
# This scheme amplifies rounding errors least. Long chains use it for any target error, because
# their grazing contacts depend on the last digit. The choice affects only the cost.
_PLAINEST: StepSchemeName = "srkn14"
# If more steps than this had to be tried, the bodies amplify errors more than usual.
_USUAL_TRIES = 3
# Chains of more particles are not solved in batches. If the first step does not suffice for such a
# chain, its rounding sensitivity is measured.
LONGEST_TRUSTED = 250
# The error is multiplied by this factor if the number of contacts depends on the step, and for
# bodies that amplify the errors of steps. Among 141 chains with one heavy mass, at three steps
# each, three runs had errors of up to 2.1 times the estimate.
_RESERVE = 3.0
# Let d(k) be the largest difference in velocities between the runs at the steps k H and H.
# Velocities have converged if d(1.3) is at most _NEARER times d(2) (for order 4 the ratio is 0.12),
# or at most _SAME times the largest velocity. The check is needed because unequal masses, two
# bodies and warm chains amplify the errors of steps: without it, 51 of 527 chains with one heavy
# mass had too small an error bar.
_NEARER, _SAME = 0.15, 1e-9
# A step whose usual error is below this limit resolves a long chain; longer steps do not show
# whether contacts depend on the last digit. In lj chains of 3000 and 4000 particles (0.4 v*),
# contacts do not depend on the last digit at H = 0.063, but seem to do so at H = 0.126. In chains
# of 4500 to 10000 particles, rounding changes the contacts at every tested step.
_RESOLVED = 2e-11
_MOST_REFINEMENTS = 15
_LEAST_STEP = 1e-5


def usual_scheme(target_error: float) -> StepSchemeName:
    """Return the scheme that is usually cheapest for a target error."""
    return next(name for name, least in _SCHEMES.items() if target_error > least)


def plain_scheme(problem: Problem, target_error: float, sensitivity: float) -> StepSchemeName:
    """Return the usual scheme, or `_PLAINEST` if rounding errors are large."""
    scheme = usual_scheme(target_error)
    if problem.line.has_equal_masses:
        much = problem.particles > LONG
    else:
        amplified = sensitivity * STEP_SCHEMES[scheme].amplification
        much = amplified_rounding("reference", amplified, problem) > STEP_SHARE * target_error
    return _PLAINEST if much else scheme


def solve_with_fixed_steps(
    problem: Problem, target_error: float, sensitivity: float, followed: Outcome | None = None
) -> BoundedRun:
    """
    Solve a scene; refine the usual step of a scheme until runs at three steps agree.

    For `sensitivity` and `followed` see
    :func:`chaincor.workflows.accuracy.by_reference.solve_with_reference`.
    """
    scheme = plain_scheme(problem, target_error, sensitivity)
    found = _solve_with_scheme(problem, target_error, scheme, sensitivity, followed)
    assert found.bar.step is not None
    reachable = max(target_error, rounding_error("reference", problem))
    if scheme != _PLAINEST and found.bar.rounding > reachable >= found.bar.step:
        plainest = _solve_with_scheme(
            problem, target_error, _PLAINEST, found.rounding_sensitivity, followed
        )
        return min(found, plainest, key=lambda each: each.error)
    return found


def _solve_with_scheme(
    problem: Problem,
    target_error: float,
    scheme: StepSchemeName,
    sensitivity: float,
    followed: Outcome | None,
) -> BoundedRun:
    """Refine the steps of one scheme, then examine the end of the collision and the rounding."""
    floor = rounding_error("reference", problem)
    found = refine_regularly(problem, target_error, scheme, floor, followed)
    fine, error, proof = found.outcome, found.error, found.proofs[0]
    step = fine.timestep
    assert step is not None
    if followed is None and fine is not found.first:
        whole = run_reference(problem, scheme, step)
        error = max(error, abs(whole.eta - fine.eta))
        fine = with_doubts(whole, (fine, proof))
    silent = fine.longest_silence > sound_round_trip(problem.longest_body, problem.slow_stiffness)
    # Measure the rounding sensitivity if it is not known and rounding matters, for example in a
    # long chain that needs smaller steps than usual. Measure it also if the chain broke and was
    # without a contact for a long time, during which rounding errors are amplified. Measure it also
    # if smaller steps no longer help, or if the number of contacts depends on the step, because
    # this number may then also depend on rounding. For unequal masses, two bodies or warm chains,
    # the sensitivity is known already; if these bodies needed many attempts, it was measured at too
    # long a step.
    refined = problem.particles > LONGEST_TRUSTED and len(found.tries) > 1
    matters = sensitivity > 0.0 or refined or rounding_matters("reference", problem, target_error)
    hard = not problem.line.has_equal_masses and len(found.tries) > _USUAL_TRIES
    if (
        (problem.line.has_equal_masses and matters)
        or silent
        or found.grazes
        or found.stalled
        or hard
    ):
        # the error bar multiplies the sensitivity by this factor
        amplification = STEP_SCHEMES[scheme].amplification
        changed = found.nudged or nudged_change(problem, scheme, step, fine)
        sensitivity = max(sensitivity, changed / amplification)
        sure = not problem.line.has_equal_masses and fine.ending.kind == "proved"
        if silent and max(amplification * sensitivity, error) > target_error and not sure:
            # If rounding affects the impulse of the last contact, it may also decide whether
            # another contact follows.
            another = 2.0 * float(fine.contact_speeds[-1])
            fine = replace(fine, ending=fine.ending.doubted(another))
    bounded = bounded_run(fine, error, proof, found.tries, sensitivity)
    return replace(bounded, others=tuple(found.proofs))


def with_doubts(outcome: Outcome, others: Sequence[Outcome]) -> Outcome:
    """
    Return the outcome; declare its end open if the other outcomes have other late contacts.

    The other outcomes are runs of the same collision at other steps.
    """
    ending = outcome.ending
    for other in others:
        ending = ending.doubted(other.ending.missed_momentum)
        # If only one run has a grazing contact in the middle of the collision, the difference
        # between the runs shows the effect of this contact. A contact after the last contact of the
        # other run, however, may be the first of several.
        sooner, later = sorted((outcome, other), key=lambda each: float(each.contact_times[-1]))
        same = int(np.argmin(np.abs(later.contact_times - sooner.contact_times[-1])))
        ending = ending.doubted(2.0 * float(np.sum(later.contact_speeds[same + 1 :])))
    return replace(outcome, ending=ending)


def first_step(problem: Problem, scheme: StepSchemeName, reachable: float) -> float:
    """Return the first step to try for a target error; usually this step suffices."""
    return 0.5 * guess_step(problem, scheme, STEP_SHARE * reachable / usual_share(scheme))


def refine_regularly(
    problem: Problem,
    target_error: float,
    scheme: StepSchemeName,
    floor: float,
    followed: Outcome | None,
) -> ConvergedRun:
    """
    Refine the step until runs at three steps agree, or smaller steps do not help.

    Bonds are smooth. `target_error` is the required error of eta and `floor` the rounding error.
    `followed` is an outcome of this collision whose end is known; without it, the first run is
    followed to its end. The result is the run with the smallest error or, if rounding decides the
    collision, the first of the last few runs. Raises the RunError that stopped the smallest steps.
    """
    search = _Search(problem, target_error, floor, scheme, followed)
    policy = Policy(_MOST_REFINEMENTS, stalls=True)
    tries = refine(first_step(problem, scheme, max(target_error, floor)), search.attempt, policy)
    return refined(tries, search.known, search.nudged)


@dataclass
class _Search:
    """
    Search with ever smaller steps; each run is compared with runs at `COARSER` times its step.

    The motion after the last contact is examined only in one run, `known`. If other rounding errors
    explain the difference between runs at several steps, `nudged` is the change of eta that they
    cause.
    """

    problem: Problem
    target_error: float
    floor: float
    scheme: StepSchemeName
    known: Outcome | None
    last: Outcome | None = None
    nudged: float = 0.0

    def attempt(self, step: float) -> Attempt[list[Outcome]]:
        problem, scheme, target_error, floor = (
            self.problem,
            self.scheme,
            self.target_error,
            self.floor,
        )
        last, self.last = self.last, None
        fine = run_reference(problem, scheme, step, self.known)
        self.known = self.known or fine
        telling = distinguishing_step(scheme, step, fine.lasted)
        if telling < step:
            return Attempt(step, math.inf, following=telling, anew=True)
        proofs = self._proofs(fine, last)
        self.last = fine
        error, regular = self._error(fine, proofs)
        resolved = step <= first_step(problem, scheme, _RESOLVED)
        if problem.particles > LONG and resolved and not regular and error > target_error:
            # If rounding explains the difference between runs at several steps, smaller steps do
            # not help.
            enough = error / amplified_rounding("reference", 1.0, problem)
            changed = nudged_change(problem, scheme, step, fine, enough)
            self.nudged = changed if changed >= enough else 0.0
        done = error + floor <= target_error or error < 0.3 * floor or step < _LEAST_STEP
        # Smaller steps do not reduce the error from contacts after an open end.
        ending = ending_error(self.known)
        done |= problem.particles > LONG and regular and error <= ending > target_error
        if done and self.nudged == 0.0 and differ(fine, [self.known]):
            # The known end belongs to a run with another number of contacts. Follow this run to its
            # own end, because it may have one contact more.
            whole = run_reference(problem, scheme, step)
            late, self.known = differ(fine, [whole]), whole
            if late:
                return Attempt(step, math.inf, [whole, *proofs], following=step)
            fine = whole
        # if errors follow no order, halve the step; the next run is then compared with this run
        share = 0.5
        if regular:
            order = effective_order(problem, scheme)
            # Below the rounding error, a smaller step does not help.
            share = by_order(STEP_SHARE * max(target_error, floor), error, order, 0.3)
        return Attempt(step, error, [fine, *proofs], done or self.nudged > 0.0, step * share)

    def _proofs(self, fine: Outcome, last: Outcome | None) -> list[Outcome]:
        """
        Return runs at `COARSER` times the step of a run; `last` may be one of them.

        For a long chain, the second run is omitted if the first run misses the target error and has
        another number of contacts. Errors then follow no order, and a second run would prove
        nothing.
        """
        problem = self.problem
        assert fine.timestep is not None
        runs: list[Outcome] = []
        for k in COARSER:
            step = k * fine.timestep
            if last is None or last.timestep != step:
                runs.append(run_reference(problem, self.scheme, step, fine))
            else:
                runs.append(last)
            missed = abs(runs[0].eta - fine.eta) > self.target_error
            if problem.particles > LONG and missed and differ(fine, runs):
                break
        return runs

    def _error(self, fine: Outcome, proofs: Sequence[Outcome]) -> tuple[float, bool]:
        """Return the error due to the step of a run, and whether the runs converge fast enough."""
        far, *nearer = (difference_to(fine, run) for run in proofs)
        amplifies = not self.problem.line.has_equal_masses
        if amplifies and nearer and not _converge(fine, proofs[1], proofs[0]):
            return math.inf, False
        alike = not differ(fine, proofs)
        assert fine.timestep is not None
        steps, near = fine.lasted / fine.timestep, nearer[0] if nearer else far
        error, falls = proved_error(self.scheme, steps, far, near, self.floor, alike)
        return (_RESERVE if amplifies or not alike else 1.0) * float(error), bool(falls)


def _converge(fine: Outcome, near: Outcome, coarse: Outcome) -> bool:
    """
    Return whether the velocities of all particles converge.

    The near run must be much closer to the fine run than the coarse run is. Otherwise the motions
    differ, and eta agrees only by chance.
    """
    small, large = (
        float(np.max(np.abs(run.velocities - fine.velocities))) for run in (near, coarse)
    )
    return small <= max(_NEARER * large, _SAME * float(np.max(np.abs(fine.velocities))))
