"""Meeting an error with bonds whose smoothness is not known: no order of convergence is trusted."""

import math
from dataclasses import dataclass

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.error_bars import COARSER_SHARE
from chaincor.workflows.accuracy.in_house_runs import eta_of, is_believed, run_in_house
from chaincor.workflows.accuracy.step_guess import (
    STEP_SHARE,
    effective_order,
    guess_step,
    sharpness,
)
from chaincor.workflows.engines.in_house.kernels import kernels_for
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import RunError

# A bond that passes a kink within a step costs an error of second order whose sign depends on
# where in the step that was: two runs may agree by luck. Four coarser ones, at steps that share no
# phase, seldom do: with errors that are independent and Gaussian, all four differ from the finest
# by less than 1/1.5 of its error in 2 cases of 1000.
COARSER = (2.0, 1.86, 1.73, 1.61)
KINKED_SHARE = 1.5
# Where no kink was found, half as much as order 2 would need is taken at any order.
_SEEMINGLY_SMOOTH_SHARE = 1.0
# A scheme of higher order whose error falls no faster than this, twice, meets kinks nobody named.
_LOST_ORDER = 3.0
_MOST_REFINEMENTS = 20
# Steps that get smaller so many times without halving the error show that it is not the steps':
# each is 0.8 of the last at most, of order 4 at least, which should halve the error every time.
STALLED = 3
# Bond steps and steps of one run, some seconds: compiled, and where NumPy steps the chain.
_MOST_BOND_STEPS, _MOST_ARRAY_STEPS = 2e9, 1e5
# Bonds of the run that gives eta may stretch this much more than those of the first, coarse one.
_RESERVE = 1.2
_FIRST_STEP = 0.0125


@dataclass(frozen=True)
class Refined:
    """
    The finest of several runs.

    Attributes
    ----------
    fine, proof : Outcome
        The run that gives the number, and one at twice its step.
    error : float
        Its error.
    kinked : bool
        Whether bonds pass kinks, so that Verlet steps are as good as any.
    stalled : bool
        Whether smaller steps had stopped to help.
    seconds : float
        Integration time of all runs.
    tries : list of dict
        Steps and errors on the way.
    """

    fine: Outcome
    proof: Outcome
    error: float
    kinked: bool
    stalled: bool
    seconds: float
    tries: list[dict[str, float]]


def meets_kinks(scene: Scene) -> bool:
    """Return whether bonds pass kinks of their potential in a coarse run, or none can be made."""
    kinks = scene.bond.kinks
    if not kinks or scene.particles == 1:
        return False
    try:
        step = _FIRST_STEP / (scene.fast_stiffness**0.5 * sharpness(scene))
        outcome = run_in_house(scene, "verlet", step)
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


def refine(scene: Scene, goal: float, scheme: StepSchemeName, floor: float = 0.0) -> Refined:
    """
    Refine the in-house integrator until its error is below a goal, or costs too much.

    `scheme` is for bonds that seem smooth: where they meet kinks, and where its order is not seen,
    Verlet steps are taken instead. `floor` is the error from rounding, below which finer steps buy
    nothing. Raises RunError, what stopped the finest runs.
    """
    kinked = meets_kinks(scene)
    if kinked:
        scheme = "verlet"
    soft = not scene.line.smooth
    share = _share(scheme, kinked or soft)
    reachable = max(goal - floor, floor, 1e-15)
    step = 0.5 * guess_step(scene, scheme, STEP_SHARE * reachable / share)
    # Sound crosses the chain and comes back: about as long as most collisions take.
    crossings = 2.0 * scene.span / scene.slow_stiffness**0.5
    step = max(step, least_step(scene, scheme, crossings))
    best: tuple[float, Outcome, Outcome] | None = None
    tries: list[dict[str, float]] = []
    found: list[list[float]] = []
    refusals: list[RunError] = []
    seconds, stalled, lost, least = 0.0, 0, 0, 0.0
    for _ in range(_MOST_REFINEMENTS):
        try:
            fine = run_in_house(scene, scheme, step)
            runs = [fine, *(run_in_house(scene, scheme, k * step, fine) for k in COARSER)]
        except RunError as failure:
            refusals.append(failure)
            if is_believed(refusals):
                raise
            tries.append({"timestep": step, "step_error": math.inf})
            step *= 0.5
            continue
        refusals.clear()
        seconds += sum(run.seconds for run in runs)
        found.append([eta_of(scene, run) for run in runs])
        error = share * float(np.max(np.abs(np.subtract(found[-1][1:], found[-1][0]))))
        order = _observed_order(tries, step, error, effective_order(scene, scheme))
        tries.append({"timestep": step, "step_error": error})
        stalled = 0 if best is None or error < 0.5 * best[0] else stalled + 1
        if best is None or error < best[0]:
            best = (error, runs[0], runs[1])
        least = least_step(scene, scheme, float(runs[0].contact_times[-1]))
        if error + floor <= goal or error < 0.3 * floor or stalled == STALLED:
            break
        if step <= least:
            break
        lost = lost + 1 if order < _LOST_ORDER and error > 10.0 * floor else 0
        if scheme != "verlet" and lost == 2 and not soft:
            scheme, kinked = "verlet", True
            share, stalled = _share(scheme, kinked), 0
            step /= STEP_SCHEMES["order8"].evaluations
            continue
        wanted = (STEP_SHARE * reachable / error) ** (1.0 / order)
        step = max(step * min(max(wanted, 0.2), 0.8), least)
    if best is None:
        raise refusals[-1]
    error, fine, proof = best
    if stalled == STALLED:
        # The truth may be wherever one of these runs went.
        error = float(np.max(np.abs(np.ravel(found[-STALLED - 1 :]) - eta_of(scene, fine))))
    return Refined(fine, proof, error, kinked, stalled == STALLED, seconds, tries)


def _share(scheme: StepSchemeName, kinked: bool) -> float:
    if kinked:
        return KINKED_SHARE
    return max(COARSER_SHARE[scheme], _SEEMINGLY_SMOOTH_SHARE)


def _observed_order(tries: list[dict[str, float]], step: float, error: float, most: float) -> float:
    """Return the order by which errors fell from the last try to this one."""
    if not tries or not math.isfinite(tries[-1]["step_error"]) or error <= 0.0:
        return most
    last = tries[-1]
    fell = math.log(max(last["step_error"], 1e-300) / error)
    return min(max(fell / math.log(last["timestep"] / step), 1.5), most)
