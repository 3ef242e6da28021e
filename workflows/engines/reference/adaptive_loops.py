r"""
Build the loops of the adaptive engine: the Dormand-Prince method, with contacts.

The state is one array, :math:`(x_1, y_1 \dots y_{n-1}, v_1 \dots v_n)`. The coordinate y of a bond
is its strain or, for bonds that shrink without bound, the logarithm of its length:

.. math:: \dot x_1 = v_1, \qquad \dot y_i = \frac{v_{i+1} - v_i}{dr/dy}, \qquad
          \dot v_i = F(y_{i-1}) - F(y_i).

The method has order 8. It also takes the partial step to the moment of contact; therefore no
interpolation limits the accuracy of contacts.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.contact_search import PathPoint, build_contact_search
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.stages import Parameters

# `advance` returns for one of these reasons: the collision may be over (ARGUE), an array is full
# (FULL), no step is accurate enough (STUCK), a strain is not allowed (OUTSIDE), the time `longest`
# is reached (LATE), `pause` steps are done (PAUSE), or the collision is proved to be over (OVER).
ARGUE, FULL, STUCK, OUTSIDE, LATE, PAUSE, OVER = range(7)

# The step-size control aims at the allowed error times SAFETY. It changes the step by a factor
# between SHRINK and GROW.
SAFETY = 0.9
SHRINK, GROW = 0.2, 8.0
ORDER = 8
# The method counts as stuck after this many rejected steps in a row. Sixty rejections already
# shorten the step by 42 orders of magnitude.
MOST_REFUSALS = 80

# In this engine, the fields for strains contain the bond coordinates y.
RUN_STATE: Any = np.dtype(
    (
        np.record,
        [
            *bookkeeping.RUN_STATE.descr,
            ("time", "f8"),
            ("step", "f8"),  # length of the next trial step
            ("longest", "f8"),  # time at which the run stops
            ("next_frame", "f8"),
            ("frame_interval", "f8"),
            ("frames", "i8"),
            ("pause", "i8"),  # value of `steps` at which `advance` returns
        ],
    )
)


class Tableau(NamedTuple):
    """Coefficients of an embedded Runge-Kutta method."""

    a: Array  #: Weights of the earlier slopes in each stage; of shape (stages, stages).
    b: Array  #: Weights of the slopes in the step; of shape (stages,).
    #: Weights of the slopes in the error estimate of order 3; of shape (stages + 1,).
    third: Array
    #: Weights of the slopes in the error estimate of order 5; of shape (stages + 1,).
    fifth: Array


class AdaptiveArrays(NamedTuple):
    """Arrays that the loops change in place."""

    #: Current state of the chain; of shape (2n,).
    state: Array
    last: Array  #: State right after the last contact; of shape (2n,).
    #: Times, incoming speeds and impulses of the contacts; of shape (3, capacity).
    contacts: Array
    frames: Array  #: Snapshots; of shape (capacity, 2n).
    scale: Array  #: Allowed local error; of shape (2n,).
    #: Scratch: state before a step; of shape (2n,).
    kept: Array
    #: Scratch: rates of change within the step; of shape (stages + 1, 2n).
    slopes: Array
    trial: Array  #: Scratch: state after a partial step; of shape (2n,).
    #: Scratch: rates of change within a partial step; of shape (stages + 1, 2n).
    trial_slopes: Array
    part: Array  #: Scratch: one weighted slope; of shape (2n,).
    errors: Array  #: Scratch: error estimates of orders 3 and 5; of shape (2, 2n).


class AdaptivePath(NamedTuple):
    """Path along which a contact is searched: steps of any length from the state before a step."""

    arrays: AdaptiveArrays
    method: Tableau
    parameters: Parameters


def strain_bond(kernel: Callable) -> Callable:
    """Return a function of the strain that returns the force and 1/(dr/dy) = 1."""

    def bond(strain: float, parameters: Parameters) -> tuple[float, float]:
        return kernel(strain, parameters), 1.0

    return bond


def looped_rates(bond: Callable) -> Callable:
    """
    Return the equations of motion ``rates(state, out, parameters)`` as a loop to be compiled.

    ``bond(y, parameters)`` returns the force and 1/(dr/dy).
    """

    def rates(state: Array, out: Array, parameters: Parameters) -> None:
        bonds = state.shape[0] // 2 - 1
        velocity = bonds + 1
        out[0] = state[velocity]
        behind = 0.0
        for i in range(bonds):
            ahead, inverse_stretch = bond(state[1 + i], parameters)
            out[1 + i] = (state[velocity + i + 1] - state[velocity + i]) * inverse_stretch
            out[velocity + i] = behind - ahead
            behind = ahead
        out[velocity + bonds] = behind

    return rates


def array_rates(force: Callable) -> Callable:
    """Return the equations of motion in NumPy, for a force that cannot be compiled."""

    def rates(state: Array, out: Array, _parameters: Parameters) -> None:
        particles = state.shape[0] // 2
        velocity = state[particles:]
        forces = force(state[1:particles])
        out[0] = velocity[0]
        out[1:particles] = np.diff(velocity)
        out[particles:] = 0.0
        out[particles:-1] -= forces
        out[particles + 1 :] += forces

    return rates


def build_step(rates: Callable, register: Callable) -> tuple[Callable, Callable]:
    """
    Return ``take``, which takes a step, and ``estimate``, which returns its relative error.

    The error is relative to the allowed error. Both functions work on a path of `AdaptiveArrays`,
    or of arrays with the same names.
    """
    extremes = register(bookkeeping.extremes)

    @partial(register, inline=False)
    def take(
        start: Array,
        result: Array,
        slopes: Array,
        step: float,
        path: AdaptivePath,
    ) -> None:
        # Take one step; slopes[0] must contain the rates of change at the start of the step.
        a, b, part, parameters = path.method.a, path.method.b, path.arrays.part, path.parameters
        stages = b.shape[0]
        for s in range(1, stages):
            np.positive(start, result)
            for j in range(s):
                if a[s, j] != 0.0:
                    np.multiply(slopes[j], step * a[s, j], part)
                    np.add(result, part, result)
            rates(result, slopes[s], parameters)
        np.positive(start, result)
        for j in range(stages):
            if b[j] != 0.0:
                np.multiply(slopes[j], step * b[j], part)
                np.add(result, part, result)
        rates(result, slopes[stages], parameters)

    @register
    def largest(weights: Array, error: Array, path: AdaptivePath) -> float:
        arrays = path.arrays
        np.multiply(arrays.slopes[0], weights[0], error)
        for j in range(1, weights.shape[0]):
            np.multiply(arrays.slopes[j], weights[j], arrays.part)
            np.add(error, arrays.part, error)
        np.abs(error, error)
        np.divide(error, arrays.scale, error)
        return extremes(error, error.shape[0])[1]

    return take, build_estimate(largest, register)


def build_estimate(largest: Callable, register: Callable) -> Callable:
    """
    Return ``estimate(step, path)``, the relative error of a step.

    ``largest(weights, error, path)`` returns the largest component of the combination of slopes
    with these weights, relative to the allowed error; `error` is scratch.
    """

    @register
    def estimate(step: float, path: Any) -> float:
        # This is Hairer's combination of the error estimates of orders 5 and 3. Each estimate is
        # the largest among the components of the state.
        low = largest(path.method.third, path.arrays.errors[0], path)
        high = largest(path.method.fifth, path.arrays.errors[1], path)
        if high == 0.0:
            return low * 0.0
        return step * high * high / np.sqrt(high * high + 0.01 * low * low)

    return estimate


def build_flight(rates: Callable, register: Callable) -> Callable:
    """
    Return the loop of the adaptive engine.

    ``advance(run_state, arrays, method, parameters)`` moves the chain until the caller must act,
    and returns the reason. `arrays` are `AdaptiveArrays`, `method` is a `Tableau`.
    """
    record_contact, note_parting = map(
        register, (bookkeeping.record_contact, bookkeeping.note_parting)
    )
    note_impulse, widen = map(register, (bookkeeping.note_impulse, bookkeeping.widen))
    extremes = register(bookkeeping.extremes)
    take, estimate = build_step(rates, register)

    @register
    def state_after(time: float, path: AdaptivePath) -> PathPoint:
        trial, slopes = path.arrays.trial, path.arrays.trial_slopes
        take(path.arrays.kept, trial, slopes, time, path)
        particles = trial.shape[0] // 2
        return trial[0], trial[particles], slopes[path.method.b.shape[0], particles]

    find_contact = build_contact_search(state_after=state_after, register=register)

    def advance(
        run_state: np.record, arrays: AdaptiveArrays, method: Tableau, parameters: Parameters
    ) -> int:
        state, contacts, frames = arrays.state, arrays.contacts, arrays.frames
        kept, slopes = arrays.kept, arrays.slopes
        trial, trial_slopes = arrays.trial, arrays.trial_slopes
        path = AdaptivePath(arrays, method, parameters)
        particles = state.shape[0] // 2
        final = method.b.shape[0]
        refusals = 0
        rates(state, slopes[0], parameters)
        while run_state.time < run_state.longest:
            if refusals == 0 and run_state.steps >= run_state.pause:
                return PAUSE
            step = run_state.step
            if (
                run_state.contacts == contacts.shape[1]
                or step / run_state.frame_interval > frames.shape[0] - run_state.frames - 1
            ):
                return FULL
            np.positive(state, kept)
            take(kept, state, slopes, step, path)
            run_state.evaluations += final
            error = estimate(step, path)
            if not error < 1.0:
                np.positive(kept, state)
                factor = SAFETY * error ** (-1.0 / ORDER)
                run_state.step = step * (factor if factor > SHRINK else SHRINK)
                refusals += 1
                if refusals > MOST_REFUSALS:
                    return STUCK
                continue
            grow = SAFETY * error ** (-1.0 / ORDER) if error > 0.0 else GROW
            run_state.step = step * min(1.0 if refusals > 0 else GROW, grow)
            refusals = 0
            run_state.steps += 1

            start = (kept[0], kept[particles], slopes[0, particles])
            end = (state[0], state[particles], slopes[final, particles])
            np.positive(slopes[0], trial_slopes[0])
            contact = find_contact(step, start, end, run_state, path)
            taken = contact if contact >= 0.0 else step
            while run_state.next_frame < run_state.time + taken:
                time = run_state.next_frame - run_state.time
                take(kept, trial, trial_slopes, time, path)
                np.positive(trial, frames[run_state.frames])
                run_state.frames += 1
                run_state.next_frame = run_state.frames * run_state.frame_interval
            run_state.time += taken
            if contact >= 0.0:
                take(kept, state, trial_slopes, contact, path)
                speed = abs(state[particles])
                state[0] = 0.0
                state[particles] = speed
                record_contact(run_state, contacts, run_state.time, speed)
                note_impulse(run_state, contacts, 2.0 * speed)
                np.positive(state, arrays.last)
                rates(state, slopes[0], parameters)
            else:
                np.positive(slopes[final], slopes[0])
            low, high = extremes(state[1:particles], particles - 1)
            if contact >= 0.0:
                note_parting(run_state, run_state.time, low, high)
            if not widen(run_state, low, high):
                return OUTSIDE
            if (
                run_state.momentum > 0.0
                and run_state.time - run_state.last_contact >= run_state.argue_after
            ):
                return ARGUE
        return LATE

    return advance
