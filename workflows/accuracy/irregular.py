"""Solve scenes with bonds of unknown smoothness to a target error."""

import math
from dataclasses import dataclass

from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.bond_range import bonds_from_start
from chaincor.workflows.accuracy.reference_runs import (
    ConvergedRun,
    largest_difference,
    refined,
    run_reference,
)
from chaincor.workflows.accuracy.refining import Attempt, Policy, by_order, refine
from chaincor.workflows.accuracy.step_guess import (
    STEP_SHARE,
    effective_order,
    frequency_ratio,
    guess_step,
)
from chaincor.workflows.accuracy.step_proof import distinguishing_step
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.kernels import kernels_for
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import RunError

# A bond that passes a kink within a step causes an error of second order. The sign of this error
# depends on the position of the kink within the step; two runs may therefore agree by chance. Four
# coarser runs, at steps without common multiples, seldom agree by chance: with independent Gaussian
# errors, all four differ from the finest run by less than 1/1.5 of its error in only 2 of 1000
# cases.
COARSER = (2.0, 1.86, 1.73, 1.61)
KINKED_SHARE = 1.5
# If no order is reliable, this composition has the smallest error for its number of force
# evaluations.
SCHEME: StepSchemeName = "order8"
# Ratio of the error to the largest difference between runs if no kink was found; KINKED_SHARE
# applies otherwise.
_SEEMINGLY_SMOOTH_SHARE = 1.0
# If the error of a scheme of higher order falls no faster than this power of the step, in two
# successive refinements, the bonds have kinks that were not declared.
_LOST_ORDER = 3.0
_MOST_REFINEMENTS = 20
# Largest work of one run, which takes some seconds: steps times bonds in compiled loops, or steps
# in NumPy.
_MOST_BOND_STEPS, _MOST_ARRAY_STEPS = 2e9, 1e5
# In later runs, bond strains may exceed those of the first, coarse run by up to this factor.
_RESERVE = 1.2
_FIRST_STEP = 0.0125


def reaches_kinks(problem: Problem) -> bool:
    """Return whether bonds pass kinks in a coarse run, or whether the coarse run fails."""
    kinks = problem.bond.kinks
    if not kinks or problem.particles == 1:
        return False
    try:
        step = _FIRST_STEP / (problem.fast_stiffness**0.5 * frequency_ratio(problem))
        outcome = run_reference(problem, "verlet", step)
    except RunError:
        return True
    low, high = (_RESERVE * (length - 1.0) for length in bonds_from_start(outcome))
    return any(low <= kink <= high for kink in kinks)


def least_irregular_step(problem: Problem, scheme: StepSchemeName, duration: float) -> float:
    """Return the smallest step with which a run of some duration takes at most some seconds."""
    parts = STEP_SCHEMES[scheme]
    steps = _MOST_ARRAY_STEPS
    if kernels_for(problem.bond, parts).compiled:
        steps = _MOST_BOND_STEPS / problem.all_particles
    return duration * parts.evaluations / steps


def first_irregular_step(
    problem: Problem, scheme: StepSchemeName, reachable: float, kinked: bool
) -> float:
    """Return the first step to try for a target error."""
    share = _share(problem, kinked)
    step = 0.5 * guess_step(problem, scheme, STEP_SHARE * reachable / share)
    # Most collisions last about as long as a sound round trip.
    crossings = 2.0 * problem.longest_body / problem.slow_stiffness**0.5
    return max(step, least_irregular_step(problem, scheme, crossings))


def _share(problem: Problem, kinked: bool) -> float:
    """Return the ratio of the error to the largest difference between runs."""
    return KINKED_SHARE if kinked or not problem.line.contact.smooth else _SEEMINGLY_SMOOTH_SHARE


def refine_irregularly(problem: Problem, target_error: float, floor: float) -> ConvergedRun:
    """
    Run the reference engine at ever smaller steps until its error is below a target.

    The refinement also ends if smaller steps would cost too much. Verlet steps are taken if bonds
    pass kinks or if errors follow no higher order. `floor` is the rounding error, below which
    smaller steps do not help. Raises the RunError that stopped the smallest steps.
    """
    kinked = reaches_kinks(problem)
    search = _Search(problem, target_error, floor, "verlet" if kinked else SCHEME, kinked)
    step = first_irregular_step(problem, search.scheme, search.reachable, kinked)
    tries = refine(step, search.attempt, Policy(_MOST_REFINEMENTS, stalls=True))
    return refined(tries, kinked=search.kinked)


@dataclass
class _Search:
    """Search with ever smaller steps; each run is compared with runs at longer steps."""

    problem: Problem
    target_error: float
    floor: float
    scheme: StepSchemeName
    kinked: bool
    before: Attempt[list[Outcome]] | None = None
    lost: int = 0

    @property
    def reachable(self) -> float:
        return max(self.target_error - self.floor, self.floor, 1e-15)

    def attempt(self, step: float) -> Attempt[list[Outcome]]:
        problem, scheme, floor = self.problem, self.scheme, self.floor
        before, self.before = self.before, None
        fine = run_reference(problem, scheme, step)
        telling = distinguishing_step(scheme, step, fine.lasted)
        if telling < step:
            return Attempt(step, math.inf, following=telling, anew=True)
        proofs = [run_reference(problem, scheme, k * step, fine) for k in COARSER]
        runs = [fine, *proofs]
        error = _share(problem, self.kinked) * largest_difference(fine, proofs)
        order = _observed_order(before, step, error, effective_order(problem, scheme))
        least = least_irregular_step(problem, scheme, float(fine.contact_times[-1]))
        done = error + floor <= self.target_error or error < 0.3 * floor or step <= least
        self.lost = self.lost + 1 if order < _LOST_ORDER and error > 10.0 * floor else 0
        anew = scheme != "verlet" and self.lost == 2 and problem.line.contact.smooth
        if anew:
            self.scheme, self.kinked = "verlet", True
            smaller = step / STEP_SCHEMES[SCHEME].evaluations
        else:
            smaller = step * by_order(STEP_SHARE * self.reachable, error, order, 0.2)
            smaller = max(smaller, least)
        self.before = Attempt(step, error, runs, done, smaller, anew)
        return self.before


def _observed_order(
    last: Attempt[list[Outcome]] | None, step: float, error: float, most: float
) -> float:
    """Return the observed order: how fast errors fell from the last step to this step."""
    if last is None or error <= 0.0:
        return most
    fell = math.log(max(last.error, 1e-300) / error)
    return min(max(fell / math.log(last.step / step), 1.5), most)
