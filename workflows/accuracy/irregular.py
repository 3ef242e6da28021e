"""Meeting an error with bonds whose smoothness is not known: no order of convergence is trusted."""

import math
from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
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
from chaincor.workflows.accuracy.step_proof import telling_step
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.kernels import kernels_for
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import RunError

# A bond that passes a kink within a step costs an error of second order whose sign depends on
# where in the step that was: two runs may agree by luck. Four coarser ones, at steps that share no
# phase, seldom do: with errors that are independent and Gaussian, all four differ from the finest
# by less than 1/1.5 of its error in 2 cases of 1000.
COARSER = (2.0, 1.86, 1.73, 1.61)
KINKED_SHARE = 1.5
# Where no order can be relied on, a composition errs least between its evaluations.
SCHEME: StepSchemeName = "order8"
# Where no kink was found, half as much as order 2 would need is taken at any order.
_SEEMINGLY_SMOOTH_SHARE = 1.0
# A scheme of higher order whose error falls no faster than this, twice, meets kinks nobody named.
_LOST_ORDER = 3.0
_MOST_REFINEMENTS = 20
# Bond steps and steps of one run, some seconds: compiled, and where NumPy steps the chain.
_MOST_BOND_STEPS, _MOST_ARRAY_STEPS = 2e9, 1e5
# Bonds of the run that gives eta may stretch this much more than those of the first, coarse one.
_RESERVE = 1.2
_FIRST_STEP = 0.0125


def meets_kinks(scene: Scene) -> bool:
    """Return whether bonds pass kinks of their potential in a coarse run, or none can be made."""
    kinks = scene.bond.kinks
    if not kinks or scene.particles == 1:
        return False
    try:
        step = _FIRST_STEP / (scene.fast_stiffness**0.5 * frequency_ratio(scene))
        outcome = run_reference(scene, "verlet", step)
    except RunError:
        return True
    low, high = _RESERVE * (outcome.bond_min - 1.0), _RESERVE * (outcome.bond_max - 1.0)
    return any(low <= kink <= high for kink in kinks)


def least_step(scene: Scene, scheme: StepSchemeName, duration: float) -> float:
    """Return the smallest step whose run over a duration takes some seconds at most."""
    parts = STEP_SCHEMES[scheme]
    steps = _MOST_ARRAY_STEPS
    if kernels_for(scene.bond, parts).compiled:
        steps = _MOST_BOND_STEPS / scene.all_particles
    return duration * parts.evaluations / steps


def first_step(scene: Scene, scheme: StepSchemeName, reachable: float, kinked: bool) -> float:
    """Return the step that is tried first for an error."""
    share = _share(scene, kinked)
    step = 0.5 * guess_step(scene, scheme, STEP_SHARE * reachable / share)
    # Sound crosses the chain and comes back: about as long as most collisions take.
    crossings = 2.0 * scene.longest_body / scene.slow_stiffness**0.5
    return max(step, least_step(scene, scheme, crossings))


def _share(scene: Scene, kinked: bool) -> float:
    """Return the error over the largest difference between runs."""
    return KINKED_SHARE if kinked or not scene.line.contact.smooth else _SEEMINGLY_SMOOTH_SHARE


def refine_irregularly(scene: Scene, target_error: float, floor: float) -> ConvergedRun:
    """
    Refine the in-house integrator until its error is below a goal, or costs too much.

    Where bonds meet kinks, and where no order is seen, Verlet steps are taken. `floor` is the error
    from rounding, below which finer steps buy nothing. Raises RunError, what stopped the finest
    runs.
    """
    kinked = meets_kinks(scene)
    search = _Search(scene, target_error, floor, "verlet" if kinked else SCHEME, kinked)
    step = first_step(scene, search.scheme, search.reachable, kinked)
    tries = refine(step, search.attempt, Policy(_MOST_REFINEMENTS, stalls=True))
    return refined(scene, tries, kinked=search.kinked)


@dataclass
class _Search:
    """Runs at ever smaller steps, each at `COARSER` times its step as well."""

    scene: Scene
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
        scene, scheme, floor = self.scene, self.scheme, self.floor
        before, self.before = self.before, None
        fine = run_reference(scene, scheme, step)
        telling = telling_step(scheme, step, fine.lasted)
        if telling < step:
            return Attempt(step, math.inf, following=telling, anew=True)
        proofs = [run_reference(scene, scheme, k * step, fine) for k in COARSER]
        runs = [fine, *proofs]
        error = _share(scene, self.kinked) * largest_difference(scene, fine, proofs)
        order = _observed_order(before, step, error, effective_order(scene, scheme))
        least = least_step(scene, scheme, float(fine.contact_times[-1]))
        done = error + floor <= self.target_error or error < 0.3 * floor or step <= least
        self.lost = self.lost + 1 if order < _LOST_ORDER and error > 10.0 * floor else 0
        anew = scheme != "verlet" and self.lost == 2 and scene.line.contact.smooth
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
    """Return the order by which errors fell from the last step to this one."""
    if last is None or error <= 0.0:
        return most
    fell = math.log(max(last.error, 1e-300) / error)
    return min(max(fell / math.log(last.step / step), 1.5), most)
