r"""
The loop that moves two bodies on a line, contacts included.

Hard bodies exchange the momentum :math:`2 \mu w` where their gap closes with the speed w, as a
chain is reversed at its wall. Soft ones overlap for a while: a step is cut where they touch and
where they part, as the force has no derivatives there. Next to such a moment the force grows as a
power that need not be whole, which no order of a scheme resolves: steps away from it double from a
small part of the usual one, and steps towards it halve.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house.contact_search import PathPoint, build_contact_search
from chaincor.workflows.engines.in_house.lines.verlet import LineParameters, contact_force
from chaincor.workflows.engines.in_house.stages import Array, Stages, State
from chaincor.workflows.engines.schemes import Rule

# Why `advance` came back: all steps done, no room for more contacts, more contacts in one step than
# make sense, a strain that is not allowed.
DONE, FULL, CROWDED, OUTSIDE = range(4)
# Room for the contacts of one step.
SPARE_CONTACTS = 64
# Shortest step next to a moment of touching or parting, in parts of the usual one. The momentum
# there is the integral of a power q of the time: what such a step misses falls as its power q + 1,
# and steps that double miss about as much.
SHORTEST_SHARE = 2.0**-8

LINE_LEDGER = np.dtype(
    [
        ("steps", "i8"),  # full steps done
        ("contacts", "i8"),
        ("touching", "i8"),  # whether soft bodies overlap
        ("soft", "i8"),
        ("shortest_share", "f8"),  # of a step, next to moments of touching and parting
        ("contact_mass", "f8"),  # reduced mass of the particles that meet
        ("chain_momentum", "f8"),  # of the chain when the bodies touched
        ("parted", "f8"),  # when the last contact ended
        ("position", "f8"),  # displacement of the first particle along x
        ("last_position", "f8"),  # the same when the last contact ended
        ("strain_min", "f8"),  # smallest and largest strain met
        ("strain_max", "f8"),
        ("contact_min", "f8"),  # the same up to the end of the last contact
        ("contact_max", "f8"),
        ("strain_floor", "f8"),  # strains outside these stop the run
        ("strain_ceiling", "f8"),
        ("evaluations", "i8"),  # of all bond forces
        ("step_evaluations", "i8"),  # of one step
    ]
)


class LineArrays(NamedTuple):
    """
    What the loop changes in place.

    Attributes
    ----------
    now, last : State
        The line now, and right after the last contact.
    kept, trial : State
        Scratch: before a step, and what a step tries.
    near, near_trial : State
        The same of the particles near the contact, while one is searched.
    contacts : ndarray of shape (3, capacity)
        Times and closing speeds, and the momentum given to the chain.
    masses : ndarray of shape (N,)
        Of the chain's particles; 0 for those of the target.
    window : ndarray of shape (2,)
        First and last but one of the particles near the contact.
    """

    now: State
    last: State
    kept: State
    trial: State
    near: State
    near_trial: State
    contacts: NDArray[np.float64]
    masses: NDArray[np.float64]
    window: NDArray[np.int64]


class LineSearch(NamedTuple):
    """What the search for a contact works on: the particles near it, before a step."""

    kept: State
    near: State
    trial: State
    sign: float
    rule: Rule


def build_line_motion(
    force: Callable, leap: Callable, stages: Stages, register: Callable
) -> Callable:
    """
    Put the loop together.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain, ``force(strain, parameters)``.
    leap : callable
        One step without a contact, as in ``schemes``.
    stages : Stages
        What it is made of.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``advance(ledger, arrays, goal, step, fractions, parameters)``: take steps until `goal` of
        them are done or something needs the caller.
    """
    copy, repulsion = stages.copy, register(contact_force)

    @register
    def opening(state: State, parameters: LineParameters) -> PathPoint:
        # The gap, its rate and the rate of that.
        gap, inverse = parameters.gap, parameters.inverse
        strain, velocity = state
        push = repulsion(strain[gap], parameters.stiffness, parameters.exponent)
        ahead = 0.0
        behind = 0.0
        if gap + 1 < strain.shape[0]:
            ahead = force(strain[gap + 1], parameters.bond)
        if gap > 0:
            behind = force(strain[gap - 1], parameters.bond)
        pull = inverse[gap + 1] * (push - ahead) - inverse[gap] * (behind - push)
        return strain[gap], velocity[gap + 1] - velocity[gap], pull

    @register
    def probe(time: float, search: LineSearch) -> PathPoint:
        bonds = search.kept.strain.shape[0]
        leap(0.0, search.kept, search.near, search.trial, bonds, bonds, time, search.rule)
        gap, rate, bend = opening(search.near, search.rule.parameters)
        return search.sign * gap, search.sign * rate, search.sign * bend

    find_contact = build_contact_search(probe=probe, register=register)

    @register
    def note_strains(ledger: Any, strain: Array, gap: int) -> bool:
        # Not of the gap, which may be as large as it likes.
        for i in range(strain.shape[0]):
            if i != gap and not ledger.strain_min <= strain[i] <= ledger.strain_max:
                ledger.strain_min = min(ledger.strain_min, strain[i])
                ledger.strain_max = max(ledger.strain_max, strain[i])
                if not ledger.strain_floor < strain[i] < ledger.strain_ceiling:
                    return False
        return True

    @register
    def momentum_of(masses: Array, velocity: Array) -> float:
        total = 0.0
        for i in range(masses.shape[0]):
            total += masses[i] * velocity[i]
        return total

    def advance(
        ledger: Any,
        arrays: tuple,
        goal: int,
        step: float,
        fractions: tuple,
        parameters: LineParameters,
    ) -> int:
        now, last, kept, trial, near, near_trial, contacts, masses, window = arrays
        now, last = State(now[0], now[1]), State(last[0], last[1])
        kept, trial = State(kept[0], kept[1]), State(trial[0], trial[1])
        near, near_trial = State(near[0], near[1]), State(near_trial[0], near_trial[1])
        strain, velocity = now
        bonds = strain.shape[0]
        bond, inverse, gap, stiffness, exponent = parameters
        parameters = LineParameters(bond, inverse, gap, stiffness, exponent)
        begin, end = window[0], window[1]
        around = LineParameters(bond, inverse[begin:end], gap - begin, stiffness, exponent)
        rule, near_rule = Rule(fractions, parameters), Rule(fractions, around)
        kept_near = State(kept.strain[begin : end - 1], kept.velocity[begin:end])
        shortest = ledger.shortest_share * step
        while ledger.steps < goal:
            if contacts.shape[1] - ledger.contacts < SPARE_CONTACTS:
                return FULL
            since = ledger.steps * step
            left = step
            # Steps double from the moment at which soft bodies touched or parted.
            limit = step
            while left > 0.0:
                if ledger.contacts == contacts.shape[1]:
                    return CROWDED
                sign = -1.0 if ledger.touching else 1.0
                ahead = min(left, limit)
                copy(strain, velocity, kept, bonds)
                x0, v0, a0 = opening(now, parameters)
                position = ledger.position
                ledger.position = leap(position, kept, now, trial, bonds, bonds, ahead, rule)
                ledger.evaluations += ledger.step_evaluations
                x1, v1, a1 = opening(now, parameters)
                search = LineSearch(kept_near, near, near_trial, sign, near_rule)
                time = find_contact(
                    ahead,
                    (sign * x0, sign * v0, sign * a0),
                    (sign * x1, sign * v1, sign * a1),
                    search,
                )
                if time < 0.0:
                    left -= ahead
                    limit *= 2.0
                    continue
                if ledger.touching and time > shortest:
                    # Towards parting by halves.
                    time *= 0.5
                    ledger.position = leap(position, kept, now, trial, bonds, bonds, time, rule)
                    ledger.evaluations += ledger.step_evaluations
                    left -= time
                    limit = time
                    continue
                ledger.position = leap(position, kept, now, trial, bonds, bonds, time, rule)
                ledger.evaluations += ledger.step_evaluations
                left -= time
                strain[gap] = 0.0
                closing = velocity[gap] - velocity[gap + 1]
                if ledger.soft:
                    limit = shortest
                    if ledger.touching:
                        ledger.touching = 0
                        given = momentum_of(masses, velocity) - ledger.chain_momentum
                        contacts[2, ledger.contacts - 1] = given
                    else:
                        ledger.touching = 1
                        ledger.chain_momentum = momentum_of(masses, velocity)
                        contacts[0, ledger.contacts] = since + (step - left)
                        contacts[1, ledger.contacts] = closing
                        ledger.contacts += 1
                        continue
                else:
                    speed = abs(closing)
                    given = 2.0 * ledger.contact_mass * speed
                    velocity[gap] = velocity[gap] - given * inverse[gap]
                    velocity[gap + 1] = velocity[gap + 1] + given * inverse[gap + 1]
                    contacts[0, ledger.contacts] = since + (step - left)
                    contacts[1, ledger.contacts] = speed
                    contacts[2, ledger.contacts] = given
                    ledger.contacts += 1
                ledger.parted = since + (step - left)
                ledger.last_position = ledger.position
                copy(strain, velocity, last, bonds)
                if not note_strains(ledger, strain, gap):
                    return OUTSIDE
                ledger.contact_min = ledger.strain_min
                ledger.contact_max = ledger.strain_max
            ledger.steps += 1
            if not note_strains(ledger, strain, gap):
                return OUTSIDE
        return DONE

    return advance
