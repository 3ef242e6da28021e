r"""
Build the contact events of the stepping loops, which end a substep when the gap passes zero.

Hard bodies exchange the momentum :math:`2 \mu w` if their gap closes with the speed w; a rigid wall
reverses particle 1. Soft bodies overlap for a while. A step is shortened where they touch and where
they part, because the force has no derivatives there. Near such a moment the force grows as a power
of the time that need not be an integer, and no order of a scheme resolves it. Substeps there are
therefore no longer than their distance in time from this moment, but at least a small fraction of
the step.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.contact_search import PathPoint, build_contact_search
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.damped_contact import build_damped_force
from chaincor.workflows.engines.reference.line_traits import (
    KernelSpec,
    LineParameters,
    read_parameters,
)
from chaincor.workflows.engines.reference.stages import Parameters, State, VerletKernels
from chaincor.workflows.engines.schemes import StepCoefficients

# Substeps next to a moment of touching or parting are at least this part of the step. The momentum
# near this moment is the integral of a power q of the time. The error of one such substep falls as
# its power q + 1, and substeps as long as their distance from the moment have errors of about this
# size.
SHORTEST_SHARE = 2.0**-8
GRADING = 1.0


class ContactFunctions(NamedTuple):
    """
    Functions of a contact, all known to the compiler.

    Each function takes the state and the parameters of the line; the first two also take the
    position of the first particle.
    """

    #: Function that returns the gap and its first and second derivatives in time.
    gap_derivatives: Callable
    #: Function that sets the gap to zero and returns the position of the first particle.
    close: Callable
    #: Function that exchanges a momentum, its second argument, between hard bodies in contact.
    bounce: Callable


def build_contact(source: KernelSpec) -> ContactFunctions:
    """Return the functions of the contact of a kind of line."""
    return _at_wall(source) if source.kind.at_wall else _of_two(source)


def _at_wall(source: KernelSpec) -> ContactFunctions:
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

    return ContactFunctions(gap_derivatives, close, bounce)


def _of_two(source: KernelSpec) -> ContactFunctions:
    register, force = source.register, read_parameters(source).force
    law = source.kind.law
    push, damped = register(law.force_kernel), law.drag_kernel is not None
    damped_force = push
    if law.drag_kernel is not None:
        damped_force = build_damped_force(register(law.drag_kernel), register)

    @register
    def gap_derivatives(_position: float, state: State, parameters: LineParameters) -> PathPoint:
        place, inverse = parameters.gap, parameters.inverse
        strain, velocity = state
        pressed = push(strain[place], parameters.contact)
        if damped:
            rate = velocity[place + 1] - velocity[place]
            pressed = damped_force(pressed, strain[place], rate, parameters.contact)
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

    return ContactFunctions(gap_derivatives, close, bounce)


class Event(NamedTuple):
    """Event of a line as the loop over steps uses it; all functions are known to the compiler."""

    #: ``direction(run_state)``: 1 if the next event is a contact, so that the gap falls, and -1 if
    #: it is a parting.
    direction: Callable
    #: ``condition(position, state, direction, parameters)``: the gap and its first and second
    #: derivatives, times the direction. The first value is positive until the event. `position`
    #: belongs to the first particle.
    condition: Callable
    #: ``reach(run_state, contacts, now, left, step)``: length of the next substep, out of the time
    #: `left` in the step, and the time ahead in which the event is searched.
    reach: Callable
    #: ``state_after(time, path)``: the condition after a substep of any size along a `SubstepPath`.
    state_after: Callable
    #: ``find(far, start, end, run_state, path)``: time of the first zero of the condition, or -1 if
    #: there is none, see ``contact_search``.
    find: Callable
    #: ``shorten_substep(run_state, time, ahead, step)``: length of the substep towards a zero at
    #: `time`, and whether the substep reaches the zero.
    shorten_substep: Callable
    #: ``apply_event(run_state, arrays, moment, bonds, parameters)``: applies the event to the
    #: bodies. `arrays` are the state, the state after the last contact, the contacts and the
    #: masses.
    apply_event: Callable


class SubstepPath(NamedTuple):
    """Path on which an event is searched: particles near the contact in one substep."""

    position: float  #: Position of the first particle before the substep.
    direction: float  #: Direction of the event.
    #: Number of bonds between these particles.
    bonds: int
    wanted: int  #: Number of bonds whose state after the substep is needed.
    #: State before the substep.
    kept: State
    near: State  #: State after the substep.
    trial: State  #: Scratch.
    rule: StepCoefficients  #: Coefficients of the scheme, with the parameters of these particles.


def build_event(source: KernelSpec, stages: VerletKernels, take_step: Callable) -> Event:
    """Return the event of a kind of line; `take_step` is its step."""
    register, wall = source.register, source.kind.at_wall
    copy, extremes = stages.copy, stages.extremes
    gap_derivatives, close, bounce = build_contact(source)
    record_contact, note_parting = map(
        register, (bookkeeping.record_contact, bookkeeping.note_parting)
    )
    note_impulse, begin_range = map(register, (bookkeeping.note_impulse, bookkeeping.begin_range))

    @register
    def direction(run_state: Any) -> float:
        return -1.0 if not wall and run_state.touching else 1.0

    @register
    def condition(position: float, state: State, sign: float, parameters: Any) -> PathPoint:
        gap, rate, gap_acceleration = gap_derivatives(position, state, parameters)
        return sign * gap, sign * rate, sign * gap_acceleration

    @register
    def state_after(time: float, path: SubstepPath) -> PathPoint:
        # Only the bonds next to the gap matter.
        position, sign, bonds, wanted, kept, near, trial, rule = path
        position = take_step(position, kept, near, trial, bonds, wanted, time, rule)
        return condition(position, near, sign, rule.parameters)

    @register
    def reach(
        run_state: Any, contacts: Array, now: float, left: float, step: float
    ) -> tuple[float, float]:
        if wall or not run_state.soft or not run_state.shortest_share < 1.0:
            return left, left
        ahead = left
        if run_state.contacts > 0:
            before = run_state.last_contact
            if run_state.touching:
                before = contacts[0, run_state.contacts - 1]
            away = now - before
            ahead = min(left, max(run_state.shortest_share * step, run_state.grading * away))
        # A substep must also not end just before the bodies part.
        if run_state.touching:
            return ahead, ahead / (run_state.grading / (1.0 + run_state.grading))
        return ahead, ahead

    @register
    def shorten_substep(
        run_state: Any, time: float, ahead: float, step: float
    ) -> tuple[float, bool]:
        if time < 0.0:
            return ahead, False
        if not wall and run_state.touching and time > min(run_state.shortest_share * step, ahead):
            return min(ahead, run_state.grading / (1.0 + run_state.grading) * time), False
        return time, True

    @register
    def momentum_of(masses: Array, velocity: Array) -> float:
        total = 0.0
        for i in range(masses.shape[0]):
            total += masses[i] * velocity[i]
        return total

    @register
    def apply_event(
        run_state: Any, arrays: tuple, moment: float, bonds: int, parameters: Any
    ) -> None:
        state, last, contacts, masses = arrays
        strain, velocity = state
        run_state.position = close(run_state.position, state, parameters)
        speed = -gap_derivatives(run_state.position, state, parameters)[1]
        low, high = extremes(strain, bonds, parameters)
        if not wall and run_state.touching:
            run_state.touching = 0
            given = momentum_of(masses, velocity) - run_state.chain_momentum
            note_impulse(run_state, contacts, given)
        elif not wall and run_state.soft:
            record_contact(run_state, contacts, moment, speed)
            begin_range(run_state, low, high)
            run_state.touching = 1
            run_state.chain_momentum = momentum_of(masses, velocity)
            return
        else:
            record_contact(run_state, contacts, moment, abs(speed))
            begin_range(run_state, low, high)
            given = 2.0 * run_state.contact_mass * abs(speed)
            bounce(state, given, parameters)
            note_impulse(run_state, contacts, given)
        run_state.last_position = run_state.position
        copy(strain, velocity, last, bonds)
        note_parting(run_state, moment, low, high)

    find = build_contact_search(state_after=state_after, register=register)
    return Event(direction, condition, reach, state_after, find, shorten_substep, apply_event)
