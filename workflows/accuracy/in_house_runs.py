"""Runs of the in-house integrator at steps to be compared, and what to make of those that stop."""

from collections.abc import Sequence

import numpy as np

from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.engines.in_house import stepping
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.errors import RunError, TimestepError

# Too large a step also makes particles meet or bonds break: so many steps, each about half of the
# one before, must say the same: a sixteenth of a guessed step is stable beyond doubt.
_CONFIRMATIONS = 4


def eta_of(scene: Scene, outcome: Outcome) -> float:
    """Return the restitution of an outcome: of relative translation, where the target is free."""
    e = relative_velocity(scene.line, outcome) / scene.impact_velocity
    return e * e


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


def is_believed(refusals: Sequence[RunError]) -> bool:
    """
    Return whether runs at ever smaller steps agree on what stops them.

    `refusals` are what stopped the runs since the last that was not stopped. True where the last
    few have the same name, one that a smaller step does not cure.
    """
    kinds = [type(refusal) for refusal in refusals[-_CONFIRMATIONS:]]
    return len(kinds) == _CONFIRMATIONS and set(kinds) == {kinds[0]} - {TimestepError}
