r"""
What a contact is to the loops, and what ends a substep: that the gap of a line passes zero.

Hard bodies exchange the momentum :math:`2 \mu w` where their gap closes with the speed w; at a
rigid wall that reverses particle 1. Soft ones overlap for a while: a step is cut where they touch
and where they part, as the force has no derivatives there. Next to such a moment the force grows as
a power that need not be whole, which no order of a scheme resolves: substeps are at most as long as
they stay away from it, down to a small part of the step.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.contact_search import PathPoint, build_contact_search
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.line_traits import (
    KernelSpec,
    LineParameters,
    read_parameters,
)
from chaincor.workflows.engines.reference.stages import Parameters, State, VerletKernels
from chaincor.workflows.engines.schemes import StepCoefficients

# Shortest substep next to a moment of touching or parting, in parts of the step. The momentum
# there is the integral of a power q of the time: what such a substep misses falls as its power
# q + 1, and substeps as long as they stay away from it miss about as much.
SHORTEST_SHARE = 2.0**-8
GRADING = 1.0


class Contact(NamedTuple):
    """
    What a loop asks of a contact; all are known to the compiler.

    Each is told the state and the parameters of the line, the first two also where it begins.
    """

    gap_derivatives: Callable  #: The gap, its rate, and the rate of that.
    close: Callable  #: Sets the gap to zero; returns where the first particle is then.
    bounce: Callable  #: Lets hard bodies that meet exchange the momentum that it is told last.


def build_contact(source: KernelSpec) -> Contact:
    """Return the contact of a kind of line."""
    return _at_wall(source) if source.kind.at_wall else _of_two(source)


def _at_wall(source: KernelSpec) -> Contact:
    register, read = source.register, read_parameters(source)
    force, over_mass = read.force, read.over_mass

    @register
    def gap_derivatives(position: float, state: State, parameters: Parameters) -> PathPoint:
        strain, velocity = state
        gap_acceleration = over_mass(-force(strain[0], parameters), 0, parameters)
        return position, velocity[0], gap_acceleration

    @register
    def close(_position: float, _state: State, _parameters: Parameters) -> float:
        return 0.0

    @register
    def bounce(state: State, _given: float, _parameters: Parameters) -> None:
        state[1][0] = abs(state[1][0])

    return Contact(gap_derivatives, close, bounce)


def _of_two(source: KernelSpec) -> Contact:
    register, force = source.register, read_parameters(source).force
    push = register(source.kind.law.force_kernel)

    @register
    def gap_derivatives(_position: float, state: State, parameters: LineParameters) -> PathPoint:
        place, inverse = parameters.gap, parameters.inverse
        strain, velocity = state
        pressed = push(strain[place], parameters.contact)
        ahead = 0.0
        behind = 0.0
        if place + 1 < strain.shape[0]:
            ahead = force(strain[place + 1], parameters)
        if place > 0:
            behind = force(strain[place - 1], parameters)
        gap_acceleration = inverse[place + 1] * (pressed - ahead) - inverse[place] * (
            behind - pressed
        )
        return strain[place], velocity[place + 1] - velocity[place], gap_acceleration

    @register
    def close(position: float, state: State, parameters: LineParameters) -> float:
        state[0][parameters.gap] = 0.0
        return position

    @register
    def bounce(state: State, given: float, parameters: LineParameters) -> None:
        place, inverse, velocity = parameters.gap, parameters.inverse, state[1]
        velocity[place] = velocity[place] - given * inverse[place]
        velocity[place + 1] = velocity[place + 1] + given * inverse[place + 1]

    return Contact(gap_derivatives, close, bounce)


class Event(NamedTuple):
    """The event of a line, as the loop over its steps knows it; all are known to the compiler."""

    #: ``direction(ledger)``: 1 where bodies meet next, so that the gap falls, -1 where they part.
    direction: Callable
    #: ``condition(position, state, direction, parameters)``: the gap, its rate and the rate of
    #: that, times the direction: positive until the event. `position` is the first particle's.
    condition: Callable
    #: ``reach(ledger, contacts, now, left, step)``: how long the next substep is, of what is left
    #: of a step, and how far ahead the event is searched.
    reach: Callable
    #: ``probe(time, path)``: the condition after a substep of any size, along a `Path`.
    state_after: Callable
    #: ``find(far, start, end, ledger, path)``: when the condition first is zero, -1 for never, see
    #: ``contact_search``.
    find: Callable
    #: ``cut(ledger, time, ahead, step)``: how long the substep is that leads towards a zero at
    #: `time`, and whether it reaches it.
    shorten_substep: Callable
    #: ``happen(ledger, arrays, moment, bonds, parameters)``: what the event does to the bodies;
    #: `arrays` are the state, that after the last contact, the contacts and the masses.
    apply_event: Callable


class Path(NamedTuple):
    """What an event is searched on: the particles near the contact, in one substep of any size."""

    position: float  #: Of the first particle, before the substep.
    direction: float  #: Of the event.
    #: Between these particles, and those that act on the gap.
    bonds: int
    wanted: int  #: See ``bonds``.
    #: Before the substep, after it, and scratch.
    kept: State
    near: State  #: See ``kept``.
    trial: State  #: See ``kept``.
    rule: StepCoefficients  #: Of the scheme, with the parameters of these particles.


def build_event(source: KernelSpec, stages: VerletKernels, take_step: Callable) -> Event:
    """Return the event of a kind of line, of whose stages `take_step` is made."""
    register, wall = source.register, source.kind.at_wall
    copy, extremes = stages.copy, stages.extremes
    gap_derivatives, close, bounce = build_contact(source)
    record_contact, note_parting = map(
        register, (bookkeeping.record_contact, bookkeeping.note_parting)
    )
    note_impulse = register(bookkeeping.note_impulse)

    @register
    def direction(ledger: Any) -> float:
        return -1.0 if not wall and ledger.touching else 1.0

    @register
    def condition(position: float, state: State, sign: float, parameters: Any) -> PathPoint:
        gap, rate, gap_acceleration = gap_derivatives(position, state, parameters)
        return sign * gap, sign * rate, sign * gap_acceleration

    @register
    def state_after(time: float, path: Path) -> PathPoint:
        # Of the bonds only those next to the gap matter.
        position, sign, bonds, wanted, kept, near, trial, rule = path
        position = take_step(position, kept, near, trial, bonds, wanted, time, rule)
        return condition(position, near, sign, rule.parameters)

    @register
    def reach(
        ledger: Any, contacts: Array, now: float, left: float, step: float
    ) -> tuple[float, float]:
        if wall or not ledger.soft or not ledger.shortest_share < 1.0:
            return left, left
        ahead = left
        if ledger.contacts > 0:
            before = ledger.last_contact
            if ledger.touching:
                before = contacts[0, ledger.contacts - 1]
            away = now - before
            ahead = min(left, max(ledger.shortest_share * step, ledger.grading * away))
        # A substep must not end just before bodies part, either.
        if ledger.touching:
            return ahead, ahead / (ledger.grading / (1.0 + ledger.grading))
        return ahead, ahead

    @register
    def shorten_substep(ledger: Any, time: float, ahead: float, step: float) -> tuple[float, bool]:
        if time < 0.0:
            return ahead, False
        if not wall and ledger.touching and time > min(ledger.shortest_share * step, ahead):
            return min(ahead, ledger.grading / (1.0 + ledger.grading) * time), False
        return time, True

    @register
    def momentum_of(masses: Array, velocity: Array) -> float:
        total = 0.0
        for i in range(masses.shape[0]):
            total += masses[i] * velocity[i]
        return total

    @register
    def apply_event(ledger: Any, arrays: tuple, moment: float, bonds: int, parameters: Any) -> None:
        state, last, contacts, masses = arrays
        strain, velocity = state
        ledger.position = close(ledger.position, state, parameters)
        speed = -gap_derivatives(ledger.position, state, parameters)[1]
        if not wall and ledger.touching:
            ledger.touching = 0
            given = momentum_of(masses, velocity) - ledger.chain_momentum
            note_impulse(ledger, contacts, given)
        elif not wall and ledger.soft:
            record_contact(ledger, contacts, moment, speed)
            ledger.touching = 1
            ledger.chain_momentum = momentum_of(masses, velocity)
            return
        else:
            record_contact(ledger, contacts, moment, abs(speed))
            given = 2.0 * ledger.contact_mass * abs(speed)
            bounce(state, given, parameters)
            note_impulse(ledger, contacts, given)
        ledger.last_position = ledger.position
        copy(strain, velocity, last, bonds)
        low, high = extremes(strain, bonds, parameters)
        note_parting(ledger, moment, low, high)

    find = build_contact_search(state_after=state_after, register=register)
    return Event(direction, condition, reach, state_after, find, shorten_substep, apply_event)
