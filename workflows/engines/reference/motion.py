"""
Build the loops over steps: exact steps, coarse steps, and coarse steps of many chains.

Exact steps end at contact events. `kernels.py` compiles the loops. The records of a loop's arrays
are also defined here.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.bookkeeping import (
    ARGUE,
    CROWDED,
    DONE,
    FULL,
    OUTSIDE,
    SPARE_CONTACTS,
)
from chaincor.workflows.engines.reference.events import SubstepPath, build_event
from chaincor.workflows.engines.reference.line_traits import KernelSpec, read_parameters
from chaincor.workflows.engines.reference.stages import Parameters, State, VerletKernels
from chaincor.workflows.engines.reference.tracked import Overlapping, build_track
from chaincor.workflows.engines.schemes import StepCoefficients

# A log has room for this many substeps of the next step; the second number applies to soft
# contacts, which need many graded substeps.
SPARE_SUBSTEPS, SPARE_GRADED_SUBSTEPS = 8, 256

# The front separates the bonds in motion from the bonds that still rest. In a cold chain, a
# disturbance cannot reach a bond that is this many bonds ahead of the front within one step. Along
# k bonds it decreases by a factor of about H^(2k)/(2k)!, which is 4e-36 at H = 1. Moving only the
# bonds behind the front therefore changes no digit.
FRONT_MARGIN = 16
# A bond is ahead of the front if its strain is below this factor times the impact velocity. The sum
# of all strains neglected in a run is orders of magnitude below the rounding error.
FRONT_THRESHOLD = 1e-24
# The front advances by a full vector of bonds at a time, because a vectorised loop handles the
# remaining bonds one by one.
FRONT_BLOCK = 8


class LineArrays(NamedTuple):
    """Arrays that the loops change in place."""

    now: State  #: Current state; the run state holds the position of the first particle.
    last: State  #: State right after the last contact.
    #: Scratch: state before a step.
    kept: State
    near: State  #: Scratch: state of the particles near the contact during a search.
    trial: State  #: Scratch: state within a step.
    #: Times, closing speeds and impulses of the contacts; of shape (3, capacity).
    contacts: Array
    #: Masses of the chain's particles, 0 for particles of a target; of shape (N,).
    masses: Array
    tracked: Array  #: Values of `tracked.TRACKED`.
    #: First index and index past the end of the particles near the contact; of shape (2,).
    window: NDArray[np.int64]
    #: Duration of each substep, and whether an event ends it; of shape (2, capacity). If the
    #: capacity is 0, which is usual, no log is recorded.
    log: Array


def build_motion(source: KernelSpec, stages: VerletKernels, build_step: Callable) -> Callable:
    """
    Return the loop of the stepping engine; `build_step` is defined by a scheme, see ``schemes``.

    ``advance(run_state, arrays, target_steps, step, rule)`` takes steps until `target_steps` steps
    are done or the caller must act, and returns the reason. If there is a log, it also returns
    `DONE` as soon as the log may have no room for the substeps of another step.
    """
    register, wall = source.register, source.kind.at_wall
    slice_parameters = read_parameters(source).slice_parameters
    copy, are_allowed = stages.copy, stages.are_allowed
    take_step = register(build_step(stages))
    event = build_event(source, stages, take_step)
    direction, condition, reach, state_after, find, shorten_substep, apply_event = event
    track = build_track(register)
    is_likely, may_be_over = register(bookkeeping.is_likely), register(bookkeeping.may_be_over)

    @register
    def reached_by_front(strain: Any, bonds: int, threshold: float) -> int:
        while bonds < strain.shape[0] and abs(strain[bonds - FRONT_MARGIN]) > threshold:
            bonds = min(strain.shape[0], bonds + FRONT_BLOCK)
        return bonds

    def advance(
        run_state: Any, arrays: LineArrays, target_steps: int, step: float, rule: StepCoefficients
    ) -> int:
        now, last, kept, near, trial, contacts, masses, tracked, window, log = arrays
        begin, end = window[0], window[1]
        parameters = rule.parameters
        near_rule = StepCoefficients(rule.fractions, slice_parameters(parameters, begin, end))
        kept_near = State(kept.strain[begin : end - 1], kept.velocity[begin:end])
        threshold = FRONT_THRESHOLD * run_state.impact_velocity
        spare = SPARE_SUBSTEPS
        if run_state.soft and run_state.shortest_share < 1.0:
            spare = SPARE_GRADED_SUBSTEPS
        while run_state.steps < target_steps:
            if contacts.shape[1] - run_state.contacts < SPARE_CONTACTS:
                return FULL
            if 0 < log.shape[1] < run_state.substeps + spare:
                return DONE
            # Contacts divide a step into substeps but do not shift the times of later steps. The
            # motion therefore stays reversible in time.
            since = run_state.steps * step
            bonds = run_state.active
            near_bonds = wanted = end - begin - 1
            if wall:
                near_bonds, wanted = min(bonds, near_bonds), 1
            left = step
            while left > 0.0:
                if (
                    run_state.contacts == contacts.shape[1]
                    or 0 < log.shape[1] == run_state.substeps
                ):
                    return CROWDED
                ahead, far = reach(run_state, contacts, since + (step - left), left, step)
                begun, sign = run_state.position, direction(run_state)
                copy(now.strain, now.velocity, kept, bonds)
                start = condition(begun, now, sign, parameters)
                path = SubstepPath(
                    begun, sign, near_bonds, wanted, kept_near, near, trial, near_rule
                )
                # If a contact is likely, the few particles that act on the gap are moved first.
                # This costs less than moving all particles and undoing the step.
                likely = is_likely(run_state, start, far)
                if likely:
                    reached = state_after(far, path)
                else:
                    run_state.position = take_step(
                        begun, kept, now, trial, bonds, bonds, ahead, rule
                    )
                    run_state.evaluations += run_state.step_evaluations
                    reached = condition(run_state.position, now, sign, parameters)
                    far = ahead
                time = find(far, start, reached, run_state, path)
                moved, meets = shorten_substep(run_state, time, ahead, step)
                if likely or moved != ahead or meets:
                    run_state.position = take_step(
                        begun, kept, now, trial, bonds, bonds, moved, rule
                    )
                    run_state.evaluations += run_state.step_evaluations
                if not wall and run_state.touching:
                    # While the bodies overlap, the condition is minus the gap and its derivatives.
                    ended = condition(run_state.position, now, -sign, parameters)
                    before = Overlapping(-start[0], -start[1], -start[2])
                    track(tracked, before, Overlapping(ended[0], ended[1], ended[2]), moved)
                left -= moved
                if log.shape[1] > 0:
                    log[0, run_state.substeps], log[1, run_state.substeps] = moved, meets
                    run_state.substeps += 1
                if meets:
                    met = now, last, contacts, masses
                    apply_event(run_state, met, since + (step - left), bonds, parameters)
            run_state.steps += 1
            if not are_allowed(run_state, now.strain, bonds, parameters):
                return OUTSIDE
            run_state.active = reached_by_front(now.strain, bonds, threshold)
            if may_be_over(run_state, step):
                return ARGUE
        return DONE

    return advance


def build_coarse_steps(source: KernelSpec, stages: VerletKernels) -> Callable:
    """
    Return the loop over coarse steps of bodies that stay apart, for look-ahead runs.

    ``take_coarse_steps(run_state, state, asked, parameters)`` takes Verlet steps and returns how
    many it took. `asked` contains the number of steps, their length, the least allowed gap, and two
    flags that mark the first and the last part of a flight. The loop takes fewer steps if the gap
    gets too small or a strain is not allowed. After such a return, and between the parts of a
    flight, positions and velocities are half a step apart.
    """
    stage, drift, are_allowed = stages.stage, stages.drift, stages.are_allowed
    wall = source.kind.at_wall

    def take_coarse_steps(
        run_state: Any, state: State, asked: tuple, parameters: Parameters
    ) -> int:
        strain, velocity = state
        steps, step, clearance, first, last = asked
        bonds = strain.shape[0]
        ahead = 0.5 * step if first else step  # the drifts of neighbouring steps merge
        for taken in range(steps):
            run_state.position += ahead * velocity[0]
            stage(strain, velocity, bonds, ahead, step, parameters)
            ahead = step
            run_state.evaluations += 1
            gap = run_state.position
            if not wall:
                gap = strain[parameters.gap]
            if not gap > clearance:
                return taken
            if not are_allowed(run_state, strain, bonds, parameters):
                return taken
        if last:
            run_state.position += 0.5 * step * velocity[0]
            drift(strain, velocity, bonds, 0.5 * step)
        return steps

    return take_coarse_steps


def build_look_ahead(source: KernelSpec, stages: VerletKernels) -> Callable:
    """
    Return a loop that moves many chains at a hard wall by coarse steps.

    ``look_ahead(run_states, strains, velocities, counts, steps, clearances, done, parameters)``
    moves each chain, stored as a row of the arrays, by `counts` steps while its distance from the
    wall exceeds the clearance. The loop writes the number of steps taken to `done`.
    """
    take_coarse_steps = source.register(build_coarse_steps(source, stages))

    def look_ahead(
        run_states: Any,
        strains: Array,
        velocities: Array,
        counts: NDArray[np.int64],
        steps: Array,
        clearances: Array,
        done: NDArray[np.int64],
        parameters: Any,
    ) -> None:
        for k in range(counts.shape[0]):
            asked = (counts[k], steps[k], clearances[k], True, True)
            state = State(strains[k], velocities[k])
            done[k] = take_coarse_steps(run_states[k], state, asked, parameters)

    return look_ahead
