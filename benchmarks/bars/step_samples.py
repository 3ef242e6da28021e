"""Errors at steps that are equal in units of the fastest bond, and their scatter between scenes."""

import numpy as np

from benchmarks.bars.samples import Random, Samples, draw_scene, find_reference
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import COMPOSITIONS, SCHEMES, StepSchemeName
from chaincor.workflows.accuracy.pilot_run import pilot_from_run
from chaincor.workflows.accuracy.reference_runs import run_reference
from chaincor.workflows.accuracy.step_guess import frequency_ratio
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.errors import RunError

# Nearby steps, at which contacts have different phases within a step.
_PHASES = tuple(np.linspace(0.97, 1.0, 8).tolist())


def _error(scene: Scene, scheme: StepSchemeName, reference_value: float) -> float:
    step = SCHEMES[scheme].usual_step / frequency_ratio(scene.problem)
    return abs(run_reference(scene.problem, scheme, step).eta - reference_value)


def _lammps_errors(scene: Scene, shares: tuple[float, ...]) -> dict[str, float]:
    """Return the largest error in LAMMPS at some fractions of each scheme's usual step."""
    reference_value = find_reference(scene)
    bonds = pilot_from_run(reference_value).table_range()
    worst = {}
    for name, facts in COMPOSITIONS.items():
        steps = [share * facts.usual_step / frequency_ratio(scene.problem) for share in shares]
        numerics = Numerics(scheme=name, timestep=steps[0], bond_range=bonds)
        runs = lammps.run_at_steps(scene.problem, numerics, steps)
        worst[str(name)] = max(abs(run.eta - reference_value.restitution) for run in runs)
    return worst


def usual_error(random: Random, count: int) -> Samples:
    """Error of the reference engine at the usual step of a scheme, for 50 to 200 particles."""
    found: Samples = {scheme: [] for scheme in SCHEMES}
    while len(found["verlet"]) < count:
        scene = draw_scene(random).replace(particles=int(random.integers(50, 200)))
        try:
            reference_value = find_reference(scene).restitution
            errors = [_error(scene, scheme, reference_value) for scheme in SCHEMES]
        except RunError:
            continue
        for scheme, error in zip(SCHEMES, errors, strict=True):
            found[scheme].append(error)
    return found


def promise_reserve(random: Random, count: int) -> Samples:
    """Error in LAMMPS at scaled steps, divided by the largest of lj at 0.4 v* and n = 100."""
    worst = _lammps_errors(Scene(), _PHASES)
    found: Samples = {scheme: [] for scheme in worst}
    while len(found["verlet"]) < count:
        # The advice is for longer chains. Errors of a few particles behave differently.
        scene = draw_scene(random).replace(particles=round(20.0 * 10.0 ** random.uniform()))
        try:
            errors = _lammps_errors(scene, (1.0,))
        except RunError:
            continue
        for scheme, error in errors.items():
            found[scheme].append(error / worst[scheme])
    return found
