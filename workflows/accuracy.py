"""Tolerance in, numerics and error bar out: choosing, proving, refining."""

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from lammps_inputs.bond_table import compressed_strain
from lammps_inputs.numerics import Numerics
from lammps_inputs.potentials import Harmonic
from lammps_inputs.scene import Scene, Scheme
from workflows.cost_model import cost_model
from workflows.engines import hard_sphere, lammps, modal, reference, stiff
from workflows.engines.compositions import COMPOSITIONS
from workflows.engines.ending import look_interval
from workflows.engines.outcome import Outcome
from workflows.error_bars import (
    COARSER_SHARE,
    TABLE_SENSITIVITY,
    error_bar,
    rounding_error,
    rounding_of,
    spreads,
    table_error,
)
from workflows.errors import CrossingError, RunError
from workflows.result import ErrorBar
from workflows.step_search import (
    Converged,
    converge,
    error_near,
    estimate_step,
    eta_of,
    find_step,
    guess_step,
    run_in_house,
    sharpness,
)

# The range of bonds is settled long before eta is.
_SCOUTING_GOAL = 1e-4
# The step may use this share of the tolerance, the table that one; the rest is for rounding.
_STEP_SHARE = 0.5
_TABLE_SHARE = 0.01
# With bonds sharper than this, adaptive steps are cheaper than fixed ones.
_SHARPEST_FIXED = 60.0
# And LAMMPS, which has only fixed steps, would need millions of them.
_SHARPEST_LAMMPS = 300.0
# The adaptive integrator is asked for this times the tolerance first, then for ever less.
_ADAPTIVE_START = 1.0
# The yardstick for choosing a step must be sharper than the tolerance.
_TRUTH_SHARE = 0.03
_MOST_REFINEMENTS = 5

_ENGINES: dict[str, Callable[..., Outcome]] = {"lammps": lammps.run, "reference": reference.run}


@dataclass(frozen=True)
class Scouting:
    """
    What a short in-house run says about a collision before LAMMPS runs it.

    Attributes
    ----------
    bond_min, bond_max : float
        Shortest and longest bond.
    last_contact_time, duration : float
        Length of the collision, and of the run to the end that was argued.
    contacts : int
        Hits on the wall.
    fragments : int
        Connected pieces at the end.
    seconds : float
        What the scouting cost.
    """

    bond_min: float
    bond_max: float
    last_contact_time: float
    duration: float
    contacts: int
    fragments: int
    seconds: float

    def table_range(self, scene: Scene) -> tuple[float, float]:
        """
        Return the lengths a bond table must hold.

        Parameters
        ----------
        scene : Scene
            The collision.

        Returns
        -------
        tuple of float
            Shortest and longest bond; where bonds may have broken, with room for the pieces to
            fly on until LAMMPS looks for the end.
        """
        longest = self.bond_max
        nearly_broken = scene.bond.energy(longest - 1.0) > 0.6 * scene.bond.dissociation
        if self.fragments > 1 or nearly_broken:
            flight = 2.0 * look_interval(scene.particles, scene.bond.stiffness)
            longest = 1.0 + 1.2 * (longest - 1.0) + 2.0 * scene.impact_velocity * flight
        return self.bond_min, longest


@dataclass(frozen=True)
class Answer:
    """
    A run that was asked to meet a tolerance.

    Attributes
    ----------
    outcome : Outcome
        The run that gives the number.
    bar : ErrorBar
        Its error.
    reason : str or None
        Why the tolerance is not met, where it is not.
    details : dict
        Scouting, choice and proof, for the record.
    """

    outcome: Outcome
    bar: ErrorBar
    reason: str | None
    details: dict[str, Any] = field(default_factory=dict)


def run_engine(scene: Scene, numerics: Numerics) -> Outcome:
    """
    Run a scene with the engine it names.

    Parameters
    ----------
    scene : Scene
        The collision.
    numerics : Numerics
        Explicit settings.

    Returns
    -------
    Outcome
        Raw outcome.
    """
    return _ENGINES[scene.engine](scene, numerics)


def without_outputs(scene: Scene) -> Scene:
    """
    Return the scene without files to write, for runs that only serve an error bar.

    Parameters
    ----------
    scene : Scene
        The collision.

    Returns
    -------
    Scene
        A copy.
    """
    return scene.replace(**dict.fromkeys(("dump", "save", "arrays")))


def _scouting_from(found: Converged) -> Scouting:
    outcome = found.outcome
    return Scouting(
        bond_min=outcome.bond_min,
        bond_max=outcome.bond_max,
        last_contact_time=float(outcome.contact_times[-1]),
        duration=outcome.duration,
        contacts=len(outcome.contact_times),
        fragments=outcome.fragments,
        seconds=found.seconds,
    )


def scout(scene: Scene) -> Scouting | None:
    """
    Find the bond lengths of a collision that LAMMPS will run with a table.

    Parameters
    ----------
    scene : Scene
        The collision.

    Returns
    -------
    Scouting or None
        None where no table is needed, or where the in-house integrator cannot tell.
    """
    if scene.engine != "lammps" or isinstance(scene.bond, Harmonic):
        return None
    try:
        return _scouting_from(converge(scene, _SCOUTING_GOAL))
    except RunError:
        return None


def scouting_details(found: Scouting | None) -> dict[str, Any]:
    """
    Return the scouting for the record.

    Parameters
    ----------
    found : Scouting or None
        From :func:`scout`.

    Returns
    -------
    dict
        Under the key ``scouting``; empty where there was none.
    """
    return {} if found is None else {"scouting": asdict(found)}


def spread_of(scene: Scene, outcome: Outcome, other: Outcome) -> dict[str, float]:
    """
    Return how far the arrays of two runs lie apart, for comparisons with other integrators.

    Parameters
    ----------
    scene : Scene
        The collision.
    outcome, other : Outcome
        The run that gives the number, and the one that proves it.

    Returns
    -------
    dict
        By array; see :func:`workflows.error_bars.spreads`.
    """
    floor = table_error(outcome, scene) + rounding_of(outcome, scene)
    return spreads(outcome, other, scene, floor)


def meet(scene: Scene, tolerance: float) -> Answer:
    """
    Run a scene with the cheapest numerics that meet a tolerance, and prove that they do.

    Parameters
    ----------
    scene : Scene
        The collision, without explicit numerics.
    tolerance : float
        Absolute error asked of eta.

    Returns
    -------
    Answer
        With the reason where the tolerance could not be met.
    """
    if scene.engine == "lammps":
        return _meet_with_lammps(scene, tolerance)
    if isinstance(scene.bond, Harmonic):
        outcome = modal.run(scene)
        return _answer(
            scene, tolerance, outcome, 0.0, {"spread": spread_of(scene, outcome, outcome)}
        )
    if sharpness(scene) <= _SHARPEST_FIXED:
        return _meet_with_fixed_steps(scene, tolerance)
    deviation = hard_sphere.deviation(scene)
    if deviation <= _STEP_SHARE * tolerance:
        outcome = hard_sphere.run(scene)
        spread = spread_of(scene, outcome, outcome)
        return _answer(scene, tolerance, outcome, deviation, {"spread": spread})
    return _meet_with_adaptive_steps(scene, tolerance)


def _answer(
    scene: Scene, tolerance: float, outcome: Outcome, step: float, details: dict[str, Any]
) -> Answer:
    bar = error_bar(outcome, scene, step)
    assert bar.total is not None
    reason = None
    if bar.total > tolerance:
        parts = {"step": step, "table": bar.table, "rounding": bar.rounding}
        largest = max(parts, key=lambda name: parts[name])
        remedy = {
            "step": "the collision is too sensitive for the steps that were tried",
            "table": "a longer bond table would be needed",
            "rounding": f"the {outcome.engine} engine's coordinates have no more digits at this "
            "speed; the engine 'reference' has no such floor",
        }[largest]
        reason = (
            f"the error reached is {bar.total:.2g}, not {tolerance:g}; most of it, "
            f"{parts[largest]:.2g}, is {largest}: {remedy}"
        )
    return Answer(outcome, bar, reason, details)


# ---- in-house ------------------------------------------------------------------------------------


def _meet_with_fixed_steps(scene: Scene, tolerance: float) -> Answer:
    """Start from the usual step of a scheme and refine until three steps agree."""
    scheme: Scheme = "order4" if tolerance > 3e-4 else "order6" if tolerance > 1e-6 else "order8"
    order, share = COMPOSITIONS[scheme].order, COARSER_SHARE[scheme]
    step = 0.5 * guess_step(scene, scheme, _STEP_SHARE * tolerance / share)
    tries: list[dict[str, float]] = []
    best: tuple[float, Outcome, Outcome] | None = None
    for _ in range(3 * _MOST_REFINEMENTS):
        try:
            fine = run_in_house(scene, scheme, step)
            eta = eta_of(scene, fine)
            coarse = [run_in_house(scene, scheme, k * step) for k in (2.0, 1.86)]
            error = share * max(abs(eta_of(scene, run) - eta) for run in coarse)
        except RunError as failure:
            error, last_failure = math.inf, failure
        else:
            if best is None or error < best[0]:
                best = (error, fine, coarse[0])
        tries.append({"timestep": step, "step_error": error})
        if error + rounding_error("reference", scene) <= tolerance or step < 1e-5:
            break
        wanted = (0.5 * tolerance / error) ** (1.0 / order) if math.isfinite(error) else 0.5
        step *= min(max(wanted, 0.3), 0.8)
    if best is None:
        raise last_failure
    error, fine, proof = best
    details = {"choice": {"tries": tries}, "spread": spread_of(scene, fine, proof)}
    return _answer(scene, tolerance, fine, error, details)


def _meet_with_adaptive_steps(scene: Scene, tolerance: float) -> Answer:
    """Ask the adaptive integrator for ever more accuracy until two runs agree."""
    accuracy = _ADAPTIVE_START * tolerance
    coarse = stiff.run(scene, accuracy)
    tries: list[dict[str, float]] = []
    for _ in range(_MOST_REFINEMENTS):
        accuracy *= 0.1
        fine = stiff.run(scene, accuracy)
        # The finer run is the better by far; half the difference is a generous error for it.
        error = 0.5 * abs(eta_of(scene, fine) - eta_of(scene, coarse))
        tries.append({"accuracy": accuracy, "step_error": error})
        if error + rounding_error("reference", scene) <= tolerance or accuracy < 1e-14:
            break
        coarse = fine
    details = {"choice": {"tries": tries}, "spread": spread_of(scene, fine, coarse)}
    return _answer(scene, tolerance, fine, error, details)


# ---- LAMMPS --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Candidate:
    numerics: Numerics
    seconds: float
    goal: float


def _meet_with_lammps(scene: Scene, tolerance: float) -> Answer:
    started = time.perf_counter()
    floor = rounding_error("lammps", scene)
    # Below the rounding floor a finer step buys nothing.
    reachable = max(tolerance - floor, floor)
    truth = _yardstick(scene, reachable)
    scouting = _scouting_from(truth)
    candidate = _cheapest(scene, reachable, truth, scouting)
    chosen = time.perf_counter() - started
    plain = without_outputs(scene)
    tries: list[dict[str, Any]] = []
    numerics = candidate.numerics
    order = COMPOSITIONS[numerics.scheme].order
    for attempt in range(_MOST_REFINEMENTS):
        coarse = lammps.run(plain, replace(numerics, timestep=2.0 * numerics.timestep))
        fine = lammps.run(scene, numerics)
        difference = abs(eta_of(scene, fine) - eta_of(scene, coarse))
        expected = error_near(scene, numerics.scheme, numerics.timestep, truth.restitution)
        step = max(COARSER_SHARE[numerics.scheme] * difference, expected) + truth.error
        bar = error_bar(fine, scene, step)
        assert bar.total is not None
        tries.append({"timestep": numerics.timestep, "step_error": step})
        if bar.total <= tolerance or attempt == _MOST_REFINEMENTS - 1 or step < 0.3 * floor:
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
    return _answer(scene, tolerance, fine, step, details)


def _yardstick(scene: Scene, tolerance: float) -> Converged:
    """Return the in-house eta that steps are chosen by."""
    goal = _TRUTH_SHARE * tolerance
    if isinstance(scene.bond, Harmonic):
        outcome = modal.run(scene)
        if outcome.crossed:
            raise CrossingError(
                f"particles of a harmonic chain pass through each other at velocity "
                f"{scene.impact_velocity:g}, which LAMMPS cannot represent (it knows only the "
                "absolute bond length); expected less than about 0.69: use engine 'reference'"
            )
        return Converged(outcome, eta_of(scene, outcome), 1e-13, outcome.seconds)
    sharp = sharpness(scene)
    if sharp > _SHARPEST_LAMMPS:
        shortest = 1.0 + compressed_strain(scene.bond, scene.impact_velocity**2)
        raise RunError(
            f"bonds would be compressed to about {shortest:.2g} of their length, where they swing "
            f"{sharp:.2g} times faster than at rest; expected less than {_SHARPEST_LAMMPS:g} times "
            "for LAMMPS's fixed steps: lower the speed, or use engine 'reference'"
        )
    return converge(scene, goal)


def _cheapest(scene: Scene, tolerance: float, truth: Converged, scouting: Scouting) -> _Candidate:
    """Return the numerics of least expected cost whose step error meets its share."""
    force_error = None
    if not isinstance(scene.bond, Harmonic):
        force_error = _TABLE_SHARE * tolerance * scene.impact_velocity / TABLE_SENSITIVITY["spline"]
    model = cost_model()
    candidates = []
    for composition in COMPOSITIONS.values():
        scheme = composition.name
        goal = _STEP_SHARE * tolerance / COARSER_SHARE[scheme]
        coarse = estimate_step(scene, scheme, goal, truth.restitution)
        if coarse is None:
            continue
        numerics = Numerics(
            scheme=scheme,
            timestep=0.5 * coarse,
            bond_range=scouting.table_range(scene),
            force_error=force_error,
        )
        # The proof at twice the step costs half as much again.
        seconds = 1.5 * model.integration(scene, numerics, scouting.duration)
        candidates.append(_Candidate(numerics, seconds, goal))
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
