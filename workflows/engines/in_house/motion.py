"""The loops that move a chain: exact steps with the contacts inside them, and coarse ones."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house.contact_search import PathPoint, build_contact_search
from chaincor.workflows.engines.in_house.stages import Parameters, Stages, State
from chaincor.workflows.engines.schemes import Rule

# Why `advance` came back: all steps done, the end may be near, no room for more contacts, more
# contacts in one step than make sense, a strain that is not allowed.
DONE, ARGUE, FULL, CROWDED, OUTSIDE = range(5)

# Room for the contacts of one step.
SPARE_CONTACTS = 64
# Room in a log for the leaps of one step.
SPARE_LEAPS = 8

# A bond so far ahead of the front is out of reach within one step: over k bonds a disturbance
# falls by about H^(2k)/(2k)!, which is 4e-36 at H = 1. So no digit tells whether all bonds are
# moved or only these.
FRONT_MARGIN = 16
# A strain below this times the impact velocity has not begun to move. What is left out, summed
# over all steps of a run, stays orders of magnitude below rounding.
FRONT_THRESHOLD = 1e-24
# The front takes up as many bonds at once as a vector holds: rests are done one by one.
FRONT_BLOCK = 8
# A contact within a step is likely where the parabola that particle 1 follows at first ends lower
# than this part of the way that the impact velocity would take it.
LIKELY = 0.05

LEDGER = np.dtype(
    [
        ("wall_distance", "f8"),  # x of particle 1
        ("impact_velocity", "f8"),  # v0
        ("momentum", "f8"),  # of the chain, from the impulses
        ("last_contact", "f8"),  # when particle 1 left the wall
        ("argue_after", "f8"),  # the end is argued when so much time has passed since then
        ("patience", "f8"),  # and that is so many mean intervals between contacts
        ("strain_min", "f8"),  # smallest and largest strain met
        ("strain_max", "f8"),
        ("contact_min", "f8"),  # the same up to the last contact
        ("contact_max", "f8"),
        ("strain_floor", "f8"),  # strains outside these stop the run
        ("strain_ceiling", "f8"),
        ("steps", "i8"),  # full steps done
        ("contacts", "i8"),
        ("active", "i8"),  # bonds that have begun to move
        ("evaluations", "i8"),  # of all bond forces
        ("step_evaluations", "i8"),  # of one step
        ("leaps", "i8"),  # in the log
    ]
)


class Arrays(NamedTuple):
    """
    What the loops change in place.

    Attributes
    ----------
    now : State
        The chain, with the ledger's distance of particle 1 from the wall.
    last : State
        The same right after the last contact.
    kept, near, trial : State
        Scratch: before a step, of the particles near the wall while a contact is searched, and of
        what a step tries.
    contacts : ndarray of shape (2, capacity)
        Times and incoming speeds.
    log : ndarray of shape (2, capacity)
        Of each leap its duration, and whether a contact ends it. Mostly without room, and not kept.
    """

    now: State
    last: State
    kept: State
    near: State
    trial: State
    contacts: NDArray[np.float64]
    log: NDArray[np.float64]

    def unnamed(self) -> tuple:
        """Return plain tuples: named ones cost a compiled function 5 us more at each call."""
        now, last, kept, near, trial, contacts, log = self
        states = tuple(now), tuple(last), tuple(kept), tuple(near), tuple(trial)
        return *states, contacts, log


class Search(NamedTuple):
    """What the search for a contact works on; the step begins where the ledger has particle 1."""

    ledger: np.record
    kept: State
    near: State
    trial: State
    rule: Rule


def build_motion(force: Callable, leap: Callable, stages: Stages, register: Callable) -> Callable:
    """
    Put the loops of the stepping engine together.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain, ``force(strain, parameters)``.
    leap : callable
        One step away from the wall, as in ``schemes``.
    stages : Stages
        What it is made of.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``advance(ledger, arrays, goal, step, fractions, parameters)``: take steps until `goal` of
        them are done or something needs the caller. `arrays` are those of `Arrays.unnamed`,
        `fractions` of the scheme, unnamed as well, `parameters` of the potential. With a log it
        also comes back, with `DONE`, when there may be no room for the leaps of another step.
    """
    copy, count_outside, extremes = stages.copy, stages.count_outside, stages.extremes

    @register
    def probe(time: float, search: Search) -> PathPoint:
        # Particle 1 after a step of any size; of the bonds only the first matters.
        ledger, near, rule = search.ledger, search.near, search.rule
        x0, bonds = ledger.wall_distance, ledger.active
        x = leap(x0, search.kept, near, search.trial, bonds, 1, time, rule)
        return x, near.velocity[0], -force(near.strain[0], rule.parameters)

    find_contact = build_contact_search(probe=probe, register=register)

    def advance(
        ledger: Any,
        arrays: tuple,
        goal: int,
        step: float,
        fractions: tuple,
        parameters: Parameters,
    ) -> int:
        now, last, kept, near, trial, contacts, log = arrays
        kept, now, last = State(kept[0], kept[1]), State(now[0], now[1]), State(last[0], last[1])
        near, trial = State(near[0], near[1]), State(trial[0], trial[1])
        strain, velocity = now
        rule = Rule(fractions, parameters)
        search = Search(ledger, kept, near, trial, rule)
        threshold = FRONT_THRESHOLD * ledger.impact_velocity
        while ledger.steps < goal:
            if contacts.shape[1] - ledger.contacts < SPARE_CONTACTS:
                return FULL
            if 0 < log.shape[1] < ledger.leaps + SPARE_LEAPS:
                return DONE
            # After this the step is done, contacts within it included; the grid of steps is kept,
            # which keeps the motion reversible in time.
            begin = ledger.steps * step
            bonds = ledger.active
            left = step
            while left > 0.0:
                if ledger.contacts == contacts.shape[1]:
                    return CROWDED
                copy(strain, velocity, kept, bonds)
                x0 = ledger.wall_distance
                start = (x0, velocity[0], -force(strain[0], parameters))
                # Where a contact is likely, the few particles that act on particle 1 are moved
                # first: it costs less than to move the chain and to take that back.
                ahead = x0 + left * (start[1] + 0.5 * left * start[2])
                likely = ahead < LIKELY * left * ledger.impact_velocity
                if likely:
                    end = probe(left, search)
                else:
                    x1 = leap(x0, kept, now, trial, bonds, bonds, left, rule)
                    ledger.evaluations += ledger.step_evaluations
                    end = (x1, velocity[0], -force(strain[0], parameters))
                time = find_contact(left, start, end, search)
                moved = time if time >= 0.0 else left
                if log.shape[1] > 0:
                    if ledger.leaps == log.shape[1]:
                        return CROWDED
                    log[0, ledger.leaps], log[1, ledger.leaps] = moved, time >= 0.0
                    ledger.leaps += 1
                if likely or time >= 0.0:
                    x1 = leap(x0, kept, now, trial, bonds, bonds, moved, rule)
                    ledger.evaluations += ledger.step_evaluations
                if time < 0.0:
                    ledger.wall_distance = x1
                    break
                speed = abs(velocity[0])
                velocity[0] = speed
                left -= time
                ledger.wall_distance = 0.0
                ledger.momentum += 2.0 * speed
                ledger.last_contact = begin + (step - left)
                ledger.argue_after = ledger.patience * ledger.last_contact / ledger.contacts
                copy(strain, velocity, last, bonds)
                low, high = extremes(strain, bonds)
                ledger.contact_min = min(ledger.strain_min, low)
                ledger.contact_max = max(ledger.strain_max, high)
                contacts[0, ledger.contacts] = ledger.last_contact
                contacts[1, ledger.contacts] = speed
                ledger.contacts += 1
            ledger.steps += 1
            if count_outside(strain, bonds, ledger.strain_min, ledger.strain_max) > 0:
                low, high = extremes(strain, bonds)
                ledger.strain_min = min(ledger.strain_min, low)
                ledger.strain_max = max(ledger.strain_max, high)
                if not (low > ledger.strain_floor and high < ledger.strain_ceiling):
                    return OUTSIDE
            while bonds < strain.shape[0] and abs(strain[bonds - FRONT_MARGIN]) > threshold:
                bonds = min(strain.shape[0], bonds + FRONT_BLOCK)
            ledger.active = bonds
            away = ledger.steps * step - ledger.last_contact
            if ledger.momentum > 0.0 and away >= ledger.argue_after:
                return ARGUE
        return DONE

    return advance


class Glide(NamedTuple):
    """
    A flight in coarse steps, or a part of one.

    Attributes
    ----------
    steps : int
        How many.
    step : float
        Their size.
    clearance : float
        How near to the wall particle 1 may come.
    first, last : bool
        Whether it is the first and the last part: the state is half a step off between parts.
    """

    steps: int
    step: float
    clearance: float
    first: bool
    last: bool


def build_coast(stages: Stages) -> Callable:
    """
    Return the loop over coarse steps.

    Parameters
    ----------
    stages : Stages
        What they are made of.

    Returns
    -------
    callable
        ``coast(ledger, state, glide, parameters)``: takes the Verlet steps of a `Glide` and
        returns how many, fewer than asked for where particle 1 comes too near to the wall or a
        strain is not allowed; the state is half a step off then. State and glide are unnamed.
    """
    stage, drift, extremes = stages.stage, stages.drift, stages.extremes
    count_outside = stages.count_outside

    def coast(ledger: Any, state: tuple, glide: tuple, parameters: Parameters) -> int:
        strain, velocity = state
        steps, step, clearance, first, last = glide
        bonds = strain.shape[0]
        ahead = 0.5 * step if first else step  # the drifts of neighbouring steps merge
        for taken in range(steps):
            ledger.wall_distance += ahead * velocity[0]
            stage(strain, velocity, bonds, ahead, step, parameters)
            ahead = step
            ledger.evaluations += 1
            if not ledger.wall_distance > clearance:
                return taken
            if count_outside(strain, bonds, ledger.strain_min, ledger.strain_max) > 0:
                low, high = extremes(strain, bonds)
                ledger.strain_min = min(ledger.strain_min, low)
                ledger.strain_max = max(ledger.strain_max, high)
                if not (low > ledger.strain_floor and high < ledger.strain_ceiling):
                    return taken
        if last:
            ledger.wall_distance += 0.5 * step * velocity[0]
            drift(strain, velocity, bonds, 0.5 * step)
        return steps

    return coast
