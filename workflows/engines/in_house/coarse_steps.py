"""The loop over coarse steps of bodies that stay apart, which looks ahead."""

from collections.abc import Callable
from typing import Any, NamedTuple

from chaincor.workflows.engines.in_house.contact import build_contact
from chaincor.workflows.engines.in_house.line_kinds import Source, read_parameters
from chaincor.workflows.engines.in_house.stages import Parameters, Stages


class CoarseSteps(NamedTuple):
    """Steps that are asked for: a flight, or a part of one."""

    steps: int  #: How many.
    step: float  #: Their size.
    clearance: float  #: How small the gap may get.
    #: Whether it is the first and the last part: the state is half a step off between parts.
    first: bool
    last: bool  #: See ``first``.


def build_coarse_steps(source: Source, stages: Stages) -> Callable:
    """
    Return the loop over coarse steps, which the stages of a line are made to.

    Returns
    -------
    callable
        ``take_coarse_steps(ledger, state, asked, parameters)``: takes Verlet steps as `CoarseSteps`
        asks for, and returns how many, fewer where the gap gets too small or a strain is not
        allowed; the state is half a step off then. State and request are unnamed.
    """
    stage, drift, are_allowed = stages.stage, stages.drift, stages.are_allowed
    named, gap_of = read_parameters(source).named, build_contact(source).gap

    def take_coarse_steps(ledger: Any, state: tuple, asked: tuple, parameters: Parameters) -> int:
        strain, velocity = state
        steps, step, clearance, first, last = asked
        parameters = named(parameters)
        bonds = strain.shape[0]
        ahead = 0.5 * step if first else step  # the drifts of neighbouring steps merge
        for taken in range(steps):
            ledger.position += ahead * velocity[0]
            stage(strain, velocity, bonds, ahead, step, parameters)
            ahead = step
            ledger.evaluations += 1
            if not gap_of(ledger.position, strain, parameters) > clearance:
                return taken
            if not are_allowed(ledger, strain, bonds, parameters):
                return taken
        if last:
            ledger.position += 0.5 * step * velocity[0]
            drift(strain, velocity, bonds, 0.5 * step)
        return steps

    return take_coarse_steps
