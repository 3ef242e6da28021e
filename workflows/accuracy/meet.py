"""Tolerance in, numerics and error bar out."""

from collections.abc import Callable
from dataclasses import replace

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.answer import Answer, goal_above, reason_missed
from chaincor.workflows.accuracy.by_in_house import SHARPEST_FIXED, meet_in_house
from chaincor.workflows.accuracy.by_lammps import SHARPEST_LAMMPS, meet_with_lammps
from chaincor.workflows.accuracy.in_house_runs import find_rounding_sensitivity
from chaincor.workflows.accuracy.step_guess import sharpness
from chaincor.workflows.accuracy.warm import WarmMeetings, is_warm
from chaincor.workflows.engines.in_house.modal import serves
from chaincor.workflows.engines.rounding import amplified_rounding, rounding_error, rounding_matters
from chaincor.workflows.engines.time_limit import time_limit

# Where one goal is missed: rounding may take more of a short step than was foreseen, by up to one
# decade; more decades are missed only where nothing converges, and then the bar is not small.
_MOST_LOOSER = 2


def meet(scene: Scene, tolerance: float) -> Answer:
    """
    Run a scene with the numerics that usually meet a tolerance most cheaply, and prove it.

    Numerics are chosen for goals that are powers of ten, the largest within the tolerance or, where
    that is below rounding, the first below rounding. Where a goal is missed the next looser one is
    tried, too, and the smallest bar counts.
    """
    if is_warm(scene) and (usual := WarmMeetings(scene).meet_alone()):
        return usual
    goal, sensitivity = goal_of(scene, tolerance)
    in_house = scene.engine != "lammps"
    meet_goal: Callable[..., Answer] = meet_in_house if in_house else meet_with_lammps
    loosest = goal * 10.0**_MOST_LOOSER
    best = found = meet_goal(scene, goal, sensitivity)
    for _ in range(_MOST_LOOSER):
        # What contacts after an open end could change, no step makes less; and where refinement
        # stalled above the roundings, a smaller bar at looser steps would be luck.
        assert found.bar.step is not None
        stalled = found.bar.step > max(goal, found.bar.rounding)
        # Nor is it less where steps that amplify no rounding leave more than the loosest goal.
        hopeless = (
            loosest
            < found.bar.rounding
            <= amplified_rounding(scene.engine, found.rounding_sensitivity, scene)
        )
        short = time_limit().was_short  # for looser goals, too
        if found.error - found.bar.ending <= goal or stalled or hopeless or short:
            break
        goal *= 10.0
        # What roundings make of a collision they make of it at any step: none is lucky.
        sensitivity = max(sensitivity, found.rounding_sensitivity)
        known = (found.outcome,) if in_house else ()
        found = meet_goal(scene, goal, sensitivity, *known)
        best = min(best, found, key=lambda each: each.error)
    return replace(best, reason=reason_missed(best, tolerance))


def goal_of(scene: Scene, tolerance: float) -> tuple[float, float]:
    """
    Return the goal that numerics are chosen for, and the rounding sensitivity of the in-house eta.

    The latter where numerics hinge on it, else 0: cold chains at a wall are nudged in-house with
    the steps that resolve them, as coarse ones may tell of far more.
    """
    goal = goal_above(rounding_error(scene.engine, scene), tolerance)
    # Light particles between heavy ones amplify more than equal ones ever do.
    matters = not scene.line.uniform
    matters |= scene.engine == "lammps" and rounding_matters("lammps", scene, goal)
    return goal, find_rounding_sensitivity(scene) if matters and _steps_are_fixed(scene) else 0.0


def _steps_are_fixed(scene: Scene) -> bool:
    """Return whether eta comes from fixed steps, whose rounding a collision may amplify."""
    if serves(scene):
        return False  # no chaos
    sharpest = SHARPEST_LAMMPS if scene.engine == "lammps" else SHARPEST_FIXED
    return sharpness(scene) <= sharpest
