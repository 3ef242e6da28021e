"""Meeting a tolerance with fixed steps of the in-house engine."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chaincor.lammps_inputs.numerics import StepSchemeName
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.answer import Answer, answer, spread_of
from chaincor.workflows.accuracy.convergence import nudged_change
from chaincor.workflows.accuracy.error_bars import COARSER_SHARE, LEAST_SHARE, ending_error
from chaincor.workflows.accuracy.in_house_runs import eta_of, is_believed, run_in_house
from chaincor.workflows.accuracy.irregular import STALLED
from chaincor.workflows.accuracy.step_guess import STEP_SHARE, effective_order, guess_step
from chaincor.workflows.engines.ending import quiet_time
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import jitter_error, rounding_error, rounding_matters
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import RunError
from chaincor.workflows.measured import measured

# Fixed steps are proved by runs at so many times the step.
COARSER = (2.0, 1.86)
# Schemes, and above which goal each is usually the cheapest.
_SCHEMES: dict[StepSchemeName, float] = measured("in_house_schemes")
# This one amplifies rounding least: longer chains than so many particles, where contacts that graze
# make much of the last digit, take it at any goal. Costs only.
_PLAINEST: StepSchemeName = "srkn14"
LONG = 1500
# Of more particles than this, grazing contacts and what follows from them may hide that steps are
# too long for their order: of 1177 random scenes of 60 to 400 that took it for granted, two of over
# 300 had too small a bar. Then a run at a step nearby has to agree as well, and where contacts come
# or go with the step, the error is so many times the difference.
LONGEST_TRUSTED = 250
_NEAR = 1.3
_GRAZING_SHARE = 2.0
_MOST_REFINEMENTS = 15
_LEAST_STEP = 1e-5


def usual_scheme(goal: float) -> StepSchemeName:
    """Return the scheme of fixed steps that usually meets a goal most cheaply."""
    return next(name for name, least in _SCHEMES.items() if goal > least)


def first_step(scene: Scene, scheme: StepSchemeName, reachable: float) -> float:
    """Return the step that is tried first for an error: one usually does."""
    return 0.5 * guess_step(scene, scheme, STEP_SHARE * reachable / COARSER_SHARE[scheme])


def _plain_scheme(scene: Scene, goal: float, noise: float) -> StepSchemeName:
    """Return the usual scheme, or one that amplifies rounding less where there is much of it."""
    scheme = usual_scheme(goal)
    if scheme == _PLAINEST:
        return scheme
    if scene.line is None:
        return _PLAINEST if scene.particles > LONG else scheme
    amplified = noise * STEP_SCHEMES[scheme].amplification
    return _PLAINEST if jitter_error("reference", amplified, scene) > STEP_SHARE * goal else scheme


def meet_with_fixed_steps(
    scene: Scene, goal: float, noise: float, followed: Outcome | None = None
) -> Answer:
    """
    Start from the usual step of a scheme and refine until three steps agree.

    For `noise` and `followed` see :func:`chaincor.workflows.accuracy.by_in_house.meet_in_house`.
    """
    scheme = _plain_scheme(scene, goal, noise)
    found = _meet_with_scheme(scene, goal, scheme, noise, followed)
    assert found.bar.step is not None
    reachable = max(goal, rounding_error("reference", scene))
    if scheme != _PLAINEST and found.bar.rounding > reachable >= found.bar.step:
        plainest = _meet_with_scheme(scene, goal, _PLAINEST, found.jitter, followed)
        return min(found, plainest, key=lambda each: each.bar.total or math.inf)
    return found


@dataclass(frozen=True)
class _Refined:
    """
    The finest of several runs.

    Attributes
    ----------
    fine : Outcome
        The run that gives the number.
    proofs : list of Outcome
        Runs at `COARSER` times its step.
    error : float
        Its error.
    first : Outcome
        The run whose end all others took over.
    stalled : bool
        Whether smaller steps had stopped to help.
    tries : list of dict
        Steps and errors on the way.
    """

    fine: Outcome
    proofs: list[Outcome]
    error: float
    first: Outcome
    stalled: bool
    tries: list[dict[str, float]]

    @property
    def grazes(self) -> bool:
        """Whether a step makes or takes a contact."""
        return _differ(self.fine, self.proofs)


def _differ(fine: Outcome, proofs: Sequence[Outcome]) -> bool:
    return any(len(run.contact_times) != len(fine.contact_times) for run in proofs)


def _refine(
    scene: Scene, goal: float, scheme: StepSchemeName, floor: float, followed: Outcome | None
) -> _Refined:
    """Refine until three steps agree, or finer ones help no more."""
    order = effective_order(scene, scheme)
    # Below the rounding floor a finer step buys nothing.
    reachable = max(goal, floor)
    step = first_step(scene, scheme, reachable)
    tries: list[dict[str, float]] = []
    best: tuple[float, Outcome, list[Outcome]] | None = None
    found: list[list[float]] = []
    stalled = 0
    refusals: list[RunError] = []
    # What follows the last contact is looked at once before the step is found, and once after.
    known, last = followed, None
    for _ in range(_MOST_REFINEMENTS):
        regular = False
        try:
            fine = run_in_house(scene, scheme, step, known)
            known = known or fine
            coarse = [
                last
                if last is not None and last.timestep == k * step
                else run_in_house(scene, scheme, k * step, fine)
                for k in COARSER
            ]
        except RunError as failure:
            error, last = math.inf, None
            refusals.append(failure)
            if is_believed(refusals):
                raise
        else:
            last = fine
            found.append([eta_of(scene, run) for run in (fine, *coarse)])
            error, regular = _step_error(scene, scheme, fine, coarse, goal - floor)
            refusals.clear()
            stalled = 0 if best is None or error < 0.5 * best[0] else stalled + 1
            if best is None or error < best[0]:
                best = (error, fine, coarse)
        tries.append({"timestep": step, "step_error": error})
        if error + floor <= goal or error < 0.3 * floor or step < _LEAST_STEP or stalled == STALLED:
            break
        # What contacts after an open end could change, no step makes less.
        ending = 0.0 if known is None else ending_error(known, scene)
        if scene.particles > LONG and error <= ending > goal:
            break
        if regular:
            step *= min(max((STEP_SHARE * reachable / error) ** (1.0 / order), 0.3), 0.8)
        else:
            step *= 0.5  # no order holds, and this run serves as one to compare the next with
    if best is None:
        raise refusals[-1]
    error, fine, proofs = best
    assert known is not None
    if stalled == STALLED:
        # The truth may be wherever one of these runs went.
        error = float(np.max(np.abs(np.ravel(found[-STALLED - 1 :]) - eta_of(scene, fine))))
    return _Refined(fine, proofs, error, known, stalled == STALLED, tries)


def _step_error(
    scene: Scene, scheme: StepSchemeName, fine: Outcome, proofs: Sequence[Outcome], enough: float
) -> tuple[float, bool]:
    """
    Return the error of a run's step, and whether it goes by the order of its scheme.

    Where an error of at most `enough` would end the search, a long chain is asked once more.
    """
    eta, share = eta_of(scene, fine), COARSER_SHARE[scheme]
    apart = max(abs(eta_of(scene, run) - eta) for run in proofs)
    regular = not _differ(fine, proofs)
    if scene.particles <= LONGEST_TRUSTED:
        return share * apart, regular
    if not regular:
        return max(share, _GRAZING_SHARE) * apart, False
    if share * apart > enough:
        return share * apart, True
    assert fine.timestep is not None
    near = run_in_house(scene, scheme, _NEAR * fine.timestep, fine)
    off = abs(eta_of(scene, near) - eta)
    return max(share * apart, off), off <= share * apart


def _meet_with_scheme(
    scene: Scene, goal: float, scheme: StepSchemeName, noise: float, followed: Outcome | None
) -> Answer:
    """Refine the steps of one scheme, and ask what comes after them and what roundings make."""
    floor = rounding_error("reference", scene)
    found = _refine(scene, goal, scheme, floor, followed)
    fine, error, proof = found.fine, found.error, found.proofs[0]
    step = fine.timestep
    assert step is not None
    if followed is None and fine is not found.first:
        whole = run_in_house(scene, scheme, step)
        error = max(error, abs(eta_of(scene, whole) - eta_of(scene, fine)))
        fine = with_doubts(whole, (fine, proof))
    quiet = quiet_time(scene.span, scene.slow_stiffness)
    silent = np.max(np.diff(fine.contact_times), initial=0.0) > quiet
    # Light particles between heavy ones, bodies and warm chains were looked at before. What comes
    # after a long silence of a chain that broke amplifies rounding, too; where a step makes or
    # takes a contact, roundings may as well, and in long chains that need finer steps than usual.
    refined = scene.particles > LONGEST_TRUSTED and len(found.tries) > 1
    matters = noise > 0.0 or refined or rounding_matters("reference", scene, goal)
    if (scene.line is None and matters) or silent or found.grazes or found.stalled:
        amplification = STEP_SCHEMES[scheme].amplification  # which the bar multiplies with
        changed = nudged_change(scene, scheme, step, fine)
        noise = max(noise, changed / amplification)
        sure = scene.line is not None and fine.ending.kind == "proved"
        if silent and max(amplification * noise, error) > goal and not sure:
            # Where roundings decide how hard it is, they may decide whether another one comes.
            another = 2.0 * float(fine.contact_speeds[-1])
            fine = replace(fine, ending=fine.ending.doubted(another))
    details = {"choice": {"tries": found.tries}, "spread": spread_of(scene, fine, proof)}
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
