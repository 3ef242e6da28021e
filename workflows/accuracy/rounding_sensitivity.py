"""How much eta changes when all roundings change: what a collision makes of the last digit."""

import math
import sys

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.in_house_runs import eta_of, run_in_house
from chaincor.workflows.accuracy.refining import Policy, Try, refine, that_ran
from chaincor.workflows.accuracy.step_guess import guess_step
from chaincor.workflows.engines.in_house import stepping
from chaincor.workflows.engines.outcome import Outcome

# Longer chains have contacts that graze the wall and make much of the last digit.
LONG = 1500
# By how many units of rounding the impact velocity is changed. Of lj chains of 3000 at 0.39 v*,
# one in three has other last contacts than the rest, and eta 0.7833 to 0.7842 in place of 0.7813:
# two nudges and three steps all agreed. Eight and three do so by chance in one case of a hundred.
_NUDGES = (-5.0, 3.0)
_NUDGES_OF_LONG = (*_NUDGES, -9.0, 7.0, -2.0, 11.0, -14.0, 5.0)
# Steps for this error resolve whatever amplifies rounding.
_GOAL = 1e-9
# Where the usual step does not run: a thousandth of it.
_MOST_HALVINGS = 10


def nudged_change(
    scene: Scene, scheme: StepSchemeName, step: float, plain: Outcome, enough: float = math.inf
) -> float:
    """
    Return how much eta of a run changes for impact velocities a few units of rounding away.

    That is the largest change, or the first that is `enough`.
    """
    worst, eta = 0.0, eta_of(scene, plain)
    for ulps in _NUDGES_OF_LONG if scene.particles > LONG else _NUDGES:
        change = 1.0 + ulps * sys.float_info.epsilon
        if scene.line.uniform:
            nudged, near = scene.replace(speed=None, velocity=change * scene.impact_velocity), step
        else:  # given velocities are not changed: another step rounds everything as well
            nudged, near = scene, change * step
        other = run_in_house(nudged, scheme, near, plain)
        worst = max(worst, abs(eta_of(nudged, other) - eta))
        if worst >= enough:
            break
    return worst


def find_rounding_sensitivity(scene: Scene) -> float:
    """
    Return how much eta changes when all roundings change.

    That is the largest change for impact velocities a few units in the last place away, with a step
    that depends on the scene alone; for bonds that fixed steps can follow.
    """
    # A warm chain that comes slowly is thrown back to the target long after it was there.
    follow = scene.temperature is not None

    def attempt(step: float) -> Try[float]:
        plain = stepping.run(scene, Numerics(scheme="order8", timestep=step), follow=follow)
        return Try(step, 0.0, nudged_change(scene, "order8", step, plain), done=True)

    step = guess_step(scene, "order8", _GOAL)
    found = that_ran(refine(step, attempt, Policy(_MOST_HALVINGS)))[-1].found
    assert found is not None
    return found
