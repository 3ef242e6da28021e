"""Runs of the in-house integrator at steps to be compared, and what to make of those that stop."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.refining import STALLED, Try, has_stalled, that_ran, told
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


@dataclass(frozen=True)
class Refined:
    """The finest of several runs."""

    fine: Outcome  #: The run that gives the number.
    proofs: list[Outcome]  #: Runs at larger steps, the first at twice its step.
    error: float  #: Its error.
    stalled: bool  #: Whether smaller steps had stopped to help.
    tries: list[dict[str, float]]  #: Steps and errors on the way.
    first: Outcome | None = None  #: The run whose end all others took over, where they did.
    #: Change of eta by other roundings, where that is why steps do not help; else 0.
    nudged: float = 0.0
    kinked: bool = False  #: Whether bonds pass kinks, so that Verlet steps are as good as any.
    seconds: float = 0.0  #: Integration time of all runs that were compared.

    @property
    def grazes(self) -> bool:
        """Whether a step makes or takes a contact."""
        return differ(self.fine, self.proofs)


def differ(fine: Outcome, proofs: Sequence[Outcome]) -> bool:
    """Return whether runs have not all as many contacts."""
    return any(len(run.contact_times) != len(fine.contact_times) for run in proofs)


def refined(scene: Scene, tries: Sequence[Try[list[Outcome]]], forgets: bool = False) -> Refined:
    """
    Return the best of several tries, each of a run and its proofs, with what it errs by.

    Where smaller steps have stopped to help, or the collision `forgets` them for its roundings, the
    truth may be wherever one of the last runs went. Where each step is another nudge, the finest is
    no better than the first, whose end may have been followed.
    """
    ran = [(each.error, each.found or []) for each in that_ran(tries)]
    error, runs = min(ran, key=lambda each: each[0])
    stuck = forgets or has_stalled(tries)
    if stuck:
        alike = ran[-STALLED:] if forgets else ran[-STALLED - 1 :]
        runs = alike[0][1] if forgets else runs
        error = largest_difference(scene, runs[0], (run for _, each in alike for run in each))
    # A run may be compared with those at two steps.
    seconds = sum({id(run): run.seconds for _, each in ran for run in each}.values())
    return Refined(runs[0], runs[1:], error, stuck, told(tries), seconds=seconds)
