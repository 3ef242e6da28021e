"""The order of convergence of a user's own integrator, seen along halved steps."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from chaincor.analysis.ladders.verdict import LadderVerdict, judge_ladder
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, Scene
from chaincor.workflows.validation.comparison import judge_for
from chaincor.workflows.validation.user_comparison import restitution_of_user
from chaincor.workflows.validation.user_integrator import run_user_integrator

RUNGS = 6
# Steps within a percent of each rung tell an error that jumps from one that does not.
NEARBY = (1.0, 0.9937, 1.0071, 0.9862, 1.0123)


@dataclass(frozen=True)
class UserLadder:
    """A user's integrator along halved steps."""

    against: str  #: The function.
    steps: tuple[float, ...]  #: Of the rungs, each half of the one before.
    errors: tuple[float, ...]  #: Largest distance of eta from the in-house one, by rung.
    #: The in-house eta and its error bar.
    judge_restitution: float
    judge_error: float  #: See ``judge_restitution``.
    verdict: LadderVerdict  #: Order, and what the error is like.

    def to_dict(self) -> dict[str, Any]:
        """Return the ladder, ready for JSON."""
        return {
            "verdict": self.verdict.kind,
            "reason": self.verdict.reason,
            "order": self.verdict.order,
            "order_error": self.verdict.order_error,
            "timesteps": list(self.steps),
            "errors": list(self.errors),
            "judge_restitution": self.judge_restitution,
            "judge_restitution_error": self.judge_error,
        }


def climb_ladder(scene: Scene, against: str, timeout: float) -> UserLadder:
    """
    Run a user's function at the scene's step, and at 5 halvings of it.

    The function reads ``scene.timestep``. Raises InputError where the scene has none, or the
    function gives the same result at all steps.
    """
    if scene.timestep is None:
        raise InputError(
            "--ladder halves the time step, and none is given; expected the coarsest one: "
            "--timestep H, which the function reads as scene.timestep"
        )
    steps = scene.timestep * 0.5 ** np.arange(RUNGS)[:, None] * np.array(NEARBY)
    found = np.array(
        [
            [
                restitution_of_user(
                    run_user_integrator(against, scene.replace(timestep=float(h)), timeout), scene
                )
                for h in rung
            ]
            for rung in steps
        ]
    )
    if np.ptp(found) == 0.0:
        raise InputError(
            f"{against} gives {found[0, 0]!r} at all steps from {steps[0, 0]:g} to "
            f"{steps[-1, 0]:g}; expected a function that takes its step from scene.timestep"
        )
    judge = judge_for(scene, min(DEFAULT_TOLERANCE, float(np.ptp(found[-1])) + 1e-10))
    return UserLadder(
        against=against,
        steps=tuple(map(float, steps[:, 0])),
        errors=tuple(map(float, np.max(np.abs(found - judge.restitution), axis=1))),
        judge_restitution=judge.restitution,
        judge_error=judge.restitution_error or 0.0,
        verdict=judge_ladder(steps, found),
    )


def describe_ladder(ladder: UserLadder) -> str:
    """Describe a ladder for people."""
    verdict = ladder.verdict
    order = "" if verdict.order is None else f", order {verdict.order:.2f} +- "
    order += "" if verdict.order_error is None else f"{verdict.order_error:.2f}"
    lines = [
        f"{ladder.against} along halved steps: {verdict.kind}{order}",
        f"({verdict.reason})",
        f"{'timestep':>12} {'error':>10}",
    ]
    pairs = zip(ladder.steps, ladder.errors, strict=True)
    lines += [f"{step:12.6g} {error:10.1e}" for step, error in pairs]
    return "\n".join(
        [*lines, f"in-house     eta = {ladder.judge_restitution:.12g} +- {ladder.judge_error:.1e}"]
    )
