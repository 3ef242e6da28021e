r"""
Build the contact events at which the stepping loops end a substep.

Hard bodies exchange the momentum :math:`2 \mu w` if their gap closes with the speed w; a rigid wall
reverses the velocity of particle 1. Soft bodies overlap for a while. The force is not smooth when
the bodies touch and when they part. A step that contains such an event is therefore shortened to
end at it. Near an event, the force grows as a power of the time. If this power is not an integer,
no scheme reaches its order. Substeps near an event are therefore no longer than the time between
them and the event, but at least a small fraction of the step.
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

# Near an event of soft bodies, a substep is GRADING times as long as its time from the event, but
# at least SHORTEST_SHARE times the step. The force grows as a power q of the time from the event.
# The error of the shortest substep is therefore proportional to the power q + 1 of its length;
# longer substeps have errors of similar size.
SHORTEST_SHARE = 2.0**-8
GRADING = 1.0


class ContactFunctions(NamedTuple):
    """
    Functions of a contact, all registered with the compiler.

    Each function takes the state and the parameters of the bodies. `gap_derivatives` and `close`
    also take the position of the first particle.
    """

    #: Function that returns the gap and its first and second derivatives in time.
    gap_derivatives: Callable
    #: Function that sets the gap to zero and returns the position of the first particle.
    close: Callable
    #: Function that transfers a momentum, its second argument, between hard bodies in contact.
    bounce: Callable


def build_contact(source: KernelSpec) -> ContactFunctions:
    """Return the contact functions for bodies with the traits of `source`."""
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
    """Functions for events in the loop over steps, all registered with the compiler."""

    #: ``direction(run_state)``: 1 if the bodies touch at the next event (the gap falls to zero),
    #: and -1 if they part.
    direction: Callable
    #: ``condition(position, state, direction, parameters)``: the gap and its first and second
    #: derivatives, times the direction. The gap times the direction is positive until the event.
    #: `position` is the position of the first particle.
    condition: Callable
    #: ``reach(run_state, contacts, now, left, step)``: length of the next substep, and the time
    #: ahead within which the event is searched for. `left` is the time left in the step.
    reach: Callable
    #: ``state_after(time, path)``: the condition after a substep of any length along a
    #: `SubstepPath`.
    state_after: Callable
    #: ``find(far, start, end, run_state, path)``: time of the first zero of the condition, or -1 if
    #: there is none, see ``contact_search``.
    find: Callable
    #: ``shorten_substep(run_state, time, ahead, step)``: length of the substep towards a zero at
    #: `time`, and whether the substep reaches the zero.
    shorten_substep: Callable
    #: ``apply_event(run_state, arrays, moment, bonds, parameters)``: applies the event to the
    #: bodies. `arrays` consists of the state, the state after the last contact, the record of
    #: contacts, and the masses.
    apply_event: Callable


class SubstepPath(NamedTuple):
    """Motion near the contact during one substep, along which events are searched for."""

    position: float  #: Position of the first particle before the substep.
    direction: float  #: 1 if the bodies touch at the next event, -1 if they part.
    #: Number of bonds that move.
    bonds: int
    wanted: int  #: Number of bonds whose state after the substep is needed.
    #: State before the substep.
    kept: State
    near: State  #: State after the substep.
    trial: State  #: Scratch.
    rule: StepCoefficients  #: Coefficients of the scheme, and parameters of the moving particles.


def build_event(source: KernelSpec, stages: VerletKernels, take_step: Callable) -> Event:
    """Return the event functions for bodies with the traits of `source`."""
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
        # Move only the bonds next to the gap, because no other bonds affect the condition.
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
        # A substep must not end just before the bodies part; the search therefore looks farther
        # ahead.
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
