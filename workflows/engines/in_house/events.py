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
from chaincor.workflows.engines.in_house import bookkeeping
from chaincor.workflows.engines.in_house.contact_search import PathPoint, build_contact_search
from chaincor.workflows.engines.in_house.line_kinds import (
    LineParameters,
    Source,
    contact_force,
    read_parameters,
)
from chaincor.workflows.engines.in_house.stages import Parameters, Stages, State
from chaincor.workflows.engines.schemes import Rule

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

    opening: Callable  #: The gap, its rate, and the rate of that.
    close: Callable  #: Sets the gap to zero; returns where the first particle is then.
    bounce: Callable  #: Lets hard bodies that meet exchange the momentum that it is told last.


def build_contact(source: Source) -> Contact:
    """Return the contact of a kind of line."""
    return _at_wall(source) if source.kind.contact == "wall" else _of_two(source)


def _at_wall(source: Source) -> Contact:
    register, read = source.register, read_parameters(source)
    force, weighed = read.force, read.weighed

    @register
    def opening(position: float, state: State, parameters: Parameters) -> PathPoint:
        strain, velocity = state
        bend = weighed(-force(strain[0], parameters), 0, parameters)
        return position, velocity[0], bend

    @register
    def close(_position: float, _state: State, _parameters: Parameters) -> float:
        return 0.0

    @register
    def bounce(state: State, _given: float, _parameters: Parameters) -> None:
        state[1][0] = abs(state[1][0])

    return Contact(opening, close, bounce)


def _of_two(source: Source) -> Contact:
    register, force = source.register, read_parameters(source).force
    push = register(contact_force)

    @register
    def opening(_position: float, state: State, parameters: LineParameters) -> PathPoint:
        place, inverse = parameters.gap, parameters.inverse
        strain, velocity = state
        pressed = push(strain[place], parameters.stiffness, parameters.exponent)
        ahead = 0.0
        behind = 0.0
        if place + 1 < strain.shape[0]:
            ahead = force(strain[place + 1], parameters)
        if place > 0:
            behind = force(strain[place - 1], parameters)
        bend = inverse[place + 1] * (pressed - ahead) - inverse[place] * (behind - pressed)
        return strain[place], velocity[place + 1] - velocity[place], bend

    @register
    def close(position: float, state: State, parameters: LineParameters) -> float:
        state[0][parameters.gap] = 0.0
        return position

    @register
    def bounce(state: State, given: float, parameters: LineParameters) -> None:
        place, inverse, velocity = parameters.gap, parameters.inverse, state[1]
        velocity[place] = velocity[place] - given * inverse[place]
        velocity[place + 1] = velocity[place + 1] + given * inverse[place + 1]

    return Contact(opening, close, bounce)


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
    probe: Callable
    #: ``find(far, start, end, ledger, path)``: when the condition first is zero, -1 for never, see
    #: ``contact_search``.
    find: Callable
    #: ``cut(ledger, time, ahead, step)``: how long the substep is that leads towards a zero at
    #: `time`, and whether it reaches it.
    cut: Callable
    #: ``happen(ledger, arrays, moment, bonds, parameters)``: what the event does to the bodies;
    #: `arrays` are the state, that after the last contact, the contacts and the masses.
    happen: Callable


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
    rule: Rule  #: Of the scheme, with the parameters of these particles.


def build_event(source: Source, stages: Stages, take_step: Callable) -> Event:
    """Return the event of a kind of line, of whose stages `take_step` is made."""
    register, wall = source.register, source.kind.contact == "wall"
    copy, extremes = stages.copy, stages.extremes
    opening, close, bounce = build_contact(source)
    note_contact, note_parting = map(register, (bookkeeping.note_contact, bookkeeping.note_parting))
    note_impulse = register(bookkeeping.note_impulse)

    @register
    def direction(ledger: Any) -> float:
        return -1.0 if not wall and ledger.touching else 1.0

    @register
    def condition(position: float, state: State, sign: float, parameters: Any) -> PathPoint:
        gap, rate, bend = opening(position, state, parameters)
        return sign * gap, sign * rate, sign * bend

    @register
    def probe(time: float, path: Path) -> PathPoint:
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
    def cut(ledger: Any, time: float, ahead: float, step: float) -> tuple[float, bool]:
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
    def happen(ledger: Any, arrays: tuple, moment: float, bonds: int, parameters: Any) -> None:
        state, last, contacts, masses = arrays
        strain, velocity = state
        ledger.position = close(ledger.position, state, parameters)
        speed = -opening(ledger.position, state, parameters)[1]
        if not wall and ledger.touching:
            ledger.touching = 0
            given = momentum_of(masses, velocity) - ledger.chain_momentum
            note_impulse(ledger, contacts, given)
        elif not wall and ledger.soft:
            note_contact(ledger, contacts, moment, speed)
            ledger.touching = 1
            ledger.chain_momentum = momentum_of(masses, velocity)
            return
        else:
            note_contact(ledger, contacts, moment, abs(speed))
            given = 2.0 * ledger.contact_mass * abs(speed)
            bounce(state, given, parameters)
            note_impulse(ledger, contacts, given)
        ledger.last_position = ledger.position
        copy(strain, velocity, last, bonds)
        low, high = extremes(strain, bonds, parameters)
        note_parting(ledger, moment, low, high)

    find = build_contact_search(probe=probe, register=register)
    return Event(direction, condition, reach, probe, find, cut, happen)
