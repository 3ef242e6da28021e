"""Runs of the in-house integrator at steps to be compared, and what to make of those that stop."""

from collections.abc import Iterable

import numpy as np

from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.engines.in_house import stepping
from chaincor.workflows.engines.outcome import Outcome


def eta_of(scene: Scene, outcome: Outcome) -> float:
    """Return the restitution of an outcome: of relative translation, where the target is free."""
    e = relative_velocity(scene.line, outcome) / scene.impact_velocity
    return e * e


def largest_difference(scene: Scene, run: Outcome, others: Iterable[Outcome]) -> float:
    """Return how far the restitution of other runs is from that of one, at most."""
    eta = eta_of(scene, run)
    return max(abs(eta_of(scene, other) - eta) for other in others)


def relative_velocity(line: Line, outcome: Outcome) -> float:
    """Return how fast the bodies part: the chain's centre of mass against the target's."""
    target = outcome.target_velocities[::-1] if line.targets else np.zeros(1)
    return line.separation(np.concatenate((target, outcome.velocities)))


def run_in_house(
    scene: Scene, scheme: StepSchemeName, timestep: float, known: Outcome | None = None
) -> Outcome:
    """
    Run the in-house integrator with one scheme and step.

    For `known` see :func:`chaincor.workflows.engines.in_house.stepping.run`.
    """
    return stepping.run(scene, Numerics(scheme=scheme, timestep=timestep), known=known)
