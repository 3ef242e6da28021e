"""Meeting a tolerance with LAMMPS: choosing scheme, step and table, proving, refining."""

import math
import time
from dataclasses import dataclass, replace
from typing import Any

from lammps_inputs.numerics import Numerics
from lammps_inputs.potential import compressed_strain
from lammps_inputs.potentials import Harmonic
from lammps_inputs.scene import Scene, TableStyle
from workflows.answer import Answer, answer, spread_of
from workflows.convergence import Converged, converge, eta_of, exact_modes, jitter
from workflows.cost_model import cost_model
from workflows.engines import lammps
from workflows.engines.compositions import COMPOSITIONS
from workflows.error_bars import (
    COARSER_SHARE,
    JITTER_MATTERS,
    TABLE_SENSITIVITY,
    error_bar,
    jitter_error,
    rounding_error,
)
from workflows.errors import LostAtomsError, RunError, TimestepError
from workflows.scouting import Scouting, scouting_details, scouting_from
from workflows.step_guess import guess_step, sharpness
from workflows.step_search import error_near, estimate_step, find_step

# The step may use this share of the tolerance, the table that one; the rest is for rounding.
_STEP_SHARE = 0.5
_TABLE_SHARE = 0.01
# LAMMPS, which has only fixed steps, would need millions of them for bonds sharper than this.
SHARPEST_LAMMPS = 300.0
# The yardstick for choosing a step must be sharper than the tolerance.
TRUTH_SHARE = 0.03
# Schemes that a guess makes this many times dearer than the cheapest are not looked at.
_HOPELESS = 4.0
_MOST_REFINEMENTS = 5
# Past kinks a tolerance is bought with Verlet steps alone: a minute of them, at some 20 ns a bond
# and 1 us a step.
_MOST_BOND_STEPS = 1e9


@dataclass(frozen=True)
class _Candidate:
    numerics: Numerics
    seconds: float
    goal: float


def meet_with_lammps(scene: Scene, tolerance: float) -> Answer:
    """
    Choose LAMMPS's numerics with the in-house integrator, then prove them with LAMMPS alone.

    Parameters
    ----------
    scene : Scene
        The collision.
    tolerance : float
        Error asked of eta.

    Returns
    -------
    Answer
        The number from a step h, its error from a run at 2h and from the choice of h.
    """
    started = time.perf_counter()
    floor = rounding_error("lammps", scene)
    # Below the rounding floor a finer step buys nothing.
    reachable = max(tolerance - floor, floor)
    truth = _yardstick(scene, reachable)
    noise = 0.0
    if tolerance < JITTER_MATTERS * floor:
        noise = _jitter(scene, truth)
        floor = max(floor, jitter_error("lammps", noise, scene))
        reachable = max(tolerance - floor, floor)
    scouting = scouting_from(truth)
    candidate = _cheapest(scene, reachable, truth, scouting)
    chosen = time.perf_counter() - started
    tries: list[dict[str, Any]] = []
    numerics = candidate.numerics
    order = COMPOSITIONS[numerics.scheme].order
    for attempt in range(_MOST_REFINEMENTS):
        h = numerics.timestep
        last = attempt == _MOST_REFINEMENTS - 1
        try:
            fine, coarse = lammps.run_at_steps(scene, numerics, (h, 2.0 * h))
        except (TimestepError, LostAtomsError):
            if last:
                raise
            numerics = replace(numerics, timestep=0.5 * h)
            continue
        difference = abs(eta_of(scene, fine) - eta_of(scene, coarse))
        expected = error_near(scene, numerics.scheme, numerics.timestep, truth.restitution)
        if not math.isfinite(expected):  # stopped in-house, at a step beside those of LAMMPS
            expected = difference
        # LAMMPS kicks, drifts and kicks; the in-house engine drifts first, with half the error.
        step = max(COARSER_SHARE[numerics.scheme] * difference, 2.0 * expected) + truth.error
        if not scene.bond.smooth:  # no order is trusted: what is known is how far the two are apart
            step = max(step, abs(eta_of(scene, fine) - truth.restitution) + truth.error)
        bar = error_bar(fine, scene, step, noise)
        assert bar.total is not None
        tries.append({"timestep": numerics.timestep, "step_error": step})
        hopeless = bar.rounding + bar.ending > tolerance or step < 0.3 * floor
        hopeless |= truth.kinked and numerics.timestep <= _least_step(scene, scouting)
        if bar.total <= tolerance or last or hopeless:
            break
        if step > _STEP_SHARE * reachable:
            wanted = (_STEP_SHARE * reachable / step) ** (1.0 / order)
            numerics = replace(numerics, timestep=numerics.timestep * min(max(wanted, 0.3), 0.8))
        elif numerics.force_error is not None:
            numerics = replace(numerics, force_error=0.1 * numerics.force_error)
    details = scouting_details(scouting)
    details["spread"] = spread_of(scene, fine, coarse)
    details["choice"] = {
        "seconds": chosen,
        "expected_seconds": candidate.seconds,
        "in_house_restitution": truth.restitution,
        "in_house_error": truth.error,
        "tries": tries,
    }
    return answer(scene, tolerance, fine, step, details, noise)


def _jitter(scene: Scene, truth: Converged) -> float:
    """Return the noise of the in-house eta; modes have no steps, and harmonic chains no chaos."""
    if truth.outcome.timestep is None:
        return 0.0
    scheme = COMPOSITIONS[truth.outcome.scheme].name
    return jitter(scene, scheme, truth.outcome.timestep, truth.restitution)


def _yardstick(scene: Scene, tolerance: float) -> Converged:
    """Return the in-house eta that steps are chosen by."""
    goal = TRUTH_SHARE * tolerance
    if isinstance(scene.bond, Harmonic):
        return exact_modes(scene)
    sharp = sharpness(scene)
    if sharp > SHARPEST_LAMMPS:
        shortest = 1.0 + compressed_strain(scene.bond, scene.impact_velocity**2)
        raise RunError(
            f"bonds would be compressed to about {shortest:.2g} of their length, where they swing "
            f"{sharp:.2g} times faster than at rest; expected less than {SHARPEST_LAMMPS:g} times "
            "for LAMMPS's fixed steps: lower the speed, or use engine 'reference'"
        )
    return converge(scene, goal)


def _cost(scene: Scene, numerics: Numerics, scouting: Scouting) -> float:
    """Return the expected seconds of a run and its proof at twice the step."""
    return 1.5 * cost_model().integration(
        scene, numerics, scouting.duration, scouting.last_contact_time
    )


def _cheapest(scene: Scene, tolerance: float, truth: Converged, scouting: Scouting) -> _Candidate:
    """Return the numerics of least expected cost whose step error meets its share."""
    force_error = None
    # A spline cannot hold a kink; straight lines between rows of which one lies on it do.
    style: TableStyle = "linear" if truth.kinked and scene.bond.kinks else "spline"
    if not isinstance(scene.bond, Harmonic):
        force_error = _TABLE_SHARE * tolerance * scene.impact_velocity / TABLE_SENSITIVITY[style]
    if truth.kinked:
        return _verlet_candidate(scene, tolerance, truth, scouting, style, force_error)
    guesses = []
    for composition in COMPOSITIONS.values():
        goal = _STEP_SHARE * tolerance / COARSER_SHARE[composition.name]
        numerics = Numerics(
            scheme=composition.name,
            timestep=0.5 * guess_step(scene, composition.name, goal),
            bond_range=scouting.table_range(scene),
            force_error=force_error,
        )
        guesses.append(_Candidate(numerics, _cost(scene, numerics, scouting), goal))
    cheapest_guess = min(guess.seconds for guess in guesses)
    candidates = []
    for guess in guesses:
        if guess.seconds > _HOPELESS * cheapest_guess:
            continue
        coarse = estimate_step(scene, guess.numerics.scheme, guess.goal, truth.restitution)
        if coarse is not None:
            numerics = replace(guess.numerics, timestep=0.5 * coarse)
            candidates.append(_Candidate(numerics, _cost(scene, numerics, scouting), guess.goal))
    for candidate in sorted(candidates, key=lambda each: each.seconds):
        numerics = candidate.numerics
        coarse = find_step(
            scene, numerics.scheme, candidate.goal, truth.restitution, 2.0 * numerics.timestep
        )
        if coarse is not None:
            return replace(candidate, numerics=replace(numerics, timestep=0.5 * coarse))
    raise RunError(
        f"no composition and step meets an error of {tolerance:.1g} here; expected a looser "
        "tolerance or a lower speed; the engine 'reference' may do it"
    )


def _verlet_candidate(
    scene: Scene,
    tolerance: float,
    truth: Converged,
    scouting: Scouting,
    style: TableStyle,
    force_error: float | None,
) -> _Candidate:
    """Return Verlet steps, which past kinks are as exact as any others, and far quicker."""
    goal = _STEP_SHARE * tolerance / COARSER_SHARE["verlet"]
    start = guess_step(scene, "verlet", goal)
    coarse = find_step(scene, "verlet", goal, truth.restitution, start) or 0.1 * start
    numerics = Numerics(
        scheme="verlet",
        timestep=max(0.5 * coarse, _least_step(scene, scouting)),
        table=style,
        bond_range=scouting.table_range(scene),
        force_error=force_error,
    )
    return _Candidate(numerics, _cost(scene, numerics, scouting), goal)


def _least_step(scene: Scene, scouting: Scouting) -> float:
    """Return the smallest Verlet step of a run that comes to an end within minutes."""
    return scouting.duration * scene.particles / _MOST_BOND_STEPS
