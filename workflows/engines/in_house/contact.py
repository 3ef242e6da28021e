"""What a contact is to the loops, for each kind of line: where the gap is, and what happens."""

from collections.abc import Callable
from typing import Any, NamedTuple

from chaincor.workflows.engines.in_house.contact_search import PathPoint
from chaincor.workflows.engines.in_house.line_stages import Kind, LineParameters, contact_force
from chaincor.workflows.engines.in_house.stages import Array, Stages, State


class Contact(NamedTuple):
    """
    What a loop asks of a contact; all are known to the compiler.

    Attributes
    ----------
    named : callable
        ``named(parameters)``: the parameters by name, of those that came unnamed.
    around : callable
        ``around(parameters, begin, end)``: those of some particles alone.
    opening : callable
        ``opening(position, state, parameters)``: the gap, its rate, and the rate of that.
    closing : callable
        ``closing(velocity, parameters)``: the speed with which it closes.
    close : callable
        ``close(strain, parameters)``: sets the gap to zero; returns the position of the first
        particle, or what it was told.
    bounce : callable
        ``bounce(velocity, given, parameters)``: hard bodies exchange a momentum.
    gap : callable
        ``gap(position, strain, parameters)``: the gap alone.
    """

    named: Callable
    around: Callable
    opening: Callable
    closing: Callable
    close: Callable
    bounce: Callable
    gap: Callable


def build_contact(force: Callable, register: Callable, kind: Kind) -> Contact:
    """
    Return the contact of a kind of line.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain, ``force(strain, parameters)``.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.
    kind : Kind
        Of the line.

    Returns
    -------
    Contact
        What it is.
    """
    if kind.contact != "wall":
        return _of_two(force, register)
    return _at_wall(force, register, kind.unit)


def _at_wall(force: Callable, register: Callable, unit: bool) -> Contact:
    if unit:

        @register
        def named(parameters: Any) -> Any:
            return parameters

        @register
        def around(parameters: Any, _begin: int, _end: int) -> Any:
            return parameters

        @register
        def pull(strain: float, parameters: Any) -> float:
            return -force(strain, parameters)

    else:
        named, around = _named(register)

        @register
        def pull(strain: float, parameters: LineParameters) -> float:
            return -force(strain, parameters.bond) * parameters.inverse[0]

    @register
    def opening(position: float, state: State, parameters: Any) -> PathPoint:
        strain, velocity = state
        return position, velocity[0], pull(strain[0], parameters)

    @register
    def closing(velocity: Array, _parameters: Any) -> float:
        return -velocity[0]

    @register
    def close(_strain: Array, _position: float, _parameters: Any) -> float:
        return 0.0

    @register
    def bounce(velocity: Array, _given: float, _parameters: Any) -> None:
        velocity[0] = abs(velocity[0])

    @register
    def gap(position: float, _strain: Array, _parameters: Any) -> float:
        return position

    return Contact(named, around, opening, closing, close, bounce, gap)


def _named(register: Callable) -> tuple[Callable, Callable]:
    @register
    def named(parameters: tuple) -> LineParameters:
        bond, inverse, gap, stiffness, exponent = parameters
        return LineParameters(bond, inverse, gap, stiffness, exponent)

    @register
    def around(parameters: LineParameters, begin: int, end: int) -> LineParameters:
        bond, inverse, gap, stiffness, exponent = parameters
        return LineParameters(bond, inverse[begin:end], gap - begin, stiffness, exponent)

    return named, around


def _of_two(force: Callable, register: Callable) -> Contact:
    named, around = _named(register)
    push = register(contact_force)

    @register
    def opening(_position: float, state: State, parameters: LineParameters) -> PathPoint:
        place, inverse = parameters.gap, parameters.inverse
        strain, velocity = state
        pressed = push(strain[place], parameters.stiffness, parameters.exponent)
        ahead = 0.0
        behind = 0.0
        if place + 1 < strain.shape[0]:
            ahead = force(strain[place + 1], parameters.bond)
        if place > 0:
            behind = force(strain[place - 1], parameters.bond)
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

    return Contact(named, around, opening, closing, close, bounce, gap)


def strains_of(stages: Stages, register: Callable, kind: Kind) -> tuple[Callable, Callable]:
    """
    Return how strains are looked over, the gap left out.

    Parameters
    ----------
    stages : Stages
        Of the line.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.
    kind : Kind
        Of the line.

    Returns
    -------
    count_outside : callable
        ``count_outside(strain, bonds, low, high, parameters)``.
    extremes : callable
        ``extremes(strain, bonds, parameters)``: smallest and largest.
    """
    count, spread = stages.count_outside, stages.extremes
    if kind.contact == "wall":

        @register
        def count_outside(
            strain: Array, bonds: int, low: float, high: float, _parameters: Any
        ) -> int:
            return count(strain, bonds, low, high)

        @register
        def extremes(strain: Array, bonds: int, _parameters: Any) -> tuple[float, float]:
            return spread(strain, bonds)

        return count_outside, extremes

    @register
    def count_of_two(
        strain: Array, bonds: int, low: float, high: float, parameters: LineParameters
    ) -> int:
        place = parameters.gap
        behind = bonds - place - 1
        return count(strain[:place], place, low, high) + count(
            strain[place + 1 :], behind, low, high
        )

    @register
    def extremes_of_two(
        strain: Array, bonds: int, parameters: LineParameters
    ) -> tuple[float, float]:
        place = parameters.gap
        behind = bonds - place - 1
        if place == 0 and behind == 0:
            return 0.0, 0.0
        if place == 0:
            return spread(strain[1:], behind)
        low, high = spread(strain[:place], place)
        if behind > 0:
            further = spread(strain[place + 1 :], behind)
            # What is not a number stays.
            low = low if low <= further[0] or low != low else further[0]
            high = high if high >= further[1] or high != high else further[1]
        return low, high

    return count_of_two, extremes_of_two
