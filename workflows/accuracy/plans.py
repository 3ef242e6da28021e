"""Plan many scenes; standard chains that differ only in their speed share most of the work."""

from collections.abc import Hashable, Sequence
from dataclasses import replace

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.scene import FILE_KEYS, Scene
from chaincor.workflows.accuracy.fixed_steps import first_step
from chaincor.workflows.accuracy.plan import Plan, plan, seconds_of_fixed_steps
from chaincor.workflows.accuracy.solvers import FIXED_STEPS
from chaincor.workflows.accuracy.step_guess import foresee_frequency_ratio
from chaincor.workflows.engines.rounding import rounding_error


def plans(scenes: Sequence[Scene]) -> list[Plan]:
    """Return the plan of each scene, equal to the result of :func:`plan`."""
    if len(scenes) == 1:
        return [plan(scenes[0])]
    foresee_frequency_ratio(each.problem for each in scenes if each.engine == "reference")
    firsts: dict[Hashable, Plan] = {}
    found = []
    for scene in scenes:
        kind = _kind(scene)
        first = firsts.get(kind)
        planned = None if first is None else _at_speed(first, scene.problem)
        if planned is None:
            planned = plan(scene)
            if kind is not None and planned.regular:
                firsts[kind] = planned
        found.append(planned)
    return found


def _kind(scene: Scene) -> Hashable:
    """Return a key that scenes share if they differ only in their speed; None without a key."""
    if not shares_work(scene):
        return None
    return id(scene.bond), scene.particles, scene.tolerance


def shares_work(scene: Scene) -> bool:
    """
    Return whether a collision can share work with collisions at other speeds.

    It can if a standard chain is solved to a tolerance in the reference engine, without files.
    """
    if scene.engine != "reference" or scene.explicit or not scene.line.is_standard:
        return False
    return not any(key in scene.model_fields_set for key in FILE_KEYS)


def _at_speed(first: Plan, problem: Problem) -> Plan | None:
    """Return the plan of a chain at another speed; None if the chain needs another solver."""
    if not FIXED_STEPS.resolves(problem):
        return None
    assert first.numerics is not None
    assert first.target_error is not None
    scheme = first.numerics.scheme
    reachable = max(first.target_error, rounding_error("reference", problem))
    numerics = Numerics(scheme=scheme, timestep=first_step(problem, scheme, reachable))
    seconds = seconds_of_fixed_steps(problem, numerics)
    return replace(first, problem=problem, numerics=numerics, seconds=seconds)
