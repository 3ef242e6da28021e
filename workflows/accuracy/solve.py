"""Solve a scene to a tolerance: choose numerics, run, and compute the error bar."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from chaincor.workflows.accuracy.bounded_run import (
    PROOF_SHARE,
    BoundedRun,
    error_bar,
    reason_missed,
    spread_of,
)
from chaincor.workflows.accuracy.by_lammps import solve_with_lammps
from chaincor.workflows.accuracy.by_reference import solve_with_reference
from chaincor.workflows.accuracy.pilot_run import usual_pilot_run
from chaincor.workflows.accuracy.plan import Plan
from chaincor.workflows.accuracy.reference_runs import find_rounding_sensitivity, largest_difference
from chaincor.workflows.accuracy.solvers import EXACT_MODES, FIXED_STEPS, LAMMPS
from chaincor.workflows.accuracy.warm import WarmSolver, is_warm
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.rounding import amplified_rounding, rounding_matters
from chaincor.workflows.engines.time_limit import time_limit
from chaincor.workflows.errors import ToleranceError

# If a target error is missed, at most this many looser targets are tried. The rounding error of a
# short step may exceed its forecast by up to one decade. A run misses more decades only if nothing
# converges; its error bar is then large.
_MOST_LOOSER = 2


def run_as_planned(planned: Plan) -> BoundedRun:
    """Run a plan to its tolerance, or with its explicit numerics."""
    return _run_as_given(planned) if planned.tolerance is None else solve_to_tolerance(planned)


def solve_to_tolerance(planned: Plan) -> BoundedRun:
    """
    Run a plan until the result is proved to meet its tolerance.

    Numerics are chosen for a target error: the largest power of ten up to the tolerance or, if this
    is below the rounding error, up to the rounding error. If the target error is missed, the next
    looser targets are tried, and the run with the smallest error bar is returned. Raises
    ToleranceError if this error bar is so large that eta is meaningless.
    """
    problem, tolerance = planned.problem, planned.tolerance
    assert tolerance is not None
    if is_warm(planned) and (usual := WarmSolver(problem, tolerance).solve_alone()):
        return usual
    target_error, sensitivity = target_error_of(planned)
    by_reference = planned.solver is not LAMMPS
    with_lammps = partial(solve_with_lammps, files=planned.files)
    solve_goal: Callable[..., BoundedRun] = solve_with_reference if by_reference else with_lammps
    loosest = target_error * 10.0**_MOST_LOOSER
    best = found = solve_goal(problem, target_error, sensitivity)
    for _ in range(_MOST_LOOSER):
        # Smaller steps do not reduce the error from contacts after an open end. If the refinement
        # stalled at an error above both the loosest target and the rounding error, a smaller error
        # bar at longer steps would be a coincidence.
        assert found.bar.step is not None
        stalled = found.bar.step > max(loosest, found.bar.rounding)
        # Looser targets are also hopeless if the amplified rounding error exceeds the loosest
        # target.
        hopeless = (
            loosest
            < found.bar.rounding
            <= amplified_rounding(planned.engine, found.rounding_sensitivity, problem)
        )
        short = time_limit().was_short  # then there is no time for looser targets either
        if found.error - found.bar.ending <= target_error or stalled or hopeless or short:
            break
        target_error *= 10.0
        # The amplification of rounding errors is a property of the collision and does not depend on
        # the step.
        sensitivity = max(sensitivity, found.rounding_sensitivity)
        known = (found.outcome,) if by_reference else ()
        found = solve_goal(problem, target_error, sensitivity, *known)
        best = min(best, found, key=lambda each: each.error)
    eta = best.outcome.eta
    if not best.error <= max(1.0, eta):
        raise ToleranceError(
            f"the error of eta is {best.error:.2g}, so that its value {eta:.3g} says nothing. "
            "Take another speed, fewer particles or engine 'reference'"
        )
    return replace(best, reason=reason_missed(best, tolerance))


def _run_as_given(planned: Plan) -> BoundedRun:
    """Run the numerics of the user, with an error bar from runs at other steps."""
    problem, numerics = planned.problem, planned.numerics
    assert numerics is not None
    details: dict[str, Any] = {}
    pilot = usual_pilot_run(problem, files=planned.files) if planned.solver is LAMMPS else None
    # The pilot run has recorded the range of all bond lengths.
    if pilot is not None:
        numerics = replace(numerics, bond_range=pilot.table_range())
    timesteps = [share * numerics.timestep for share in (1.0, *planned.proofs)]
    if planned.solver is LAMMPS:
        outcome, *others = lammps.run_at_steps(problem, numerics, timesteps, files=planned.files)
    else:
        runs = (replace(numerics, timestep=step) for step in timesteps)
        outcome, *others = (planned.solver.run(problem, each) for each in runs)
    if pilot is not None:
        details["scouting"] = pilot.beside(outcome)
    step = None
    if others:
        share = PROOF_SHARE[numerics.wall]
        step = share * largest_difference(outcome, others)
        # The ratio between error and difference is assumed to be the same for arrays as for eta.
        spreads = [spread_of(outcome, run) for run in others]
        details["spread"] = {name: share * max(s[name] for s in spreads) for name in spreads[0]}
    bar = error_bar(outcome, step)
    return BoundedRun(outcome, bar, details=details, others=tuple(others))


def target_error_of(planned: Plan) -> tuple[float, float]:
    """
    Return the target error of a plan, and the rounding sensitivity of eta.

    The sensitivity is 0 unless the numerics depend on it. The reference engine measures it by
    nudges of the impact velocity. The steps must resolve the chain, because coarse steps may
    overestimate the sensitivity.
    """
    problem, target_error = planned.problem, planned.target_error
    assert target_error is not None
    # Light particles between heavy particles amplify rounding errors more than equal particles.
    matters = not problem.line.has_equal_masses
    matters |= planned.solver is LAMMPS and rounding_matters("lammps", problem, target_error)
    # Harmonic chains amplify no rounding errors, because the motion of modes is not chaotic. Steps
    # that do not resolve the bonds cannot measure the amplification.
    stepped = planned.solver in (FIXED_STEPS, LAMMPS) and not EXACT_MODES.supports(problem)
    stepped &= (
        not problem.bond.only_pushes
    )  # fixed steps of the reference engine cannot follow beads
    if not (matters and stepped and planned.solver.resolves(problem)):
        return target_error, 0.0
    return target_error, find_rounding_sensitivity(problem)
