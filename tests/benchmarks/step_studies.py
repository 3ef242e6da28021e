"""How errors at equal steps, in units of the fastest bond, scatter between scenes."""

import numpy as np

from lammps_inputs.numerics import StepSchemeName
from lammps_inputs.scene import Scene
from tests.benchmarks.bar_studies import Random, Samples, draw_scene, find_truth
from workflows.convergence import eta_of, run_in_house
from workflows.engines.compositions import COMPOSITIONS
from workflows.errors import RunError
from workflows.step_guess import USUAL_STEPS, sharpness

# Nearby steps stand for different phases of the contacts within a step.
_PHASES = np.linspace(0.97, 1.0, 8)


def _error(scene: Scene, scheme: StepSchemeName, share: float, truth: float) -> float:
    step = share * USUAL_STEPS[scheme] / sharpness(scene)
    return abs(eta_of(scene, run_in_house(scene, scheme, step)) - truth)


def usual_error(random: Random, count: int) -> Samples:
    """Error of eta in-house at the usual step of a scheme, in chains of 50 to 200 particles."""
    schemes: tuple[StepSchemeName, ...] = (*COMPOSITIONS, "extrapolated14")
    found: Samples = {scheme: [] for scheme in schemes}
    while len(found["verlet"]) < count:
        scene = draw_scene(random).replace(particles=int(random.integers(50, 200)))
        try:
            truth = find_truth(scene).restitution
            errors = [_error(scene, scheme, 1.0, truth) for scheme in schemes]
        except RunError:
            continue
        for scheme, error in zip(schemes, errors, strict=True):
            found[scheme].append(error)
    return found


def promise_reserve(random: Random, count: int) -> Samples:
    """Error in a scene over the worst error of lj at 0.4 v*, n = 100, at equal scaled steps."""
    schemes: tuple[StepSchemeName, ...] = tuple(COMPOSITIONS)
    usual, found = Scene(), {str(scheme): [] for scheme in schemes}
    truth = find_truth(usual).restitution
    worst = [max(_error(usual, scheme, k, truth) for k in _PHASES.tolist()) for scheme in schemes]
    while len(found["verlet"]) < count:
        scene = draw_scene(random, most=200)
        try:
            truth = find_truth(scene).restitution
            errors = [_error(scene, scheme, 1.0, truth) for scheme in schemes]
        except RunError:
            continue
        for scheme, error, least in zip(schemes, errors, worst, strict=True):
            found[scheme].append(error / least)
    return found
