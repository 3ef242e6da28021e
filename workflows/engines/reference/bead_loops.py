r"""
Build the loops for beads: adaptive steps of order 8, and contacts of the bodies.

The state of N beads along x is one array, :math:`(x_1, s_1 \dots s_{N-1}, v_1 \dots v_N, Q)`, where
Q is the energy lost to damping. One of the strains s is the gap between the bodies, which has its
own contact law. A step in which the bodies touch or part ends at this moment; the same method takes
this shorter step.

A bound on an energy proves that the bodies never touch again. Choose constant velocities w that
rise along x and are close to the velocities v of the beads. Because no pair of beads attracts and
damping only removes energy, :math:`K = \sum m (v - w)^2/2 + U` never grows. The velocity of a bead
therefore never differs from its w by more than :math:`\sqrt{2 K/m}`. Consider the two beads beside
the gap while the bodies are apart. If their velocities w differ by more than the sum of both
bounds, the bodies never touch again.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.adaptive_loops import (
    FULL,
    GROW,
    LATE,
    MOST_REFUSALS,
    ORDER,
    OVER,
    PAUSE,
    SAFETY,
    SHRINK,
    STUCK,
    Tableau,
)
from chaincor.workflows.engines.reference.bead_events import (
    build_bead_contact,
    build_end,
    build_moment,
)
from chaincor.workflows.engines.reference.bead_step import build_bead_step
from chaincor.workflows.engines.reference.tracked import Overlapping, build_track

RUN_STATE: Any = np.dtype(
    (
        np.record,
        [
            ("time", "f8"),
            ("step", "f8"),  # length of the next trial step
            ("longest", "f8"),  # time at which the run stops
            ("next_frame", "f8"),
            ("frame_interval", "f8"),
            ("momentum", "f8"),  # momentum of the chain when soft bodies touched
            ("last_contact", "f8"),  # time at which the last contact ended
            ("strain_min", "f8"),  # smallest and largest strain so far
            ("strain_max", "f8"),
            ("contact_min", "f8"),  # smallest and largest strain up to the last contact
            ("contact_max", "f8"),
            ("gap", "i8"),  # index of the gap among the strains
            ("soft", "i8"),  # whether bodies overlap in a contact
            ("touching", "i8"),  # whether bodies overlap now
            ("contacts", "i8"),
            ("frames", "i8"),
            ("free", "i8"),  # whether the bodies provably never touch again
            ("steps", "i8"),
            ("evaluations", "i8"),
            ("pause", "i8"),  # number of steps after which `advance` returns
        ],
    )
)


class BeadArrays(NamedTuple):
    """Arrays that the loops change in place, named as in ``adaptive_loops.AdaptiveArrays``."""

    state: Array  #: Current state; this array and the next six are of shape (2N + 1,).
    last: Array  #: State right after the last contact.
    kept: Array
    trial: Array
    scale: Array
    part: Array
    rising: Array
    slopes: Array
    #: Rates of change within a partial step; `slopes` and this array are of shape (stages + 1, 2N +
    #: 1).
    trial_slopes: Array
    errors: Array  #: Error estimates of orders 3 and 5; of shape (2, 2N + 1).
    contacts: Array  #: Times, closing speeds and impulses of the contacts; of shape (3, capacity).
    frames: Array  #: Snapshots; of shape (capacity, 2N + 1).
    masses: Array  #: Masses, infinite for a rigid wall; of shape (N,).
    tracked: Array  #: Values of `tracked.TRACKED`.


class BeadParameters(NamedTuple):
    """Parameters of the forces and masses."""

    bond: Any  #: Parameters of the kernel of the bond.
    contact: Any  #: Parameters of the kernel of the contact law.
    inverse: Array  #: Inverse masses 1/m; of shape (N,).
    stiffness: Array  #: Factors of the forces of bonds; of shape (N - 1,).
    gap: int
    damping: float  #: Factor of the damping force, and exponent of the overlap in this force.
    damping_power: float


class BeadPath(NamedTuple):
    """Steps of any length from the state before a step."""

    arrays: BeadArrays
    method: Tableau
    parameters: BeadParameters


def build_bead_flight(bond: Callable, rates: Callable, register: Callable) -> Callable:
    """
    Return the loop of the adaptive engine for beads.

    ``advance(run_state, arrays, method, parameters)`` moves the beads until the caller must act,
    and returns the reason. `bond` computes the force at one strain.
    """
    extremes = register(bookkeeping.extremes)
    take, estimate = build_bead_step(rates, register)
    chain_momentum, end, begin = build_bead_contact(register)
    is_over, moment_of = build_end(bond, register), build_moment(take, register)
    track = build_track(register)

    @register
    def overlapping(state: Array, slopes: Array, gap: int) -> Overlapping:
        beads = state.shape[0] // 2
        acceleration = slopes[beads + gap + 1] - slopes[beads + gap]
        return Overlapping(state[1 + gap], slopes[1 + gap], acceleration)

    def advance(
        run_state: Any, arrays: BeadArrays, method: Tableau, parameters: BeadParameters
    ) -> int:
        state, kept, frames = arrays.state, arrays.kept, arrays.frames
        slopes, trial, trial_slopes = arrays.slopes, arrays.trial, arrays.trial_slopes
        path = BeadPath(arrays, method, parameters)
        beads, gap, final = arrays.masses.shape[0], run_state.gap, method.b.shape[0]
        refusals = 0
        closes = state[beads + gap] > state[beads + gap + 1]
        if run_state.steps == 0 and run_state.contacts == 0 and state[1 + gap] == 0.0 and closes:
            begin(run_state, arrays, parameters)
        rates(state, slopes[0], parameters)
        while run_state.time < run_state.longest:
            if not run_state.free and is_over(run_state, arrays, parameters):
                return OVER
            if refusals == 0 and run_state.steps >= run_state.pause:
                return PAUSE
            step = run_state.step
            rows = step / run_state.frame_interval
            if (
                run_state.contacts == arrays.contacts.shape[1]
                or rows > frames.shape[0] - run_state.frames - 1
            ):
                return FULL
            np.positive(state, kept)
            take(kept, state, slopes, step, path)
            run_state.evaluations += final
            error = estimate(step, path)
            if not error < 1.0:
                np.positive(kept, state)
                run_state.step = step * max(SHRINK, SAFETY * error ** (-1.0 / ORDER))
                # The comparison is false for a NaN.
                if not run_state.step > 0.0:
                    run_state.step = step * SHRINK
                refusals += 1
                if refusals > MOST_REFUSALS:
                    return STUCK
                continue
            grow = SAFETY * error ** (-1.0 / ORDER) if error > 0.0 else GROW
            run_state.step = step * min(1.0 if refusals > 0 else GROW, grow)
            refusals = 0
            run_state.steps += 1
            meets = not run_state.touching and state[1 + gap] < 0.0
            parts = run_state.touching == 1 and state[1 + gap] > 0.0
            taken = step
            np.positive(slopes[0], trial_slopes[0])
            if meets or parts:
                taken = moment_of(step, -1.0 if meets else 1.0, path)
            while run_state.next_frame < run_state.time + taken:
                take(kept, trial, trial_slopes, run_state.next_frame - run_state.time, path)
                np.positive(trial, frames[run_state.frames])
                run_state.frames += 1
                run_state.next_frame = run_state.frames * run_state.frame_interval
            run_state.time += taken
            if meets or parts:
                take(kept, state, trial_slopes, taken, path)
                if meets:
                    begin(run_state, arrays, parameters)
                else:
                    rates(state, slopes[0], parameters)
                    before = overlapping(kept, trial_slopes[0], gap)
                    track(arrays.tracked, before, overlapping(state, slopes[0], gap), taken)
                    given = chain_momentum(state, arrays.masses, gap) - run_state.momentum
                    end(run_state, arrays, given)
                rates(state, slopes[0], parameters)
            else:
                if run_state.touching:
                    before = overlapping(kept, slopes[0], gap)
                    track(arrays.tracked, before, overlapping(state, slopes[final], gap), taken)
                np.positive(slopes[final], slopes[0])
            low, high = extremes(state[1 : 1 + gap], gap)
            run_state.strain_min = min(run_state.strain_min, low)
            run_state.strain_max = max(run_state.strain_max, high)
            low, high = extremes(state[2 + gap : beads], beads - 2 - gap)
            run_state.strain_min = min(run_state.strain_min, low)
            run_state.strain_max = max(run_state.strain_max, high)
        return LATE

    return advance
