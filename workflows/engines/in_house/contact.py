"""What a contact is to the loops, for each kind of line: where the gap is, and what happens."""

from collections.abc import Callable
from typing import NamedTuple

from chaincor.workflows.engines.in_house.line_kinds import (
    LineParameters,
    Source,
    contact_force,
    read_parameters,
)
from chaincor.workflows.engines.in_house.polynomials import PathPoint
from chaincor.workflows.engines.in_house.stages import Array, Parameters, State


class Contact(NamedTuple):
    """What a loop asks of a contact; all are known to the compiler."""

    #: ``opening(position, state, parameters)``: the gap, its rate, and the rate of that.
    opening: Callable
    closing: Callable  #: ``closing(velocity, parameters)``: the speed with which it closes.
    #: ``close(strain, position, parameters)``: sets the gap to zero; returns the position of the
    #: first particle, or what it was told.
    close: Callable
    bounce: Callable  #: ``bounce(velocity, given, parameters)``: hard bodies exchange a momentum.
    gap: Callable  #: ``gap(position, strain, parameters)``: the gap alone.


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
    def closing(velocity: Array, _parameters: Parameters) -> float:
        return -velocity[0]

    @register
    def close(_strain: Array, _position: float, _parameters: Parameters) -> float:
        return 0.0

    @register
    def bounce(velocity: Array, _given: float, _parameters: Parameters) -> None:
        velocity[0] = abs(velocity[0])

    @register
    def gap(position: float, _strain: Array, _parameters: Parameters) -> float:
        return position

    return Contact(opening, closing, close, bounce, gap)


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
    def closing(velocity: Array, parameters: LineParameters) -> float:
        place = parameters.gap
        return velocity[place] - velocity[place + 1]

    @register
    def close(strain: Array, position: float, parameters: LineParameters) -> float:
        strain[parameters.gap] = 0.0
        return position

    @register
    def bounce(velocity: Array, given: float, parameters: LineParameters) -> None:
        place, inverse = parameters.gap, parameters.inverse
        velocity[place] = velocity[place] - given * inverse[place]
        velocity[place + 1] = velocity[place + 1] + given * inverse[place + 1]

    @register
    def gap(_position: float, strain: Array, parameters: LineParameters) -> float:
        return strain[parameters.gap]

    return Contact(opening, closing, close, bounce, gap)
