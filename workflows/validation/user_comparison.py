"""A user's own integrator against the in-house one: who agrees, within what."""

import numpy as np

from chaincor.analysis.modes import mode_energies
from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, Scene
from chaincor.workflows.given import scene_given
from chaincor.workflows.result import Collision
from chaincor.workflows.validation.comparison import (
    Comparison,
    Validation,
    compare_contacts,
    judge_for,
    largest_difference,
)
from chaincor.workflows.validation.user_integrator import (
    USER_TIMEOUT,
    UserOutcome,
    run_user_integrator,
)


def validate_user(
    scene: Scene, against: str, tolerance: float | None = None, timeout: float = USER_TIMEOUT
) -> Validation:
    """
    Compare a user's own integrator with the in-house one.

    `against` is ``module:function`` or a file, see
    :mod:`chaincor.workflows.validation.user_integrator`; the function may take `timeout` seconds.
    `tolerance`, by default the scene's or 1e-6, is the difference of eta that is still agreement:
    the user's integrator has no error bar of its own.
    """
    scene = scene_given(scene)
    asked = tolerance or scene.tolerance or DEFAULT_TOLERANCE
    user = run_user_integrator(against, scene, timeout)
    judge = judge_for(scene, asked)
    eta = restitution_of_user(user, scene)
    others = _compare_user_arrays(user, judge, scene)
    return Validation.of(scene, against, eta, asked, judge, others)


def _compare_user_arrays(user: UserOutcome, judge: Collision, scene: Scene) -> list[Comparison]:
    """Compare what the user gives; only the number of contacts has an error bar: none."""
    k, line = scene.bond.stiffness, scene.line
    given: dict[str, Array | None] = {
        "contact_times": user.contact_times,
        "contact_speeds": user.contact_speeds,
        "mode_energies": None,
        "target_velocities": user.target_velocities,
        "target_mode_energies": None,
    }
    if user.displacements is not None:
        masses = None if line.plain else line.chain_masses
        given["mode_energies"] = mode_energies(user.displacements, user.velocities, k, masses)
    if user.target_displacements is not None:
        assert user.target_velocities is not None
        state = user.target_displacements, user.target_velocities
        given["target_mode_energies"] = mode_energies(*state, k, line.target_masses)
    comparisons = [
        Comparison(name, largest_difference(values, getattr(judge, name)), None)
        for name, values in given.items()
        if values is not None
    ]
    if user.contact_times is None:
        return comparisons
    return [compare_contacts(len(user.contact_times), judge), *comparisons]


def restitution_of_user(user: UserOutcome, scene: Scene) -> float:
    """Return eta: of the relative translation, where the target is free."""
    line, v0 = scene.line, scene.impact_velocity
    if line.plain:
        return float(restitution(user.velocities, v0))
    target = np.zeros(1) if user.target_velocities is None else user.target_velocities[::-1]
    return (line.separation(np.concatenate((target, user.velocities))) / v0) ** 2
