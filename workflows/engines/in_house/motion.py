r"""
The loops that move the bodies of a line: exact steps with the contacts inside them, coarse ones.

Hard bodies exchange the momentum :math:`2 \mu w` where their gap closes with the speed w; at a
rigid wall that reverses particle 1. Soft ones overlap for a while: a step is cut where they touch
and where they part, as the force has no derivatives there. Next to such a moment the force grows as
a power that need not be whole, which no order of a scheme resolves: steps are at most as long as
they stay away from it, down to a small part of the usual one.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house.contact import build_contact
from chaincor.workflows.engines.in_house.contact_search import PathPoint, build_contact_search
from chaincor.workflows.engines.in_house.line_kinds import Source, read_parameters
from chaincor.workflows.engines.in_house.stages import Array, Parameters, Stages, State
from chaincor.workflows.engines.schemes import Rule

# Why `advance` came back: all steps done, the end may be near, no room for more contacts, more
# contacts in one step than make sense, a strain that is not allowed.
DONE, ARGUE, FULL, CROWDED, OUTSIDE = range(5)

# Room for the contacts of one step.
SPARE_CONTACTS = 64
# Room in a log for the substeps of one step; graded steps beside soft contacts are many.
SPARE_SUBSTEPS, SPARE_GRADED_SUBSTEPS = 8, 256

# A bond so far ahead of the front is out of reach within one step: over k bonds a disturbance
# falls by about H^(2k)/(2k)!, which is 4e-36 at H = 1. So no digit tells whether all bonds are
# moved or only these.
FRONT_MARGIN = 16
# A strain below this times the impact velocity has not begun to move. What is left out, summed
# over all steps of a run, stays orders of magnitude below rounding.
FRONT_THRESHOLD = 1e-24
# The front takes up as many bonds at once as a vector holds: rests are done one by one.
FRONT_BLOCK = 8
# A contact within a step is likely where the parabola that the gap follows at first ends lower
# than this part of the way that the impact velocity would take it.
LIKELY = 0.05
# Shortest step next to a moment of touching or parting, in parts of the usual one. The momentum
# there is the integral of a power q of the time: what such a step misses falls as its power q + 1,
# and steps as long as they stay away from it miss about as much.
SHORTEST_SHARE = 2.0**-8
GRADING = 1.0

LEDGER = np.dtype(
    [
        ("position", "f8"),  # x of the first particle; before a hard wall the gap
        ("last_position", "f8"),  # the same when the last contact ended
        ("impact_velocity", "f8"),  # v0
        ("contact_mass", "f8"),  # reduced mass of the particles that meet
        ("momentum", "f8"),  # of the relative motion of the bodies, from the impulses
        ("chain_momentum", "f8"),  # of the chain when soft bodies touched
        ("first_contact", "f8"),  # when the bodies first met
        ("last_contact", "f8"),  # when the last contact ended
        ("argue_after", "f8"),  # the end is argued when so much time has passed since then
        ("argue_first", "f8"),  # the same after the first contact
        ("patience", "f8"),  # and that is so many mean intervals between contacts
        ("shortest_share", "f8"),  # of a step, next to moments of touching and parting
        ("grading", "f8"),  # steps beside them, over how far their nearer end stays away
        ("strain_min", "f8"),  # smallest and largest strain met
        ("strain_max", "f8"),
        ("contact_min", "f8"),  # the same up to the last contact
        ("contact_max", "f8"),
        ("strain_floor", "f8"),  # strains outside these stop the run
        ("strain_ceiling", "f8"),
        ("steps", "i8"),  # full steps done
        ("contacts", "i8"),
        ("soft", "i8"),  # whether bodies overlap when they meet
        ("touching", "i8"),  # whether they do now
        ("active", "i8"),  # bonds that have begun to move
        ("evaluations", "i8"),  # of all bond forces
        ("step_evaluations", "i8"),  # of one step
        ("substeps", "i8"),  # in the log
    ]
)


class Arrays(NamedTuple):
    """
    What the loops change in place.

    Attributes
    ----------
    now : State
        The line, with the ledger's position of its first particle.
    last : State
        The same right after the last contact.
    kept, near, trial : State
        Scratch: before a step, of the particles near the contact while one is searched, and of
        what a step tries.
    contacts : ndarray of shape (3, capacity)
        Times and closing speeds, and the momentum given to the chain.
    masses : ndarray of shape (N,)
        Of the chain's particles; 0 for those of a target.
    window : ndarray of shape (2,)
        First and last but one of the particles near the contact.
    log : ndarray of shape (2, capacity)
        Of each substep, a step or a part of one, its duration, and whether a contact ends it.
        Mostly without room, and not kept.
    """

    now: State
    last: State
    kept: State
    near: State
    trial: State
    contacts: NDArray[np.float64]
    masses: NDArray[np.float64]
    window: NDArray[np.int64]
    log: NDArray[np.float64]

    def unnamed(self) -> tuple:
        """Return plain tuples: named ones cost a compiled function 5 us more at each call."""
        now, last, kept, near, trial, *others = self
        return *(tuple(state) for state in (now, last, kept, near, trial)), *others


class Search(NamedTuple):
    """What the search for a contact works on: particles near it before a step, and how many."""

    position: float
    sign: float
    bonds: int
    wanted: int
    kept: State
    near: State
    trial: State
    rule: Rule


def build_motion(source: Source, stages: Stages, take_step: Callable) -> Callable:
    """
    Put the loops of the stepping engine together.

    Parameters
    ----------
    source : Source
        What they are made from.
    stages : Stages
        Of the same line.
    take_step : callable
        One step of them without a contact, as in ``schemes``.

    Returns
    -------
    callable
        ``advance(ledger, arrays, goal, step, fractions, parameters)``: take steps until `goal` of
        them are done or something needs the caller. `arrays` are those of `Arrays.unnamed`,
        `fractions` of the scheme, unnamed as well, `parameters` those of the line. With a log it
        also comes back, with `DONE`, when there may be no room for the substeps of another step.
    """
    copy, count_outside, extremes = stages.copy, stages.count_outside, stages.extremes
    register, wall = source.register, source.kind.contact == "wall"
    named, around, *_ = read_parameters(source)
    opening, closing_speed, close, bounce, _ = build_contact(source)

    @register
    def probe(time: float, search: Search) -> PathPoint:
        # The gap after a step of any size; of the bonds only those next to it matter.
        position, sign, bonds, wanted, kept, near, trial, rule = search
        position = take_step(position, kept, near, trial, bonds, wanted, time, rule)
        x, v, a = opening(position, near, rule.parameters)
        return sign * x, sign * v, sign * a

    find_contact = build_contact_search(probe=probe, register=register)

    @register
    def momentum_of(masses: Array, velocity: Array) -> float:
        total = 0.0
        for i in range(masses.shape[0]):
            total += masses[i] * velocity[i]
        return total

    @register
    def widen(ledger: Any, strain: Array, bonds: int, parameters: Any) -> bool:
        # Note the strains; return whether they are allowed.
        if count_outside(strain, bonds, ledger.strain_min, ledger.strain_max, parameters) > 0:
            low, high = extremes(strain, bonds, parameters)
            ledger.strain_min = min(ledger.strain_min, low)
            ledger.strain_max = max(ledger.strain_max, high)
            return low > ledger.strain_floor and high < ledger.strain_ceiling
        return True

    @register
    def touch(ledger: Any, contacts: Array, velocity: Array, masses: Array, speed: float) -> None:
        # Soft bodies begin to overlap.
        ledger.touching = 1
        ledger.chain_momentum = momentum_of(masses, velocity)
        contacts[1, ledger.contacts] = speed
        ledger.contacts += 1

    @register
    def part(ledger: Any, contacts: Array, velocity: Array, masses: Array) -> None:
        ledger.touching = 0
        given = momentum_of(masses, velocity) - ledger.chain_momentum
        contacts[2, ledger.contacts - 1] = given
        ledger.momentum += given

    @register
    def collide(ledger: Any, contacts: Array, velocity: Array, speed: float, rule: Rule) -> None:
        given = 2.0 * ledger.contact_mass * speed
        bounce(velocity, given, rule.parameters)
        contacts[1, ledger.contacts] = speed
        contacts[2, ledger.contacts] = given
        ledger.momentum += given
        ledger.contacts += 1

    @register
    def leave(ledger: Any, arrays: tuple, now: float, bonds: int, parameters: Any) -> None:
        # A contact has ended.
        strain, velocity = arrays[0]
        ledger.last_contact = now
        ledger.last_position = ledger.position
        if ledger.contacts == 1:
            ledger.argue_after = ledger.argue_first
        else:
            lasted = now - ledger.first_contact
            ledger.argue_after = ledger.patience * lasted / (ledger.contacts - 1)
        copy(strain, velocity, State(arrays[1][0], arrays[1][1]), bonds)
        low, high = extremes(strain, bonds, parameters)
        ledger.contact_min = min(ledger.strain_min, low)
        ledger.contact_max = max(ledger.strain_max, high)

    def advance(
        ledger: Any,
        arrays: tuple,
        goal: int,
        step: float,
        fractions: tuple,
        parameters: Parameters,
    ) -> int:
        now, _, kept, near, trial, contacts, masses, window, log = arrays
        kept, now = State(kept[0], kept[1]), State(now[0], now[1])
        near, trial = State(near[0], near[1]), State(trial[0], trial[1])
        strain, velocity = now
        begin, end = window[0], window[1]
        parameters = named(parameters)
        rule = Rule(fractions, parameters)
        near_rule = Rule(fractions, around(parameters, begin, end))
        kept_near = State(kept[0][begin : end - 1], kept[1][begin:end])
        threshold = FRONT_THRESHOLD * ledger.impact_velocity
        shortest, grading = ledger.shortest_share * step, ledger.grading
        towards = grading / (1.0 + grading)
        soft = False
        if not wall:
            soft = ledger.soft > 0
        graded = soft and shortest < step
        spare = SPARE_GRADED_SUBSTEPS if graded else SPARE_SUBSTEPS
        while ledger.steps < goal:
            if contacts.shape[1] - ledger.contacts < SPARE_CONTACTS:
                return FULL
            if 0 < log.shape[1] < ledger.substeps + spare:
                return DONE
            # After this the step is done, contacts within it included; the grid of steps is kept,
            # which keeps the motion reversible in time.
            since = ledger.steps * step
            bonds = ledger.active
            left = step
            while left > 0.0:
                if ledger.contacts == contacts.shape[1]:
                    return CROWDED
                ahead = left
                sign = 1.0
                if soft and ledger.touching:
                    sign = -1.0
                if graded and ledger.contacts > 0:
                    event = ledger.last_contact
                    if ledger.touching:
                        event = contacts[0, ledger.contacts - 1]
                    away = since + (step - left) - event
                    ahead = min(left, max(shortest, grading * away))
                # A step must not end just before bodies part, either.
                far = ahead
                if graded and ledger.touching:
                    far = ahead / towards
                copy(strain, velocity, kept, bonds)
                x0 = ledger.position
                x, v, a = opening(x0, now, parameters)
                start = (sign * x, sign * v, sign * a)
                around_bonds = end - begin - 1
                wanted = around_bonds
                if wall:
                    around_bonds = min(bonds, around_bonds)
                    wanted = 1
                search = Search(x0, sign, around_bonds, wanted, kept_near, near, trial, near_rule)
                # Where a contact is likely, the few particles that act on the gap are moved first:
                # it costs less than to move all and to take that back.
                reached = start[0] + far * (start[1] + 0.5 * far * start[2])
                likely = reached < LIKELY * far * ledger.impact_velocity
                x1 = x0
                if likely:
                    stop = probe(far, search)
                else:
                    x1 = take_step(x0, kept, now, trial, bonds, bonds, ahead, rule)
                    ledger.evaluations += ledger.step_evaluations
                    x, v, a = opening(x1, now, parameters)
                    stop = (sign * x, sign * v, sign * a)
                    far = ahead
                time = find_contact(far, start, stop, search)
                meets = time >= 0.0
                moved = time if meets else ahead
                if soft and meets and ledger.touching and time > min(shortest, ahead):
                    meets = False
                    moved = min(ahead, towards * time)
                if log.shape[1] > 0:
                    if ledger.substeps == log.shape[1]:
                        return CROWDED
                    log[0, ledger.substeps], log[1, ledger.substeps] = moved, meets
                    ledger.substeps += 1
                if likely or moved != ahead or meets:
                    x1 = take_step(x0, kept, now, trial, bonds, bonds, moved, rule)
                    ledger.evaluations += ledger.step_evaluations
                ledger.position = x1
                left -= moved
                if not meets:
                    continue
                ledger.position = close(strain, x1, parameters)
                moment = since + (step - left)
                speed = closing_speed(velocity, parameters)
                if soft and ledger.touching:
                    part(ledger, contacts, velocity, masses)
                else:
                    contacts[0, ledger.contacts] = moment
                    if ledger.contacts == 0:
                        ledger.first_contact = moment
                    if soft:
                        touch(ledger, contacts, velocity, masses, speed)
                        continue
                    collide(ledger, contacts, velocity, abs(speed), rule)
                leave(ledger, arrays, moment, bonds, parameters)
            ledger.steps += 1
            if not widen(ledger, strain, bonds, parameters):
                return OUTSIDE
            while bonds < strain.shape[0] and abs(strain[bonds - FRONT_MARGIN]) > threshold:
                bonds = min(strain.shape[0], bonds + FRONT_BLOCK)
            ledger.active = bonds
            away = ledger.steps * step - ledger.last_contact
            if ledger.momentum > 0.0 and away >= ledger.argue_after and not ledger.touching:
                return ARGUE
        return DONE

    return advance


class CoarseSteps(NamedTuple):
    """
    A flight in coarse steps, or a part of one.

    Attributes
    ----------
    steps : int
        How many.
    step : float
        Their size.
    clearance : float
        How small the gap may get.
    first, last : bool
        Whether it is the first and the last part: the state is half a step off between parts.
    """

    steps: int
    step: float
    clearance: float
    first: bool
    last: bool


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
    stage, drift = stages.stage, stages.drift
    named, gap_of = read_parameters(source).named, build_contact(source).gap
    count_outside, extremes = stages.count_outside, stages.extremes

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
            if count_outside(strain, bonds, ledger.strain_min, ledger.strain_max, parameters) > 0:
                low, high = extremes(strain, bonds, parameters)
                ledger.strain_min = min(ledger.strain_min, low)
                ledger.strain_max = max(ledger.strain_max, high)
                if not (low > ledger.strain_floor and high < ledger.strain_ceiling):
                    return taken
        if last:
            ledger.position += 0.5 * step * velocity[0]
            drift(strain, velocity, bonds, 0.5 * step)
        return steps

    return take_coarse_steps
