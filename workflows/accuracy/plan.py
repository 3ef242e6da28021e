"""Plan a scene: choose its solver and numerics, and forecast the cost, without a run."""

import math
import sys
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import shown
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.run_files import NO_FILES, RunFiles
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy import irregular, step_proof
from chaincor.workflows.accuracy.bounded_run import PROOF_STEPS, decade_above
from chaincor.workflows.accuracy.by_lammps import (
    COARSER,
    LAMMPS_RUNS,
    REFERENCE_SHARE,
    coarser_target_error,
    least_step,
    usual_schemes,
)
from chaincor.workflows.accuracy.fixed_steps import first_step, plain_scheme
from chaincor.workflows.accuracy.solvers import (
    ADAPTIVE_STEPS,
    EXACT_MODES,
    FIXED_STEPS,
    HARD_SPHERES,
    LAMMPS,
    OVERHEAD,
    REFERENCE_SOLVERS,
    Solver,
    duration_of,
    solver_of,
)
from chaincor.workflows.accuracy.step_guess import (
    contact_is_stiffest,
    frequency_ratio,
    granular_step,
    guess_step,
)
from chaincor.workflows.durations import format_duration
from chaincor.workflows.engines.fragment_bounds import breaking_energy
from chaincor.workflows.engines.rounding import rounding_error
from chaincor.workflows.errors import CostError, RunError

# All runs of the reference engine for one scene cost as much as this many runs at the planned step.
_REFERENCE_RUNS = 2.1
# If the energy can break this many bonds, runs with different time steps diverge so fast that the
# planned time step seldom reaches the target error.
_SHATTERED = 33.0
# The cost was measured for chains of up to this many particles; longer chains do not fit into the
# processor's cache.
_MOST_MEASURED = 500


@dataclass(frozen=True)
class Plan:
    """
    Solver and numerics of a scene.

    With a tolerance, the plan contains the first steps to try. The runs may need smaller steps; the
    step of LAMMPS depends on the reference run.
    """

    problem: Problem  #: Bodies of the collision.
    solver: Solver  #: Solver that computes the result.
    scheme: str | None  #: Scheme of the solver; None without fixed steps.
    numerics: Numerics | None  #: Numerics of the first run; None without fixed steps.
    #: Steps of the runs that prove the result, as multiples of the step of the first run.
    proofs: tuple[float, ...]
    #: Target error for which numerics are chosen; None with explicit numerics.
    target_error: float | None
    seconds: float  #: Expected total time in seconds on one core.
    refusal: str | None = None  #: Reason why no run is possible; None otherwise.
    #: Plan of the reference run that determines the step of LAMMPS.
    reference: "Plan | None" = None
    #: Solver that replaces `solver` if a run of three particles shows that the replacement reaches
    #: the target error.
    instead: Solver | None = None
    tolerance: float | None = None  #: Required absolute error of eta; None with explicit numerics.
    files: RunFiles = NO_FILES  #: Files that the run writes.

    @property
    def engine(self) -> str:
        """Engine of the result."""
        return self.solver.engine

    @property
    def regular(self) -> bool:
        """Whether the plan has fixed steps and smooth bonds, so that errors follow an order."""
        return self.solver is FIXED_STEPS and self.problem.is_smooth

    @property
    def may_take_longer(self) -> bool:
        """Whether runs may take several times the forecast, because the chain is very long."""
        return self.problem.longest_body > _MOST_MEASURED and not EXACT_MODES.supports(self.problem)

    @property
    def usually_shatters(self) -> bool:
        """Whether the chain usually has enough energy to break many bonds."""
        energy = 0.5 * self.problem.particles * self.problem.impact_velocity**2
        return energy > _SHATTERED * breaking_energy(self.problem.bond)

    def to_dict(self) -> dict[str, Any]:
        """Return the plan as a dictionary for JSON."""
        numerics = self.numerics
        tabulated = self.solver is LAMMPS and self.problem.bond.is_tabulated
        step = None if numerics is None else numerics.timestep
        return {
            "solver": self.solver.name,
            "engine": self.solver.engine,
            "wall": None if numerics is None else numerics.wall,
            "scheme": self.scheme,
            "timestep": step,
            "table": numerics.table if numerics is not None and tabulated else None,
            "table_points": None if numerics is None else numerics.table_points,
            "proof_timesteps": [] if step is None else [k * step for k in self.proofs],
            "tolerance": self.tolerance,
            "target_error": self.target_error,
            "seconds": self.seconds,
            "may_take_longer": self.may_take_longer,
            "instead": None if self.instead is None else self.instead.name,
            "reference": None if self.reference is None else self.reference.to_dict(),
        }


def plan(scene: Scene, tolerance: float | None = None) -> Plan:
    """
    Return the plan of a scene; nothing is run.

    Parameters
    ----------
    scene : Scene
        The collision, with its engine, and explicit numerics or a tolerance.
    tolerance : float, optional
        Required absolute error of eta, in place of the tolerance of the scene.

    Returns
    -------
    Plan
        Solver, numerics, proof runs and expected seconds. The expected seconds are right within a
        factor of two for up to 500 particles. Longer chains, which do not fit into the processor's
        cache, may take 15 times longer. Chains that break may take 100 times longer.
    """
    asked = scene.asked_tolerance if tolerance is None else tolerance
    if asked is None:
        planned = _given(scene)
    else:
        problem = scene.problem
        # The target error is never far below the rounding error.
        target_error = decade_above(rounding_error(scene.engine, problem), asked)
        with_engine = _with_lammps if scene.engine == "lammps" else _with_reference
        planned = with_engine(problem, target_error)
    files = NO_FILES if scene.save is None and scene.dump is None else scene.run_files
    reference = planned.reference and replace(planned.reference, tolerance=asked)
    return replace(planned, tolerance=asked, files=files, reference=reference)


def _given(scene: Scene) -> Plan:
    """Return the plan of a scene with explicit numerics."""
    problem, numerics = scene.problem, Numerics.from_scene(scene)
    solver = LAMMPS if scene.engine == "lammps" else FIXED_STEPS
    proofs = PROOF_STEPS if scene.error else ()
    runs = 1.0 + sum(1.0 / share for share in proofs)
    seconds = OVERHEAD[scene.engine] + runs * solver.forecast(problem, numerics)
    return Plan(problem, solver, numerics.scheme, numerics, proofs, None, seconds)


def _with_reference(problem: Problem, target_error: float) -> Plan:
    solver = solver_of(problem, REFERENCE_SOLVERS)
    if solver is FIXED_STEPS:
        return _with_fixed_steps(problem, target_error)
    seconds = solver.forecast(problem, None)
    sharp = solver is ADAPTIVE_STEPS and not problem.bond.only_pushes
    return Plan(
        problem,
        solver,
        None,
        None,
        (),
        target_error,
        seconds,
        instead=HARD_SPHERES if sharp else None,
    )


def _with_fixed_steps(
    problem: Problem, target_error: float, scheme: StepSchemeName | None = None
) -> Plan:
    """Return the plan for fixed steps, with the usual scheme or with the given scheme."""
    reachable = max(target_error, rounding_error("reference", problem))
    if problem.is_smooth:
        scheme = scheme or plain_scheme(problem, target_error, 0.0)
        step = first_step(problem, scheme, reachable)
        proofs: tuple[float, ...] = step_proof.COARSER
    else:
        scheme = "verlet" if problem.bond.kinks else irregular.SCHEME
        step = irregular.first_irregular_step(problem, scheme, reachable, kinked=scheme == "verlet")
        proofs = irregular.COARSER
    numerics = forecast_with = Numerics(scheme=scheme, timestep=step)
    if contact_is_stiffest(problem):
        # Forecast the time with shorter steps, because steps during a stiff contact are shorter
        # than steps between contacts.
        shorter = first_step(problem, plain_scheme(problem, target_error, 0.0), reachable)
        forecast_with = replace(numerics, timestep=min(step, shorter))
    seconds = seconds_of_fixed_steps(problem, forecast_with)
    return Plan(problem, FIXED_STEPS, scheme, numerics, proofs, target_error, seconds)


def seconds_of_fixed_steps(problem: Problem, numerics: Numerics) -> float:
    """Return the expected seconds of all runs with fixed steps in the reference engine."""
    return OVERHEAD["reference"] + _REFERENCE_RUNS * FIXED_STEPS.forecast(problem, numerics)


def _with_lammps(problem: Problem, target_error: float) -> Plan:
    try:
        solver_of(problem, (LAMMPS,))
    except RunError as error:
        overhead = OVERHEAD["lammps"]
        return Plan(problem, LAMMPS, None, None, (), target_error, overhead, refusal=str(error))
    if problem.bond.only_pushes:
        numerics = Numerics(scheme="verlet", timestep=granular_step(problem, target_error))
        run, alone = LAMMPS.forecast(problem, numerics), ADAPTIVE_STEPS.forecast(problem)
        reference = Plan(problem, ADAPTIVE_STEPS, None, None, (), target_error, alone)
        seconds = OVERHEAD["lammps"] + LAMMPS_RUNS * run + alone
        chosen = LAMMPS, "verlet", numerics, (COARSER,), target_error, seconds
        return Plan(problem, *chosen, reference=reference)
    if EXACT_MODES.supports(problem):
        seconds = EXACT_MODES.forecast(problem)
        reference = Plan(problem, EXACT_MODES, None, None, (), target_error, seconds)
    else:
        # The reference engine also uses this scheme when it tries steps for LAMMPS.
        reference = _with_fixed_steps(problem, REFERENCE_SHARE * target_error, "order8")
    usual = usual_schemes(problem, target_error)[0]
    numerics = _in_lammps(problem, usual, target_error)
    run = LAMMPS.forecast(problem, numerics)
    # at kinks Verlet steps are as accurate as any others; a linear table represents kinks
    if problem.bond.kinks:
        numerics = replace(_in_lammps(problem, "verlet", target_error), table="linear")
        run = LAMMPS.forecast(problem, numerics)
    # at most this time, because Verlet steps are taken only if they are cheaper than order 8
    elif usual == "verlet":
        run = LAMMPS.forecast(problem, _in_lammps(problem, "order8", target_error))
    seconds = OVERHEAD["lammps"] + LAMMPS_RUNS * run + reference.seconds
    proofs = (COARSER,)
    scheme = numerics.scheme
    return Plan(
        problem, LAMMPS, scheme, numerics, proofs, target_error, seconds, reference=reference
    )


def _in_lammps(problem: Problem, scheme: StepSchemeName, target_error: float) -> Numerics:
    """Return numerics for LAMMPS with the step that usually reaches a target error."""
    step = (
        guess_step(problem, scheme, coarser_target_error(problem, scheme, target_error)) / COARSER
    )
    if scheme == "verlet":
        step = max(step, least_step(problem, duration_of(problem)))
    return Numerics(scheme=scheme, timestep=step)


def refuse_too_costly(scene: Scene, planned: Plan, most_seconds: float) -> None:
    """Raise CostError if a planned collision is expected to exceed the time limit."""
    # A whole number may be too large for a float, and NaN fails each comparison.
    is_number = isinstance(most_seconds, Real) and not isinstance(most_seconds, bool)
    if not is_number or not (most_seconds <= sys.float_info.max or most_seconds == math.inf):
        raise InputError(
            f"the time limit is {shown(most_seconds)}. Give a number of seconds or hours"
        )
    expected, problem = planned.seconds, planned.problem
    if expected <= most_seconds:
        return
    cheaper = (
        f", or a smaller {problem.line.contact.strength_key}"
        if contact_is_stiffest(problem)
        else ""
    )
    if scene.engine != "reference" and not scene.explicit:
        by_reference = plan(scene.replace(engine="reference")).seconds
        cheaper += f", or use engine 'reference' (about {format_duration(by_reference)})"
    raise CostError(
        f"{scene.particles} particles would take about {format_duration(expected)} on "
        f"one core, but {format_duration(most_seconds)} are allowed. Take fewer "
        f"particles or a larger tolerance or timestep{cheaper}, or allow more "
        "(--most-hours, or most_seconds in Python)"
    )


def describe_plan(planned: Plan) -> str:
    """Return a plan as text."""
    problem, rows = planned.problem, [("solver", planned.solver.name)]
    if planned.instead is not None:
        rows.append(("or", f"{planned.instead.name}, if its error is below the target error"))
    rows += _rows_of_steps(planned)
    if planned.target_error is not None:
        rows.append(("tolerance", f"{planned.tolerance:g}, target error {planned.target_error:g}"))
    if planned.reference is not None:
        steps = [f"{name} {value}" for name, value in _rows_of_steps(planned.reference)]
        rows.append(("reference", ", ".join([planned.reference.solver.name, *steps])))
    longer = ", or several times that" if planned.may_take_longer else ""
    rows.append(("expected", f"{format_duration(planned.seconds)} on one core{longer}"))
    if problem.contact_duration > 0.0:
        rows.append(("contact", problem.line.contact.description))
    rows.append(("bonds swing", f"up to {frequency_ratio(problem):.3g} times as fast as at rest"))
    rows.append(("last contact", f"at about t = {duration_of(problem):.4g}"))
    return "\n".join(f"{name:<13} {value}" for name, value in rows)


def _rows_of_steps(planned: Plan) -> list[tuple[str, str]]:
    numerics = planned.numerics
    if numerics is None:
        return []
    rows = [("scheme", f"{planned.scheme}"), ("step", f"{numerics.timestep:.4g}")]
    if planned.proofs:
        steps = ", ".join(f"{share * numerics.timestep:.4g}" for share in planned.proofs)
        rows.append(("proof runs", f"at steps {steps}"))
    if planned.solver is LAMMPS and planned.problem.bond.is_tabulated:
        points = "as many rows as the force needs"
        if numerics.table_points is not None:
            points = f"{numerics.table_points} rows"
        rows.append(("table", f"{numerics.table}, {points}"))
    return rows
