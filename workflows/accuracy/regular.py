"""Refining fixed steps whose order is trusted, until three agree or finer ones do not help."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.convergence import nudged_change
from chaincor.workflows.accuracy.error_bars import COARSER_SHARE, ending_error
from chaincor.workflows.accuracy.in_house_runs import eta_of, is_believed, run_in_house
from chaincor.workflows.accuracy.irregular import STALLED
from chaincor.workflows.accuracy.step_guess import STEP_SHARE, effective_order, guess_step
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import jitter_error
from chaincor.workflows.errors import CostError, RunError

# Fixed steps are proved by runs at so many times the step.
COARSER = (2.0, 1.86)
# Longer chains have contacts that graze the wall and make much of the last digit.
LONG = 1500
# Of more particles than this, grazing contacts and what follows from them may hide that steps are
# too long for their order: of 1177 random scenes of 60 to 400 that took it for granted, two of over
# 300 had too small a bar. Then a run at a step nearby has to agree as well, and where contacts come
# or go with the step, the error is so many times the difference.
LONGEST_TRUSTED = 250
_NEAR = 1.3
_GRAZING_SHARE = 2.0
# So do chains of unequal masses, two bodies and warm chains of any length: of 527 with one heavy
# mass that took the order for granted, 51 had too small a bar. A step nearby then has to leave all
# velocities in this part of their change at twice the step (of order 4: 0.12), or as they are.
_NEARER, _SAME = 0.15, 1e-9
# Steps of this usual error resolve a long chain. Whether its contacts hinge on the last digit,
# longer ones do not tell: those of lj chains of 3000 and 4000 particles (0.4 v*) do not at
# H = 0.063, and seem to at 0.126; those of 4500 to 10000 do at any.
_RESOLVED = 1e-11
_MOST_REFINEMENTS = 15
_LEAST_STEP = 1e-5


def first_step(scene: Scene, scheme: StepSchemeName, reachable: float) -> float:
    """Return the step that is tried first for an error: one usually does."""
    return 0.5 * guess_step(scene, scheme, STEP_SHARE * reachable / COARSER_SHARE[scheme])


class _Try(NamedTuple):
    """A run, those at `COARSER` times its step, and its error."""

    fine: Outcome
    proofs: list[Outcome]
    error: float


@dataclass(frozen=True)
class Refined:
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
    nudged : float
        Change of eta by other roundings, where that is why; else 0.
    tries : list of dict
        Steps and errors on the way.
    """

    fine: Outcome
    proofs: list[Outcome]
    error: float
    first: Outcome
    stalled: bool
    nudged: float
    tries: list[dict[str, float]]

    @property
    def grazes(self) -> bool:
        """Whether a step makes or takes a contact."""
        return _differ(self.fine, self.proofs)


def _differ(fine: Outcome, proofs: Sequence[Outcome]) -> bool:
    return any(len(run.contact_times) != len(fine.contact_times) for run in proofs)


def refine(
    scene: Scene, goal: float, scheme: StepSchemeName, floor: float, followed: Outcome | None
) -> Refined:
    """
    Refine until three steps agree, or finer ones help no more.

    Parameters
    ----------
    scene : Scene
        With bonds that are smooth.
    goal, floor : float
        Error asked of eta, and what the arithmetic leaves of it.
    scheme : str
        Of the steps.
    followed : Outcome or None
        The same collision, at some step, followed to its end; else the first run is.

    Returns
    -------
    Refined
        The runs that tell: the best ones, but where roundings decide the first of the last few.

    Raises
    ------
    RunError
        What stopped the finest runs.
    """
    order = effective_order(scene, scheme)
    # Below the rounding floor a finer step buys nothing.
    reachable = max(goal, floor)
    step = first_step(scene, scheme, reachable)
    tries: list[dict[str, float]] = []
    best: _Try | None = None
    found: list[_Try] = []
    stalled, forgets, nudged = 0, False, 0.0
    refusals: list[RunError] = []
    # What follows the last contact is looked at once before the step is found, and once after.
    known, last = followed, None
    for _ in range(_MOST_REFINEMENTS):
        regular = False
        try:
            fine = run_in_house(scene, scheme, step, known)
            known = known or fine
            proofs = _proofs(scene, scheme, fine, last, goal)
        except CostError:
            if best is None:
                raise
            break
        except RunError as failure:
            error, last = math.inf, None
            refusals.append(failure)
            if is_believed(refusals):
                raise
        else:
            last = fine
            error, regular = _step_error(scene, scheme, fine, proofs, goal - floor)
            found.append(_Try(fine, proofs, error))
            refusals.clear()
            stalled = 0 if best is None or error < 0.5 * best.error else stalled + 1
            if best is None or error < best.error:
                best = found[-1]
            resolved = step <= first_step(scene, scheme, _RESOLVED)
            if scene.particles > LONG and resolved and not regular and error > goal:
                # Where roundings account for what steps differ by, finer ones do not help either.
                enough = error / jitter_error("reference", 1.0, scene)
                nudged = nudged_change(scene, scheme, step, fine, enough)
                forgets = nudged >= enough
        tries.append({"timestep": step, "step_error": error})
        stuck = forgets or stalled == STALLED
        if error + floor <= goal or error < 0.3 * floor or step < _LEAST_STEP or stuck:
            break
        # What contacts after an open end could change, no step makes less.
        ending = 0.0 if known is None else ending_error(known, scene)
        if scene.particles > LONG and regular and error <= ending > goal:
            break
        if regular:
            step *= min(max((STEP_SHARE * reachable / error) ** (1.0 / order), 0.3), 0.8)
        else:
            step *= 0.5  # no order holds, and this run serves as one to compare the next with
    if best is None:
        raise refusals[-1]
    assert known is not None
    if stuck:
        # The truth may be wherever one of these runs went. Where each step is another nudge, the
        # finest is no better than the first, whose end may have been followed.
        alike = found[-STALLED:] if forgets else found[-STALLED - 1 :]
        best = alike[0] if forgets else best
        eta = eta_of(scene, best.fine)
        runs = [run for each in alike for run in (each.fine, *each.proofs)]
        best = best._replace(error=max(abs(eta_of(scene, run) - eta) for run in runs))
    nudged = max(nudged, best.error) if forgets else 0.0
    return Refined(*best, known, stuck, nudged, tries)


def _proofs(
    scene: Scene, scheme: StepSchemeName, fine: Outcome, last: Outcome | None, goal: float
) -> list[Outcome]:
    """
    Return runs at `COARSER` times a run's step; `last` is one that may be among them.

    Of a long chain only the first, where that misses the goal with other contacts: as no order
    holds then, the second would tell nothing.
    """
    assert fine.timestep is not None
    runs: list[Outcome] = []
    for k in COARSER:
        step = k * fine.timestep
        if last is None or last.timestep != step:
            runs.append(run_in_house(scene, scheme, step, fine))
        else:
            runs.append(last)
        missed = abs(eta_of(scene, runs[0]) - eta_of(scene, fine)) > goal
        if scene.particles > LONG and missed and _differ(fine, runs):
            break
    return runs


def _step_error(
    scene: Scene, scheme: StepSchemeName, fine: Outcome, proofs: Sequence[Outcome], enough: float
) -> tuple[float, bool]:
    """
    Return the error of a run's step, and whether it goes by the order of its scheme.

    Where an error of at most `enough` would end the search, what is not a uniform cold chain,
    or is long, is asked once more.
    """
    eta, share = eta_of(scene, fine), COARSER_SHARE[scheme]
    apart = max(abs(eta_of(scene, run) - eta) for run in proofs)
    regular = not _differ(fine, proofs)
    if scene.particles <= LONGEST_TRUSTED and scene.line.uniform:
        return share * apart, regular
    error = apart * (share if regular else max(share, _GRAZING_SHARE))
    if error > enough or (scene.line.uniform and not regular):
        return error, regular
    assert fine.timestep is not None
    near = run_in_house(scene, scheme, _NEAR * fine.timestep, fine)
    if not scene.line.uniform and not _converge(fine, near, proofs[0]):
        return math.inf, False
    off = abs(eta_of(scene, near) - eta)
    return max(error, off), regular and off <= error


def _converge(fine: Outcome, near: Outcome, coarse: Outcome) -> bool:
    """
    Return whether all velocities come the nearer to those of a run the nearer its step is.

    Where they do not, motions differ that agree in eta by chance.
    """
    small, large = (
        float(np.max(np.abs(run.velocities - fine.velocities))) for run in (near, coarse)
    )
    return small <= max(_NEARER * large, _SAME * float(np.max(np.abs(fine.velocities))))
