"""Run the reference engine at several steps, or with other rounding errors, and compare."""

import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.refining import (
    STALLED,
    Attempt,
    Policy,
    by_order,
    completed_attempts,
    has_stalled,
    refine,
    steps_record,
)
from chaincor.workflows.accuracy.step_guess import effective_order, guess_step, largest_step
from chaincor.workflows.accuracy.step_proof import difference
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import stepping

# Chains of more particles have grazing contacts that depend on the last digit.
LONG = 1500
# Nudges: the impact velocity is changed by these multiples of the machine epsilon. In lj chains of
# 3000 particles at 0.39 v*, rounding errors change the last contacts in one third of the runs; eta
# is then 0.7833 to 0.7842, otherwise 0.7813. There, all runs with two nudges and at three steps
# agreed by chance. All runs with eight nudges and at three steps agree by chance in one case of a
# hundred.
_NUDGES = (-5.0, 3.0)
_NUDGES_OF_LONG = (*_NUDGES, -9.0, 7.0, -2.0, 11.0, -14.0, 5.0)
# Steps for this target error are short enough to measure the amplification of rounding errors.
_GOAL = 1e-9
# If a run at the usual step fails, the step is halved at most this many times, to a thousandth.
_MOST_HALVINGS = 10
# If a step is estimated from one run, the estimate aims at this fraction of the target error. The
# error at the estimated step varies by chance, and a missed target error costs another search. The
# fraction shortens a step of order 8 by only a tenth. It affects only the cost.
_RESERVE = 0.3
_MOST_TRIES = 5


def largest_difference(run: Outcome, others: Iterable[Outcome]) -> float:
    """Return the largest difference in eta between a run and other runs."""
    eta = run.eta
    return max(abs(other.eta - eta) for other in others)


def difference_to(run: Outcome, other: Outcome) -> float:
    """Return the `step_proof.difference` between two runs; of eta alone if contacts differ."""
    if differ(run, [other]):
        return largest_difference(run, [other])
    problem = run.problem
    v0 = problem.impact_velocity
    e, others = (each.separation_velocity / v0 for each in (run, other))
    one, two = run.contact_speeds, other.contact_speeds
    return float(difference(problem.line, e, others, one, two, v0))


def run_reference(
    problem: Problem, scheme: StepSchemeName, timestep: float, known: Outcome | None = None
) -> Outcome:
    """Run the reference engine with a scheme and a step."""
    return stepping.run(problem, Numerics(scheme=scheme, timestep=timestep), known=known)


@dataclass(frozen=True)
class ConvergedRun:
    """Best of several runs of a collision at ever smaller steps."""

    outcome: Outcome  #: Outcome of the best run.
    #: Runs at larger steps, the first at twice the step; the run itself if it has no time step.
    proofs: list[Outcome]
    restitution: float  #: Restitution eta of the best run.
    error: float  #: Error of eta, due to the step alone or including rounding.
    seconds: float  #: Integration time of all compared runs.
    stalled: bool = False  #: Whether smaller steps no longer helped.
    #: Steps of all attempts, and their errors.
    tries: list[dict[str, float]] = field(default_factory=list)
    first: Outcome | None = None  #: Run whose end is used for all other runs, or None.
    #: Change of eta due to other rounding errors if smaller steps do not help because of this
    #: change; otherwise 0.
    nudged: float = 0.0
    kinked: bool = False  #: Whether bonds pass kinks, at which no scheme has an order above 2.

    @property
    def grazes(self) -> bool:
        """Whether the number of contacts depends on the step."""
        return differ(self.outcome, self.proofs)


def differ(fine: Outcome, proofs: Sequence[Outcome]) -> bool:
    """Return whether any run has another number of contacts than the fine run."""
    return any(len(run.contact_times) != len(fine.contact_times) for run in proofs)


def refined(
    tries: Sequence[Attempt[list[Outcome]]],
    first: Outcome | None = None,
    nudged: float = 0.0,
    kinked: bool = False,
) -> ConvergedRun:
    """
    Return the best of several attempts; each attempt has a run, its proof runs and its error.

    If smaller steps no longer help, or if rounding decides the collision (`nudged`), the true eta
    may be anywhere in the range of the last few runs. If another step only changes the rounding
    errors, the run with the smallest step is no better than the first run, whose end may be known.
    """
    ran = [(each.error, each.found or []) for each in completed_attempts(tries)]
    error, runs = min(ran, key=lambda each: each[0])
    forgets = nudged > 0.0
    stuck = forgets or has_stalled(tries)
    if stuck:
        alike = ran[-STALLED:] if forgets else ran[-STALLED - 1 :]
        runs = alike[0][1] if forgets else runs
        error = largest_difference(runs[0], (run for _, each in alike for run in each))
    nudged = max(nudged, error) if forgets else 0.0
    # A run may be compared with several runs, but its time must count only once.
    seconds = sum({id(run): run.seconds for _, each in ran for run in each}.values())
    found = runs[0], runs[1:], runs[0].eta, error, seconds
    return ConvergedRun(*found, stuck, steps_record(tries), first, nudged, kinked)


def nudged_change(
    problem: Problem, scheme: StepSchemeName, step: float, plain: Outcome, enough: float = math.inf
) -> float:
    """
    Return the change of eta when the impact velocity changes by a few units of rounding.

    The result is the largest change of several, or the first change that reaches `enough`.
    """
    worst, eta = 0.0, plain.eta
    for ulps in _NUDGES_OF_LONG if problem.particles > LONG else _NUDGES:
        change = 1.0 + ulps * sys.float_info.epsilon
        if problem.line.has_equal_masses:
            nudged, near = problem.at_velocity(change * problem.impact_velocity), step
        else:  # keep the given velocities; another step also changes all rounding errors
            nudged, near = problem, change * step
        other = run_reference(nudged, scheme, near, plain)
        worst = max(worst, abs(other.eta - eta))
        if worst >= enough:
            break
    return worst


def find_rounding_sensitivity(problem: Problem) -> float:
    """
    Return the change of eta when all rounding errors change.

    The result is the largest change when the impact velocity changes by a few units in the last
    place. The step depends only on the scene. Fixed steps must be able to resolve the bonds.
    """
    # Follow a warm chain to its end, because vibration may send a slow warm chain back to the
    # target long after the first contacts.
    follow = problem.temperature is not None

    def attempt(step: float) -> Attempt[float]:
        plain = stepping.run(problem, Numerics(scheme="order8", timestep=step), follow=follow)
        return Attempt(step, 0.0, nudged_change(problem, "order8", step, plain), done=True)

    step = guess_step(problem, "order8", _GOAL)
    found = completed_attempts(refine(step, attempt, Policy(_MOST_HALVINGS)))[-1].found
    assert found is not None
    return found


def _error_at(
    problem: Problem, scheme: StepSchemeName, step: float, reference_run: ConvergedRun
) -> float:
    """Return the error of eta at a step; raises RunError if the step is too large."""
    outcome = run_reference(problem, scheme, step, reference_run.outcome)
    return max(abs(outcome.eta - reference_run.restitution), 1e-17)


def estimate_step(
    problem: Problem, scheme: StepSchemeName, target_error: float, reference_run: ConvergedRun
) -> float | None:
    """
    Return an estimate of the step for a target error, from one run, with a reserve.

    Return None if runs fail even at much smaller steps.
    """
    order = effective_order(problem, scheme)

    def attempt(step: float) -> Attempt[float]:
        error = _error_at(problem, scheme, step, reference_run)
        growth = by_order(_RESERVE * target_error, error, order, 0.1, 3.0)
        return Attempt(step, error, growth, done=True)

    policy = Policy(_MOST_TRIES, refused=0.4, believed=False)
    last = refine(guess_step(problem, scheme, target_error), attempt, policy)[-1]
    if last.found is None:
        return None
    return min(largest_step(scheme, problem.fast_stiffness), last.step * last.found)


def find_step(
    problem: Problem,
    scheme: StepSchemeName,
    target_error: float,
    reference_run: ConvergedRun,
    start: float,
) -> float | None:
    """Return nearly the largest step that reaches a target error; None if none was found."""
    order = effective_order(problem, scheme)

    def attempt(step: float) -> Attempt[None]:
        error = _error_at(problem, scheme, step, reference_run)
        smaller = step * by_order(_RESERVE * target_error, error, order, 0.25)
        return Attempt(step, error, done=error <= target_error, following=smaller)

    last = refine(start, attempt, Policy(_MOST_TRIES, refused=0.25, believed=False))[-1]
    return last.step if last.done else None
