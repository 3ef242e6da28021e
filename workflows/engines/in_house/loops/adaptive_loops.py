"""
The loops of the adaptive engine: Dormand and Prince's order 8 with contacts by the step itself.

The state and its equations of motion are those of ``adaptive_rates``.

A contact is located on the step: the step from the state before it to the moment of contact is
taken with the same method, so that no interpolation limits it.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from chaincor.workflows.engines.in_house.contact_search import (
    SEARCH_FIELDS,
    build_contact_search,
)
from chaincor.workflows.engines.in_house.polynomials import PathPoint
from chaincor.workflows.engines.in_house.stages import Array, Parameters

# Why `advance` came back.
ARGUE, FULL, STUCK, OUTSIDE, LATE, PAUSE = range(6)

# Step-size control: aim below the error allowed, change by no more than this in one step.
SAFETY = 0.9
SHRINK, GROW = 0.2, 8.0
ORDER = 8
# Steps refused one after the other before the method is stuck: 0.2^60 spans 42 orders.
MOST_REFUSALS = 80

LEDGER = np.dtype(
    [
        ("time", "f8"),
        ("step", "f8"),  # to be tried next
        ("momentum", "f8"),
        ("last_contact", "f8"),
        ("argue_after", "f8"),
        ("patience", "f8"),
        ("longest", "f8"),  # time at which the run stops
        ("next_frame", "f8"),
        ("frame_interval", "f8"),
        ("lowest", "f8"),  # smallest and largest bond coordinate met
        ("highest", "f8"),
        ("contact_lowest", "f8"),  # the same up to the last contact
        ("contact_highest", "f8"),
        ("floor", "f8"),  # coordinates outside these stop the run
        ("ceiling", "f8"),
        ("contacts", "i8"),
        ("frames", "i8"),
        ("steps", "i8"),
        ("evaluations", "i8"),
        ("pause", "i8"),  # steps after which it comes back
        ("paused", "i8"),  # whether it did, and nothing has changed since
        *SEARCH_FIELDS,
    ]
)


class Tableau(NamedTuple):
    """An embedded method of Runge and Kutta."""

    a: Array  #: What each stage takes of the slopes before it; of shape (stages, stages).
    b: Array  #: What the step takes of them; of shape (stages,).
    #: The same of the errors of the embedded orders 3 and 5; of shape (stages + 1,).
    third: Array
    fifth: Array  #: See ``third``.


class Arrays(NamedTuple):
    """What the loops work on."""

    #: The chain now and right after its last contact; of shape (2n,).
    state: Array
    last: Array  #: See ``state``.
    contacts: Array  #: Times and incoming speeds; of shape (2, capacity).
    frames: Array  #: Snapshots; of shape (capacity, 2n).
    scale: Array  #: The local error allowed; of shape (2n,).
    #: Scratch: the state before a step, and what a partial step leads to; of shape (2n,).
    kept: Array
    #: Rates of change within the step, and within a partial one; of shape (stages + 1, 2n).
    slopes: Array
    trial: Array  #: See ``kept``.
    trial_slopes: Array  #: See ``slopes``.


class Path(NamedTuple):
    """What a contact is searched on: one step of any size from the state that is kept."""

    arrays: Arrays
    method: Tableau
    parameters: Parameters


def build_flight(rates: Callable, register: Callable, register_long: Callable) -> Callable:
    """
    Put the loops of the adaptive engine together.

    Parameters
    ----------
    rates : callable
        The equations of motion, ``rates(state, out, parameters)``.
    register, register_long : callable
        Make a function known to the compiler, or leave it as it is; the second, one that works for
        long. Of a loop that several such functions make, Numba runs other code where it has just
        compiled it than where it loads it, and last digits differ: so only one is.

    Returns
    -------
    callable
        ``advance(ledger, arrays, method, parameters)``: moves the chain until something needs the
        caller; `arrays` as in `Arrays`, `method` a `Tableau`.
    """

    @register_long
    def take(
        start: Array,
        result: Array,
        slopes: Array,
        step: float,
        method: Tableau,
        parameters: Parameters,
    ) -> None:
        # One step; slopes[0] must hold the rates at the start.
        a, b = method.a, method.b
        stages = b.shape[0]
        for s in range(1, stages):
            result[:] = start
            for j in range(s):
                if a[s, j] != 0.0:
                    result += (step * a[s, j]) * slopes[j]
            rates(result, slopes[s], parameters)
        result[:] = start
        for j in range(stages):
            if b[j] != 0.0:
                result += (step * b[j]) * slopes[j]
        rates(result, slopes[stages], parameters)

    @register
    def estimate(slopes: Array, step: float, method: Tableau, scale: Array) -> float:
        # Hairer's combination of the embedded orders 5 and 3, largest over the components.
        third, fifth = method.third, method.fifth
        errors = np.zeros((2, scale.shape[0]))
        for j in range(third.shape[0]):
            errors[0] += third[j] * slopes[j]
            errors[1] += fifth[j] * slopes[j]
        low = np.max(np.abs(errors[0]) / scale)
        high = np.max(np.abs(errors[1]) / scale)
        if high == 0.0:
            return low * 0.0
        return step * high * high / np.sqrt(high * high + 0.01 * low * low)

    @register
    def probe(time: float, path: Path) -> PathPoint:
        arrays, method = path.arrays, path.method
        trial, slopes = arrays.trial, arrays.trial_slopes
        take(arrays.kept, trial, slopes, time, method, path.parameters)
        particles = trial.shape[0] // 2
        return trial[0], trial[particles], slopes[method.b.shape[0], particles]

    find_contact = build_contact_search(probe=probe, register=register)

    def advance(ledger: np.record, arrays: Arrays, method: Tableau, parameters: Parameters) -> int:
        state, contacts, frames = arrays.state, arrays.contacts, arrays.frames
        kept, slopes = arrays.kept, arrays.slopes
        trial, trial_slopes = arrays.trial, arrays.trial_slopes
        path = Path(arrays, method, parameters)
        particles = state.shape[0] // 2
        final = method.b.shape[0]
        refusals = 0
        if ledger.paused == 0:
            rates(state, slopes[0], parameters)
        ledger.paused = 0
        while ledger.time < ledger.longest:
            if refusals == 0 and ledger.steps >= ledger.pause:
                ledger.paused = 1
                return PAUSE
            step = ledger.step
            if (
                ledger.contacts == contacts.shape[1]
                or step / ledger.frame_interval > frames.shape[0] - ledger.frames - 1
            ):
                return FULL
            kept[:] = state
            take(kept, state, slopes, step, method, parameters)
            ledger.evaluations += final
            error = estimate(slopes, step, method, arrays.scale)
            if not error < 1.0:
                state[:] = kept
                factor = SAFETY * error ** (-1.0 / ORDER)
                ledger.step = step * (factor if factor > SHRINK else SHRINK)
                refusals += 1
                if refusals > MOST_REFUSALS:
                    return STUCK
                continue
            grow = SAFETY * error ** (-1.0 / ORDER) if error > 0.0 else GROW
            ledger.step = step * min(1.0 if refusals > 0 else GROW, grow)
            refusals = 0
            ledger.steps += 1

            start = (kept[0], kept[particles], slopes[0, particles])
            end = (state[0], state[particles], slopes[final, particles])
            trial_slopes[0] = slopes[0]
            contact = find_contact(step, start, end, ledger, path)
            taken = contact if contact >= 0.0 else step
            while ledger.next_frame < ledger.time + taken:
                time = ledger.next_frame - ledger.time
                take(kept, trial, trial_slopes, time, method, parameters)
                frames[ledger.frames] = trial
                ledger.frames += 1
                ledger.next_frame = ledger.frames * ledger.frame_interval
            ledger.time += taken
            if contact >= 0.0:
                take(kept, state, trial_slopes, contact, method, parameters)
                speed = abs(state[particles])
                state[0] = 0.0
                state[particles] = speed
                ledger.momentum += 2.0 * speed
                ledger.last_contact = ledger.time
                ledger.argue_after = ledger.patience * ledger.time / ledger.contacts
                contacts[0, ledger.contacts] = ledger.time
                contacts[1, ledger.contacts] = speed
                ledger.contacts += 1
                arrays.last[:] = state
                rates(state, slopes[0], parameters)
            else:
                slopes[0] = slopes[final]
            bonds = state[1:particles]
            ledger.lowest = min(ledger.lowest, np.min(bonds))
            ledger.highest = max(ledger.highest, np.max(bonds))
            if contact >= 0.0:
                ledger.contact_lowest, ledger.contact_highest = ledger.lowest, ledger.highest
            if not (ledger.lowest > ledger.floor and ledger.highest < ledger.ceiling):
                return OUTSIDE
            if ledger.momentum > 0.0 and ledger.time - ledger.last_contact >= ledger.argue_after:
                return ARGUE
        return LATE

    return advance
