"""Meeting a tolerance with the in-house engines."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chaincor.lammps_inputs.numerics import StepSchemeName
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.answer import Answer, answer, spread_of
from chaincor.workflows.accuracy.convergence import jitter, modal_error, nudged_change
from chaincor.workflows.accuracy.error_bars import COARSER_SHARE, LEAST_SHARE
from chaincor.workflows.accuracy.in_house_runs import eta_of, is_believed, run_in_house
from chaincor.workflows.accuracy.irregular import STALLED, refine
from chaincor.workflows.accuracy.step_guess import (
    STEP_SHARE,
    effective_order,
    guess_step,
    is_smooth,
    sharpness,
)
from chaincor.workflows.engines.compositions import COMPOSITIONS
from chaincor.workflows.engines.ending import quiet_time
from chaincor.workflows.engines.in_house import adaptive, hard_sphere, modal
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import jitter_error, rounding_error
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import RunError
from chaincor.workflows.measured import measured

# With bonds sharper than this, adaptive steps are cheaper than fixed ones: about where, by
# processor time, decides costs only.
SHARPEST_FIXED = 60.0
# Error of an adaptive run against its difference to those at ten and a hundred times its accuracy.
_ADAPTIVE_SHARES = tuple(measured("adaptive_share") * weight for weight in (1.0, 0.4))
# Kinks make it fall irregularly: as of fixed steps, three times as much.
_IRREGULAR_SHARES = tuple(3.0 * share for share in _ADAPTIVE_SHARES)
_MOST_REFINEMENTS = 15
# Fixed steps are proved by runs at so many times the step.
COARSER = (2.0, 1.86)
# A run of adaptive steps takes up to 8e-10 s times (n ln(sharpness))^3 (log bonds; others less in
# long chains), a minute for this much; beyond, hard spheres answer wherever they are good to
# three digits, with the bar that they have.
_MOST_STEPPED = 7.5e10
_ROUGH_SPHERES = 1e-3
# Schemes, and above which goal each is usually the cheapest.
_SCHEMES: dict[StepSchemeName, float] = measured("in_house_schemes")


def meet_in_house(scene: Scene, goal: float, noise: float, known: Outcome | None = None) -> Answer:
    """
    Run a scene with the engine that does most with least: exact where it can be.

    `noise` is the jitter of eta, where that matters; `known` the collision followed to its end at
    some step, else that is done here.
    """
    if modal.serves(scene):
        return _at_once(scene, modal.run(scene), modal_error(scene))
    if scene.line is not None or sharpness(scene) <= SHARPEST_FIXED:
        return _meet_with_fixed_steps(scene, goal, noise, known)
    deviation = hard_sphere.deviation(scene)
    reached = deviation + rounding_error("reference", scene)
    senseless = (scene.particles * math.log(sharpness(scene))) ** 3 > _MOST_STEPPED
    if reached <= goal or (senseless and deviation <= _ROUGH_SPHERES):
        return _at_once(scene, hard_sphere.run(scene), deviation)
    if senseless:
        raise RunError(
            f"to step {scene.particles} particles with bonds {sharpness(scene):.2g} times sharper "
            "than at rest would take hours or more, and the limit of hard spheres is only good to "
            f"{deviation:.1g} here; expected fewer particles, or another speed: lower either"
        )
    stepped = _meet_with_adaptive_steps(scene, goal)
    assert stepped.bar.total is not None
    if reached < stepped.bar.total:
        return _at_once(scene, hard_sphere.run(scene), deviation)
    return stepped


def usual_scheme(goal: float) -> StepSchemeName:
    """Return the scheme of fixed steps that usually meets a goal most cheaply."""
    return next(name for name, least in _SCHEMES.items() if goal > least)


def first_step(scene: Scene, scheme: StepSchemeName, reachable: float) -> float:
    """Return the step that is tried first for an error: one usually does."""
    return 0.5 * guess_step(scene, scheme, STEP_SHARE * reachable / COARSER_SHARE[scheme])


def _at_once(scene: Scene, outcome: Outcome, error: float) -> Answer:
    """Answer with an outcome that no step was chosen for."""
    return answer(scene, outcome, error, {"spread": spread_of(scene, outcome, outcome)})


def _meet_with_fixed_steps(
    scene: Scene, goal: float, noise: float, followed: Outcome | None
) -> Answer:
    """Start from the usual step of a scheme and refine until three steps agree."""
    scheme = usual_scheme(goal)
    if scene.line is not None:
        amplified = noise * STEP_SCHEMES[scheme].amplification
        if jitter_error("reference", amplified, scene) > STEP_SHARE * goal:
            scheme = "order8"  # which amplifies rounding least
    if not is_smooth(scene):
        return _meet_irregularly(scene, goal, scheme, noise)
    order, share = effective_order(scene, scheme), COARSER_SHARE[scheme]
    # Below the rounding floor a finer step buys nothing.
    floor = rounding_error("reference", scene)
    reachable = max(goal, floor)
    step = first_step(scene, scheme, reachable)
    # A long chain may amplify the last digit beyond the goal. Steps that change eta by no more than
    # one more change of all roundings may, which the bar has, are not refined.
    drowned = jitter_error("reference", noise, scene) if scene.line is None else 0.0
    drowned = drowned if drowned > goal else 0.0
    tries: list[dict[str, float]] = []
    best: tuple[float, Outcome, list[Outcome]] | None = None
    found: list[list[float]] = []
    stalled = 0
    refusals: list[RunError] = []
    # What follows the last contact is looked at once before the step is found, and once after.
    known = followed
    for _ in range(_MOST_REFINEMENTS):
        try:
            fine = run_in_house(scene, scheme, step, known)
            known = known or fine
            eta = eta_of(scene, fine)
            coarse = [run_in_house(scene, scheme, k * step, fine) for k in COARSER]
            found.append([eta, *(eta_of(scene, run) for run in coarse)])
            error = share * max(abs(other - eta) for other in found[-1][1:])
        except RunError as failure:
            error = math.inf
            refusals.append(failure)
            if is_believed(refusals):
                raise
        else:
            refusals.clear()
            stalled = 0 if best is None or error < 0.5 * best[0] else stalled + 1
            if best is None or error < best[0]:
                best = (error, fine, coarse)
        tries.append({"timestep": step, "step_error": error})
        if error + floor <= goal or error < 0.3 * floor or step < 1e-5:
            break
        if stalled == STALLED or error <= share * drowned:
            break
        wanted = (STEP_SHARE * reachable / error) ** (1.0 / order) if math.isfinite(error) else 0.5
        step *= min(max(wanted, 0.3), 0.8)
    if best is None:
        raise refusals[-1]
    error, fine, proofs = best
    proof = proofs[0]
    assert fine.timestep is not None
    count = len(fine.contact_times)
    grazes = any(len(run.contact_times) != count for run in proofs)
    if followed is None and fine is not known:
        whole = run_in_house(scene, scheme, fine.timestep)
        error = max(error, abs(eta_of(scene, whole) - eta_of(scene, fine)))
        fine = with_doubts(whole, (fine, proof))
    if stalled == STALLED:
        # No order of convergence holds here: the truth may be wherever one of these runs went.
        error = float(np.max(np.abs(np.ravel(found[-STALLED - 1 :]) - eta_of(scene, fine))))
        noise = noise or jitter(scene)
    quiet = quiet_time(scene.span, scene.slow_stiffness)
    silent = np.max(np.diff(fine.contact_times), initial=0.0) > quiet
    if silent or grazes:
        # What comes after a long silence of a chain that broke amplifies rounding; and where a step
        # makes or takes a contact, roundings may as well.
        assert fine.timestep is not None
        nudged = nudged_change(scene, scheme, fine.timestep, fine)
        if scene.line is not None:
            nudged /= STEP_SCHEMES[scheme].amplification  # which the bar multiplies with
        noise = max(noise, nudged)
    if silent:
        sure = scene.line is not None and fine.ending.kind == "proved"
        if max(noise, error) > goal and not sure:
            # Where roundings decide how hard it is, they may decide whether another one comes.
            another = 2.0 * float(fine.contact_speeds[-1])
            fine = replace(fine, ending=fine.ending.doubted(another))
    details = {"choice": {"tries": tries}, "spread": spread_of(scene, fine, proof)}
    return answer(scene, fine, max(error, LEAST_SHARE * goal), details, noise)


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


def _meet_irregularly(scene: Scene, goal: float, scheme: StepSchemeName, noise: float) -> Answer:
    """Refine without trust in an order: bonds of users may have kinks."""
    floor = rounding_error("reference", scene)
    # The share of extrapolated steps rests on their order.
    composed: StepSchemeName = scheme if scheme in COMPOSITIONS else "order8"
    found = refine(scene, goal, composed, floor)
    if found.stalled:
        noise = noise or jitter(scene)
    details = {
        "choice": {"tries": found.tries},
        "spread": spread_of(scene, found.fine, found.proof),
    }
    return answer(scene, found.fine, max(found.error, LEAST_SHARE * goal), details, noise)


def _meet_with_adaptive_steps(scene: Scene, goal: float) -> Answer:
    """Ask the adaptive integrator for ever more accuracy until three runs agree."""
    floor = rounding_error("reference", scene)
    shares = _ADAPTIVE_SHARES if scene.bond.smooth else _IRREGULAR_SHARES
    accuracy = max(goal, floor)
    coarser, coarse = (adaptive.run(scene, k * accuracy) for k in (10.0, 1.0))
    tries: list[dict[str, float]] = []
    for _ in range(_MOST_REFINEMENTS):
        accuracy *= 0.1
        fine = adaptive.run(scene, accuracy)
        # An error shrinks by less than ten now and then: one difference can be small by chance.
        eta = eta_of(scene, fine)
        error = max(
            share * abs(eta_of(scene, run) - eta)
            for share, run in zip(shares, (coarse, coarser), strict=True)
        )
        tries.append({"accuracy": accuracy, "step_error": error})
        if error + floor <= goal or accuracy < 1e-14:
            break
        coarser, coarse = coarse, fine
    details = {"choice": {"tries": tries}, "spread": spread_of(scene, fine, coarse)}
    return answer(scene, fine, max(error, LEAST_SHARE * goal), details)
