"""
Judge a user's integrator for the command `validate`.

One result is compared with the reference engine (`--against`), or results at halved steps give the
order of convergence (`--ladder`).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from chaincor.analysis.ladders.verdict import LadderVerdict, judge_ladder
from chaincor.analysis.modes import mode_energies
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, Scene
from chaincor.workflows.accuracy.bounded_run import farthest
from chaincor.workflows.given import scene_given
from chaincor.workflows.result import Collision
from chaincor.workflows.validation.comparison import (
    Comparison,
    Validation,
    compare_contacts,
    judge_for,
)
from chaincor.workflows.validation.difference_causes import find_cause
from chaincor.workflows.validation.user_integrator import (
    USER_TIMEOUT,
    UserOutcome,
    run_user_integrator,
)

RUNGS = 6
# If half the time step reduces a difference to less than this fraction, the step causes the
# difference.
_FALLS = 0.7
# Additional runs at these multiples of the step show whether the error depends smoothly on the
# step.
NEARBY = (1.0, 0.9937, 1.0071, 0.9862, 1.0123)


def validate_user(
    scene: Scene, against: str, tolerance: float | None = None, timeout: float = USER_TIMEOUT
) -> Validation:
    """
    Compare a user's integrator with the reference engine.

    `against` is ``module:function`` or a file, see
    :mod:`chaincor.workflows.validation.user_integrator`. The function may take `timeout` seconds.
    The user's integrator has no error bar, so `tolerance` is the allowed difference in eta. By
    default, it is the scene's tolerance or 1e-6.
    """
    scene = scene_given(scene)
    asked = tolerance or scene.tolerance or DEFAULT_TOLERANCE
    user = run_user_integrator(against, scene, timeout)
    judge = judge_for(scene, asked)
    others = _compare_user_arrays(user, judge, scene)
    found = _restitution_of(user, scene)
    validation = Validation.of(scene, against, found, asked, judge, others)
    if validation.agrees:
        return validation
    contacts = None if user.contact_times is None else len(user.contact_times)
    allowed = validation.comparisons[0].allowed or asked
    note = find_cause(scene, judge, found, allowed, user.velocities, contacts)
    if ":" in against and scene.timestep is not None:
        note = _of_step(scene, against, timeout, found - judge.restitution) or note
    return replace(validation, note=None if note is None else f"likely cause: {note}")


def _of_step(scene: Scene, against: str, timeout: float, difference: float) -> str | None:
    """Return a sentence if the time step causes a difference, because half the step reduces it."""
    assert scene.timestep is not None
    finer = scene.replace(timestep=0.5 * scene.timestep)
    user = run_user_integrator(against, finer, timeout)
    judge = judge_for(scene, DEFAULT_TOLERANCE)
    left = _restitution_of(user, scene) - judge.restitution
    if abs(left) > _FALLS * abs(difference):
        return None
    return (
        f"the step. At {finer.timestep:g} instead of {scene.timestep:g} the difference is "
        f"{abs(left):.1e} instead of {abs(difference):.1e}. Use a smaller step."
    )


def _compare_user_arrays(user: UserOutcome, judge: Collision, scene: Scene) -> list[Comparison]:
    """
    Compare the arrays that the user's integrator returned.

    Only the number of contacts is judged; it must be equal.
    """
    line = scene.line

    def energies(displacements: Array | None, velocities: Any, masses: Array) -> Array | None:
        if displacements is None:
            return None
        return mode_energies(displacements, velocities, scene.bond.stiffness, masses)

    target = user.target_displacements, user.target_velocities, line.target_masses
    given = {
        "contact_times": user.contact_times,
        "contact_speeds": user.contact_speeds,
        "mode_energies": energies(user.displacements, user.velocities, line.chain_masses),
        "target_velocities": user.target_velocities,
        "target_mode_energies": energies(*target),
    }
    comparisons = [
        Comparison(name, farthest(values, getattr(judge, name)), None)
        for name, values in given.items()
        if values is not None
    ]
    if user.contact_times is None:
        return comparisons
    return [compare_contacts(len(user.contact_times), judge), *comparisons]


def _restitution_of(user: UserOutcome, scene: Scene) -> float:
    """Return eta from final velocities; it is negative if the bodies still approach each other."""
    target = np.zeros(1) if user.target_velocities is None else user.target_velocities[::-1]
    e = scene.line.separation(np.concatenate((target, user.velocities))) / scene.impact_velocity
    return e * abs(e)


@dataclass(frozen=True, repr=False)
class UserLadder:
    """Results of a user's integrator at time steps that are halved several times."""

    against: str  #: Name of the user's function.
    steps: tuple[float, ...]  #: Time steps, each of them half the previous one.
    #: Largest difference between eta and the reference engine's result, for each step.
    errors: tuple[float, ...]
    #: Result of the reference engine for eta.
    judge_restitution: float
    judge_error: float  #: Error bar of the reference engine's result.
    verdict: LadderVerdict  #: Convergence order and kind of the error.

    def to_dict(self) -> dict[str, Any]:
        """Return all results as plain values for JSON."""
        return {
            "verdict": self.verdict.kind,
            **{name: getattr(self.verdict, name) for name in ("reason", "order", "order_error")},
            "timesteps": list(self.steps),
            "errors": list(self.errors),
            "judge_restitution": self.judge_restitution,
            "judge_restitution_error": self.judge_error,
        }

    def __repr__(self) -> str:
        verdict = self.verdict
        order = "" if verdict.order is None else f", order {verdict.order:.2f} +- "
        order += "" if verdict.order_error is None else f"{verdict.order_error:.2f}"
        pairs = zip(self.steps, self.errors, strict=True)
        lines = [
            f"{self.against} along halved steps: {verdict.kind}{order}",
            f"({verdict.reason})",
            f"{'timestep':>12} {'error':>10}",
            *(f"{step:12.6g} {error:10.1e}" for step, error in pairs),
            f"reference    eta = {self.judge_restitution:.12g} +- {self.judge_error:.1e}",
        ]
        return "\n".join(lines)


def climb_ladder(scene: Scene, against: str, timeout: float) -> UserLadder:
    """
    Run a user's function at the scene's time step and at 5 smaller steps, halved each time.

    The function must read ``scene.timestep``. Raise InputError if the scene has no time step, or if
    the function returns the same result at all steps.
    """
    if scene.timestep is None:
        raise InputError(
            "--ladder halves the time step, but no time step is given. Give the "
            "largest one with --timestep H. Your integrator reads it as scene.timestep"
        )

    def run(step: float) -> float:
        user = run_user_integrator(against, scene.replace(timestep=step), timeout)
        return _restitution_of(user, scene)

    steps = scene.timestep * 0.5 ** np.arange(RUNGS)[:, None] * np.array(NEARBY)
    found = np.array([[run(float(h)) for h in rung] for rung in steps])
    if np.ptp(found) == 0.0:
        raise InputError(
            f"{against} gives {found[0, 0]!r} at all steps from {steps[0, 0]:g} to "
            f"{steps[-1, 0]:g}. Read the step from scene.timestep in your function"
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
