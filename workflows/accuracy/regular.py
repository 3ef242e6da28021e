"""Refining fixed steps of smooth bonds, until three agree or finer ones do not help."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.error_bars import ending_error
from chaincor.workflows.accuracy.in_house_runs import (
    Refined,
    differ,
    eta_of,
    largest_difference,
    refined,
    run_in_house,
)
from chaincor.workflows.accuracy.refining import Policy, Try, by_order, refine
from chaincor.workflows.accuracy.rounding_sensitivity import LONG, nudged_change
from chaincor.workflows.accuracy.step_guess import STEP_SHARE, effective_order, guess_step
from chaincor.workflows.accuracy.step_proof import COARSER, proved_error, telling_step, usual_share
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import amplified_rounding

# Chains of more particles than this that need finer steps than usual have their roundings looked
# at, and are met one by one.
LONGEST_TRUSTED = 250
# Where contacts come or go with the step, and in bodies that amplify what steps miss, the error is
# taken for so many times what the runs tell: of 141 chains with one heavy mass, at three steps
# each, three were off by up to 2.1 times that.
_RESERVE = 3.0
# Unequal masses, two bodies and warm chains amplify what steps miss: of 527 chains with one heavy
# mass 51 had too small a bar while the order of the scheme was trusted. The near run then has to
# leave all velocities in this part of their change at twice the step (of order 4: 0.12), or as they
# are.
_NEARER, _SAME = 0.15, 1e-9
# Steps of this usual error resolve a long chain. Whether its contacts hinge on the last digit,
# longer ones do not tell: those of lj chains of 3000 and 4000 particles (0.4 v*) do not at
# H = 0.063, and seem to at 0.126; those of 4500 to 10000 do at any.
_RESOLVED = 2e-11
_MOST_REFINEMENTS = 15
_LEAST_STEP = 1e-5


def first_step(scene: Scene, scheme: StepSchemeName, reachable: float) -> float:
    """Return the step that is tried first for an error: one usually does."""
    return 0.5 * guess_step(scene, scheme, STEP_SHARE * reachable / usual_share(scheme))


def refine_regularly(
    scene: Scene, goal: float, scheme: StepSchemeName, floor: float, followed: Outcome | None
) -> Refined:
    """
    Refine until three steps agree, or finer ones help no more.

    Bonds are smooth. `goal` is the error asked of eta, `floor` what the arithmetic leaves of it;
    `followed` the same collision, at some step, followed to its end, else the first run is. The
    runs that tell are the best ones, but where roundings decide the first of the last few. Raises
    RunError, what stopped the finest runs.
    """
    search = _Search(scene, goal, floor, scheme, followed)
    policy = Policy(_MOST_REFINEMENTS, stalls=True, salvages=True)
    tries = refine(first_step(scene, scheme, max(goal, floor)), search.attempt, policy)
    found = refined(scene, tries, forgets=search.nudged > 0.0)
    nudged = max(search.nudged, found.error) if search.nudged > 0.0 else 0.0
    return replace(found, first=search.known, nudged=nudged)


@dataclass
class _Search:
    """
    Runs at ever smaller steps, each at `COARSER` times its step as well.

    What follows the last contact is looked at once, in the run `known`. `nudged` is the change of
    eta by other roundings, where these account for what steps differ by.
    """

    scene: Scene
    goal: float
    floor: float
    scheme: StepSchemeName
    known: Outcome | None
    last: Outcome | None = None
    nudged: float = 0.0

    def attempt(self, step: float) -> Try[list[Outcome]]:
        scene, scheme, goal, floor = self.scene, self.scheme, self.goal, self.floor
        last, self.last = self.last, None
        fine = run_in_house(scene, scheme, step, self.known)
        self.known = self.known or fine
        telling = telling_step(scheme, step, fine.lasted)
        if telling < step:
            return Try(step, math.inf, following=telling, anew=True)
        proofs = _proofs(scene, scheme, fine, last, goal)
        self.last = fine
        error, regular = _step_error(scene, scheme, fine, proofs, floor)
        resolved = step <= first_step(scene, scheme, _RESOLVED)
        if scene.particles > LONG and resolved and not regular and error > goal:
            # Where roundings account for what steps differ by, finer ones do not help either.
            enough = error / amplified_rounding("reference", 1.0, scene)
            changed = nudged_change(scene, scheme, step, fine, enough)
            self.nudged = changed if changed >= enough else 0.0
        done = error + floor <= goal or error < 0.3 * floor or step < _LEAST_STEP
        # What contacts after an open end could change, no step makes less.
        ending = ending_error(self.known, scene)
        done |= scene.particles > LONG and regular and error <= ending > goal
        if done and self.nudged == 0.0 and differ(fine, [self.known]):
            # The end was taken over from a run with other contacts: this one may have one more.
            whole = run_in_house(scene, scheme, step)
            late, self.known = differ(fine, [whole]), whole
            if late:
                return Try(step, math.inf, [whole, *proofs], following=step)
            fine = whole
        share = 0.5  # where no order holds: this run serves as one to compare the next with
        if regular:
            order = effective_order(scene, scheme)
            # Below the rounding floor a finer step buys nothing.
            share = by_order(STEP_SHARE * max(goal, floor), error, order, 0.3)
        return Try(step, error, [fine, *proofs], done or self.nudged > 0.0, step * share)


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
        if scene.particles > LONG and missed and differ(fine, runs):
            break
    return runs


def _step_error(
    scene: Scene, scheme: StepSchemeName, fine: Outcome, proofs: Sequence[Outcome], floor: float
) -> tuple[float, bool]:
    """Return the error of a run's step, and whether it falls as an order lets it."""
    far, *nearer = (largest_difference(scene, fine, [run]) for run in proofs)
    amplifies = not scene.line.uniform
    if amplifies and nearer and not _converge(fine, proofs[1], proofs[0]):
        return math.inf, False
    alike = not differ(fine, proofs)
    assert fine.timestep is not None
    steps = fine.lasted / fine.timestep
    error, falls = proved_error(scheme, steps, far, nearer[0] if nearer else far, floor, alike)
    return (_RESERVE if amplifies or not alike else 1.0) * float(error), bool(falls)


def _converge(fine: Outcome, near: Outcome, coarse: Outcome) -> bool:
    """
    Return whether all velocities come the nearer to those of a run the nearer its step is.

    Where they do not, motions differ that agree in eta by chance.
    """
    small, large = (
        float(np.max(np.abs(run.velocities - fine.velocities))) for run in (near, coarse)
    )
    return small <= max(_NEARER * large, _SAME * float(np.max(np.abs(fine.velocities))))
