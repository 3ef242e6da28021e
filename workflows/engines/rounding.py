"""Estimate the rounding error of eta in each engine, and its amplification by a collision."""

import sys
from typing import Any

from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.schemes import COMPOSITIONS
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.measured import measured

# LAMMPS stores absolute coordinates up to n. Their rounding errors are about n eps, whereas
# displacements are about v0. The constants are |error of eta| / (n eps/v0). SHORT_DRIFT_ROUNDING
# applies if a stage moves particles by less than `SHORT_DRIFT` times n eps, because the rounding
# errors of such short drifts are not random. The second arguments are lower limits of the
# constants. They are choices that cover finer steps and slower chains than the sampled ones.
COORDINATE_ROUNDING: float = measured("coordinate_rounding", 6.0)
SHORT_DRIFT_ROUNDING: float = measured("short_drift_rounding", 15.0)
SHORT_DRIFT = 1e3
# Extrapolated steps with the weights c_m cause a rounding error of eta of this constant times sum
# |c_m| n eps/v0.
EXTRAPOLATED_ROUNDING: float = measured("extrapolated_rounding")
# Long chains that break amplify rounding errors. The reference engine, which stores strains rounded
# to eps, measures the amplification with two nudges, which are tiny changes of the impact speed.
# The rounding errors of LAMMPS's coordinates are n/v0 times larger than those of strains. The
# constant is the true error divided by the error that the nudges predict. Its lower limit is a
# choice that covers chains of 1000 particles.
NUDGE_RESERVE: float = measured("nudge_reserve", 6.0)
# The amplification is checked if the tolerance is below this factor times the rounding error
# without amplification. The factor is a choice. Amplifications up to 1e7 occur. Above about 1e5,
# however, results at different time steps no longer agree, and the estimated error of the step
# already shows the amplification.
_AMPLIFICATION_MATTERS = 1e5
# Error of eta per particle due to rounding in the arithmetic. Here eta is the squared mean of n
# velocities after hundreds of contacts.
ARITHMETIC_FLOOR: float = measured("arithmetic_floor")
# The rounding error of a run is at most this factor times eps times the square root of the number
# of kicks. In a measured run of 1e8 Verlet steps the factor is 0.7; the constant is four times
# larger.
_ROUNDINGS = 3.0


def rounding_error(engine: str, problem: Problem, stage: float | None = None) -> float:
    """
    Return the error of eta due to rounding.

    The error of the arithmetic grows with n. The engine ``lammps`` stores absolute coordinates
    instead of strains; its error is larger by a measured constant times n eps/v0. `stage` is the
    shortest Verlet step within a step; None if it is not known yet.
    """
    n = problem.all_particles
    # Displacements are about the impact velocity divided by the frequency of the bonds.
    v0 = problem.impact_velocity / problem.slow_stiffness**0.5
    arithmetic = arithmetic_error(n, problem.energy_ratio)
    if engine != "lammps":
        return arithmetic
    grain = n * sys.float_info.epsilon
    short = stage is not None and v0 * stage < SHORT_DRIFT * grain
    share = SHORT_DRIFT_ROUNDING if short else COORDINATE_ROUNDING
    return arithmetic + share * grain / v0 * problem.energy_ratio**0.5


def rounding_matters(engine: str, problem: Problem, target_error: float) -> bool:
    """Return whether rounding errors, amplified by the collision, may reach a target error."""
    return target_error < _AMPLIFICATION_MATTERS * rounding_error(engine, problem)


def arithmetic_error(particles: int, heat: Any) -> Any:
    """Return the arithmetic rounding error of eta; `heat`, an energy ratio, may be an array."""
    return ARITHMETIC_FLOOR * particles * heat


def rounding_of(outcome: Outcome) -> float:
    """Return the error of eta due to rounding in a run, see :func:`rounding_error`."""
    problem = outcome.problem
    if outcome.timestep is None:
        return rounding_error(outcome.engine, problem)
    if outcome.engine != "lammps":
        return max(rounding_error(outcome.engine, problem), _walk_of_rounding(outcome))
    return rounding_of_steps(problem, outcome.scheme, outcome.timestep)


def _walk_of_rounding(outcome: Outcome) -> float:
    """Return the rounding error of a run whose steps have rounding errors of random sign."""
    assert outcome.timestep is not None
    steps = float(outcome.contact_times[-1]) / outcome.timestep
    if outcome.scheme in STEP_SCHEMES:
        steps *= STEP_SCHEMES[outcome.scheme].evaluations
    return _ROUNDINGS * sys.float_info.epsilon * steps**0.5


def rounding_of_steps(problem: Problem, scheme: str, timestep: float) -> float:
    """Return the rounding error of eta in LAMMPS for a scheme and a step."""
    steps = STEP_SCHEMES[scheme]
    if scheme in COMPOSITIONS:
        return rounding_error("lammps", problem, steps.shortest_stage(timestep))
    arithmetic = rounding_error("reference", problem)
    return arithmetic + coarsening(scheme) * (rounding_error("lammps", problem) - arithmetic)


def coarsening(scheme: str) -> float:
    """Return the factor by which a scheme in LAMMPS has more rounding error than composed steps."""
    if scheme in COMPOSITIONS:
        return 1.0
    extrapolated = EXTRAPOLATED_ROUNDING * STEP_SCHEMES[scheme].amplification
    return max(1.0, extrapolated / COORDINATE_ROUNDING)


def amplified_rounding(engine: str, sensitivity: float, problem: Problem) -> float:
    """
    Return the error of eta due to rounding that the collision amplifies.

    `sensitivity` is the change of eta in the reference engine when all rounding errors change. It
    is multiplied by a reserve. For ``lammps`` it is also multiplied by the ratio between the
    rounding errors of coordinates and of strains.
    """
    n = problem.all_particles
    coarser = (
        n * problem.slow_stiffness**0.5 / problem.impact_velocity if engine == "lammps" else 1.0
    )
    return NUDGE_RESERVE * sensitivity * coarser
