"""Rounding: what it costs eta in each engine, and what a collision makes of it."""

import sys
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.compositions import COMPOSITIONS
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.measured import measured

# LAMMPS holds absolute coordinates, up to n, rounded to n eps against displacements of order v0:
# |error of eta| / (n eps/v0). It is larger where a drift of one stage is so short that its rounding
# is no longer random: below so many n eps. By choice at least what finer steps and slower chains
# than are drawn needed.
COORDINATE_ROUNDING: float = measured("coordinate_rounding", 6.0)
SHORT_DRIFT_ROUNDING: float = measured("short_drift_rounding", 15.0)
SHORT_DRIFT = 1e3
# The mixture of an extrapolated step amplifies rounding, by its worst case times this.
EXTRAPOLATED_ROUNDING: float = measured("extrapolated_rounding")
# Long chains that break amplify rounding. The in-house engine, whose strains are rounded to eps,
# tells how much by two nudges of the speed, coordinates being rounded n/v0 times more coarsely:
# error over that. By choice at least what chains of 1000 needed.
NUDGE_RESERVE: float = measured("nudge_reserve", 6.0)
# At tolerances below so many times the plain rounding, its amplification must be looked at. A
# choice, not a measurement: amplifications are known up to 1e7, but from about 1e5 on no two steps
# agree any more, and the step's error says so.
_AMPLIFICATION_MATTERS = 1e5
# The arithmetic itself, a particle: the squared mean of n velocities over hundreds of contacts.
ARITHMETIC_FLOOR: float = measured("arithmetic_floor")
# In units of eps times the root of the number of kicks: a run of 1e8 Verlet steps errs by 0.7 of
# eps 1e4, with a reserve of four. A choice.
_ROUNDINGS = 3.0


def rounding_error(engine: str, scene: Scene, stage: float | None = None) -> float:
    """
    Return the error of eta due to rounding.

    That is the arithmetic's floor, which grows with n; and with the engine ``lammps``, which holds
    absolute coordinates where others hold strains, n eps/v0 times what was measured. `stage` is the
    shortest of a step, None where it is not known yet.
    """
    n = scene.all_particles
    # A displacement is of order v0 times the time of a vibration.
    v0 = scene.impact_velocity / scene.slow_stiffness**0.5
    arithmetic = arithmetic_error(n, heat_of(scene))
    if engine != "lammps":
        return arithmetic
    grain = n * sys.float_info.epsilon
    short = stage is not None and v0 * stage < SHORT_DRIFT * grain
    share = SHORT_DRIFT_ROUNDING if short else COORDINATE_ROUNDING
    return arithmetic + share * grain / v0 * heat_of(scene) ** 0.5


def rounding_matters(engine: str, scene: Scene, goal: float) -> bool:
    """Return whether the rounding that a collision may amplify comes near a goal."""
    return goal < _AMPLIFICATION_MATTERS * rounding_error(engine, scene)


def arithmetic_error(particles: int, heat: Any) -> Any:
    """Return what the arithmetic itself costs eta; for `heat`, or an array of it, see `heat_of`."""
    return ARITHMETIC_FLOOR * particles * heat


def heat_of(scene: Scene) -> float:
    """
    Return the energy that two bodies come with over that of their relative translation.

    A chain that vibrates rounds velocities that are larger than its own by the root of this, and
    may come back faster than it came. 1 for a cold chain.
    """
    if scene.line.cold:
        return 1.0
    chain = float(scene.line.chain_masses.sum())
    return max(scene.start_energy / (0.5 * chain * scene.impact_velocity**2), 1.0)


def rounding_of(outcome: Outcome, scene: Scene) -> float:
    """Return the error of eta due to rounding in a run, see :func:`rounding_error`."""
    if outcome.timestep is None:
        return rounding_error(outcome.engine, scene)
    if outcome.engine != "lammps":
        return max(rounding_error(outcome.engine, scene), _walk_of_rounding(outcome))
    return rounding_of_steps(scene, outcome.scheme, outcome.timestep)


def _walk_of_rounding(outcome: Outcome) -> float:
    """Return what the roundings of all steps add up to, each with its sign by chance."""
    assert outcome.timestep is not None
    steps = float(outcome.contact_times[-1]) / outcome.timestep
    if outcome.scheme in STEP_SCHEMES:
        steps *= STEP_SCHEMES[outcome.scheme].evaluations
    return _ROUNDINGS * sys.float_info.epsilon * steps**0.5


def rounding_of_steps(scene: Scene, scheme: str, timestep: float) -> float:
    """Return the error of eta due to rounding in LAMMPS, with a scheme and a step."""
    steps = STEP_SCHEMES[scheme]
    if scheme in COMPOSITIONS:
        return rounding_error("lammps", scene, steps.shortest_stage(timestep))
    arithmetic = rounding_error("reference", scene)
    return arithmetic + coarsening(scheme) * (rounding_error("lammps", scene) - arithmetic)


def coarsening(scheme: str) -> float:
    """Return how many times more rounding costs in LAMMPS than with composed steps."""
    if scheme in COMPOSITIONS:
        return 1.0
    extrapolated = EXTRAPOLATED_ROUNDING * STEP_SCHEMES[scheme].amplification
    return max(1.0, extrapolated / COORDINATE_ROUNDING)


def amplified_rounding(engine: str, sensitivity: float, scene: Scene) -> float:
    """
    Return the error of eta due to rounding that the collision amplifies.

    `sensitivity` is the change of the in-house eta when all roundings change, to which a reserve is
    added; for ``lammps``, times how much more coarsely coordinates are rounded than strains.
    """
    n = scene.all_particles
    coarser = n * scene.slow_stiffness**0.5 / scene.impact_velocity if engine == "lammps" else 1.0
    return NUDGE_RESERVE * sensitivity * coarser
