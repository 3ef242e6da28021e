"""Estimate the rounding error of eta in each engine, and its amplification by a collision."""

import sys
from typing import Any

from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.compositions import COMPOSITIONS
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.measured import measured

# LAMMPS holds absolute coordinates up to n, so rounding is n eps against displacements of order v0.
# The constants are |error of eta| / (n eps/v0). The second constant applies if the drift of a stage
# is below `SHORT_DRIFT` times n eps, because the rounding of so short a drift is not random. The
# lower limits are choices that cover steps finer and chains slower than the sampled ones.
COORDINATE_ROUNDING: float = measured("coordinate_rounding", 6.0)
SHORT_DRIFT_ROUNDING: float = measured("short_drift_rounding", 15.0)
SHORT_DRIFT = 1e3
# The rounding of an extrapolated step is this number times the worst amplification by its
# combination.
EXTRAPOLATED_ROUNDING: float = measured("extrapolated_rounding")
# Long chains that break amplify rounding. The reference engine, whose strains are rounded to eps,
# measures the amplification by two nudges of the speed. Coordinates are rounded n/v0 times more
# coarsely. The constant is the error divided by this estimate; the lower limit is a choice that
# covers chains of 1000 particles.
NUDGE_RESERVE: float = measured("nudge_reserve", 6.0)
# Below this number times the plain rounding, a tolerance requires a check of the amplification.
# This limit is a choice. Amplifications up to 1e7 occur. Above about 1e5, however, results at
# different steps no longer agree, so the error of the step already shows the amplification.
_AMPLIFICATION_MATTERS = 1e5
# The arithmetic of each particle has this rounding: the squared mean of n velocities over hundreds
# of contacts.
ARITHMETIC_FLOOR: float = measured("arithmetic_floor")
# A run has this rounding in units of eps times the root of the number of kicks. In a run of 1e8
# Verlet steps the error is 0.7 times eps times 1e4; the constant is four times larger.
_ROUNDINGS = 3.0


def rounding_error(engine: str, problem: Problem, stage: float | None = None) -> float:
    """
    Return the error of eta due to rounding.

    The error is the floor of the arithmetic, which grows with n. For the engine ``lammps``, which
    holds absolute coordinates instead of strains, a measured constant times n eps/v0 is added.
    `stage` is the shortest stage of a step; None if it is not known yet.
    """
    n = problem.all_particles
    # A displacement is of order v0 times the time of a vibration.
    v0 = problem.impact_velocity / problem.slow_stiffness**0.5
    arithmetic = arithmetic_error(n, heat_of(problem))
    if engine != "lammps":
        return arithmetic
    grain = n * sys.float_info.epsilon
    short = stage is not None and v0 * stage < SHORT_DRIFT * grain
    share = SHORT_DRIFT_ROUNDING if short else COORDINATE_ROUNDING
    return arithmetic + share * grain / v0 * heat_of(problem) ** 0.5


def rounding_matters(engine: str, problem: Problem, target_error: float) -> bool:
    """Return whether rounding, if amplified by the collision, may come near a target error."""
    return target_error < _AMPLIFICATION_MATTERS * rounding_error(engine, problem)


def arithmetic_error(particles: int, heat: Any) -> Any:
    """Return the arithmetic rounding error of eta; `heat`, from `heat_of`, may be an array."""
    return ARITHMETIC_FLOOR * particles * heat


def heat_of(problem: Problem) -> float:
    """
    Return the initial energy of two bodies over the energy of their relative translation.

    The ratio is 1 for a cold chain. In a vibrating chain, the velocities that are rounded exceed
    the velocity of its centre of mass by the root of this ratio. Such a chain may leave faster than
    it came.
    """
    if problem.line.cold:
        return 1.0
    chain = float(problem.line.chain_masses.sum())
    return max(problem.start_energy / (0.5 * chain * problem.impact_velocity**2), 1.0)


def rounding_of(outcome: Outcome) -> float:
    """Return the error of eta due to rounding in a run, see :func:`rounding_error`."""
    problem = outcome.problem
    if outcome.timestep is None:
        return rounding_error(outcome.engine, problem)
    if outcome.engine != "lammps":
        return max(rounding_error(outcome.engine, problem), _walk_of_rounding(outcome))
    return rounding_of_steps(problem, outcome.scheme, outcome.timestep)


def _walk_of_rounding(outcome: Outcome) -> float:
    """Return the sum of the rounding errors of all steps, with random signs."""
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
    """Return the ratio of the rounding error in LAMMPS to the rounding error of composed steps."""
    if scheme in COMPOSITIONS:
        return 1.0
    extrapolated = EXTRAPOLATED_ROUNDING * STEP_SCHEMES[scheme].amplification
    return max(1.0, extrapolated / COORDINATE_ROUNDING)


def amplified_rounding(engine: str, sensitivity: float, problem: Problem) -> float:
    """
    Return the error of eta due to rounding that the collision amplifies.

    `sensitivity` is the change of eta in the reference engine when all roundings change. A reserve
    is added. For ``lammps`` the result is multiplied by the ratio of the rounding of coordinates to
    the rounding of strains.
    """
    n = problem.all_particles
    coarser = (
        n * problem.slow_stiffness**0.5 / problem.impact_velocity if engine == "lammps" else 1.0
    )
    return NUDGE_RESERVE * sensitivity * coarser
