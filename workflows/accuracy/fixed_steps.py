"""Meeting a tolerance with fixed steps of the in-house engine."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.answer import Answer, answer, spread_of
from chaincor.workflows.accuracy.in_house_runs import eta_of, run_in_house
from chaincor.workflows.accuracy.regular import LONGEST_TRUSTED, refine_regularly
from chaincor.workflows.accuracy.rounding_sensitivity import LONG, nudged_change
from chaincor.workflows.accuracy.step_guess import STEP_SHARE
from chaincor.workflows.engines.ending import quiet_time
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import amplified_rounding, rounding_error, rounding_matters
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.measured import measured

# Schemes, and above which goal each is usually the cheapest.
_SCHEMES: dict[StepSchemeName, float] = measured("in_house_schemes")
# This one amplifies rounding least: longer chains than so many particles, where contacts that graze
# make much of the last digit, take it at any goal. Costs only.
_PLAINEST: StepSchemeName = "srkn14"
# Bodies that need more steps tried amplify more than usual.
_USUAL_TRIES = 3


def usual_scheme(goal: float) -> StepSchemeName:
    """Return the scheme of fixed steps that usually meets a goal most cheaply."""
    return next(name for name, least in _SCHEMES.items() if goal > least)


def _plain_scheme(scene: Scene, goal: float, sensitivity: float) -> StepSchemeName:
    """Return the usual scheme, or one that amplifies rounding less where there is much of it."""
    scheme = usual_scheme(goal)
    if scheme == _PLAINEST:
        return scheme
    if scene.line.uniform:
        return _PLAINEST if scene.particles > LONG else scheme
    amplified = sensitivity * STEP_SCHEMES[scheme].amplification
    return (
        _PLAINEST
        if amplified_rounding("reference", amplified, scene) > STEP_SHARE * goal
        else scheme
    )


def meet_with_fixed_steps(
    scene: Scene, goal: float, sensitivity: float, followed: Outcome | None = None
) -> Answer:
    """
    Start from the usual step of a scheme and refine until three steps agree.

    For `sensitivity` and `followed` see
    :func:`chaincor.workflows.accuracy.by_in_house.meet_in_house`.
    """
    scheme = _plain_scheme(scene, goal, sensitivity)
    found = _meet_with_scheme(scene, goal, scheme, sensitivity, followed)
    assert found.bar.step is not None
    reachable = max(goal, rounding_error("reference", scene))
    if scheme != _PLAINEST and found.bar.rounding > reachable >= found.bar.step:
        plainest = _meet_with_scheme(scene, goal, _PLAINEST, found.rounding_sensitivity, followed)
        return min(found, plainest, key=lambda each: each.bar.total or math.inf)
    return found


def _meet_with_scheme(
    scene: Scene, goal: float, scheme: StepSchemeName, sensitivity: float, followed: Outcome | None
) -> Answer:
    """Refine the steps of one scheme, and ask what comes after them and what roundings make."""
    floor = rounding_error("reference", scene)
    found = refine_regularly(scene, goal, scheme, floor, followed)
    fine, error, proof = found.fine, found.error, found.proofs[0]
    step = fine.timestep
    assert step is not None
    if followed is None and fine is not found.first:
        whole = run_in_house(scene, scheme, step)
        error = max(error, abs(eta_of(scene, whole) - eta_of(scene, fine)))
        fine = with_doubts(whole, (fine, proof))
    quiet = quiet_time(scene.span, scene.slow_stiffness)
    silent = np.max(np.diff(fine.contact_times), initial=0.0) > quiet
    # Light particles between heavy ones, bodies and warm chains were looked at before, at a step
    # that is long for those that need many tries. What comes after a long silence of a chain that
    # broke amplifies rounding, too; where a step makes or takes a contact, roundings may as well,
    # and in long chains that need finer steps than usual.
    refined = scene.particles > LONGEST_TRUSTED and len(found.tries) > 1
    matters = sensitivity > 0.0 or refined or rounding_matters("reference", scene, goal)
    hard = not scene.line.uniform and len(found.tries) > _USUAL_TRIES
    if (scene.line.uniform and matters) or silent or found.grazes or found.stalled or hard:
        amplification = STEP_SCHEMES[scheme].amplification  # which the bar multiplies with
        changed = found.nudged or nudged_change(scene, scheme, step, fine)
        sensitivity = max(sensitivity, changed / amplification)
        sure = not scene.line.uniform and fine.ending.kind == "proved"
        if silent and max(amplification * sensitivity, error) > goal and not sure:
            # Where roundings decide how hard it is, they may decide whether another one comes.
            another = 2.0 * float(fine.contact_speeds[-1])
            fine = replace(fine, ending=fine.ending.doubted(another))
    details = {"choice": {"tries": found.tries}, "spread": spread_of(scene, fine, proof)}
    return answer(scene, fine, error, details, sensitivity)


def with_doubts(outcome: Outcome, others: Sequence[Outcome]) -> Outcome:
    """
    Return an outcome whose end is in doubt where those of others are, or their last hits differ.

    Parameters
    ----------
    outcome : Outcome
        The run that gives the number.
    others : sequence of Outcome
        The same collision at other steps.

    Returns
    -------
    Outcome
        With the momentum in doubt.
    """
    ending = outcome.ending
    for other in others:
        ending = ending.doubted(other.ending.missed_momentum)
        # A graze in mid collision that one run has and the other has not is part of their
        # difference; what comes after the other's last contact may be the first of more.
        sooner, later = sorted((outcome, other), key=lambda each: float(each.contact_times[-1]))
        same = int(np.argmin(np.abs(later.contact_times - sooner.contact_times[-1])))
        ending = ending.doubted(2.0 * float(np.sum(later.contact_speeds[same + 1 :])))
    return replace(outcome, ending=ending)
