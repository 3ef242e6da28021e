r"""
Locate a contact within a step, to rounding, for both engines.

The path of particle 1 over a step, x(s) for 0 <= s <= H, comes from the composed map itself,
:math:`x(s) = x_1(\Phi_s(z))`. Here z is the state at the start of the step, and :math:`\Phi_s` the
map over a step s. A contact is therefore located to rounding for schemes of any order. Within one
step, no more particles can act on particle 1 than the map has stages. The search moves only these
particles.

The search starts from the quintic that fits position, velocity and acceleration at both ends. The
quintic has at most as many roots as its Bernstein coefficients have sign changes (Descartes' rule).
Without a sign change there is no contact; with one sign change there is exactly one contact. With
more sign changes, the step is halved until it has at most one. A particle that leaves the wall at s
= 0 adds no sign change, because its coefficient there is zero.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array

# A point of a path consists of the position, velocity and acceleration of particle 1.
PathPoint = tuple[float, float, float]
Quintic = tuple[float, float, float, float, float, float]

# Relative accuracy of the time of a contact. Rounding allows no better accuracy.
RESOLUTION = 4e-16
# `first_root` takes at most this many steps. Near a zero, each step doubles the number of correct
# digits; near a double zero, each step halves the distance to the zero. A search needs more steps
# only if the motion has exploded, because the bound on the curvature is then far too large.
MOST_MOVES = 1000
# The search divides a step into parts, but no part below this fraction of the step. Within so short
# a part, the velocity of particle 1 changes by 1e-6 of its change in the whole step.
NARROWEST = 2.0**-20
# The search refines the time of a contact at most this many times. Newton's method needs about
# three refinements; bisection to rounding would need 53.
MOST_ITERATIONS = 80
# Newton's method uses the velocity of particle 1 in place of the derivative of its position with
# respect to the step size. For Verlet steps, the velocity differs from this derivative by up to
# 1e-3. A Newton step then leaves an error of up to 1e-3 of its own size. The search therefore stops
# after a Newton step below this fraction of the time.
SETTLED = 1e-13


def count_sign_changes(start: PathPoint, end: PathPoint, step: float) -> int:
    """
    Return an upper bound on the number of contacts between two points.

    The bound is the number of sign changes among the Bernstein coefficients of the Hermite quintic.
    Coefficients of zero are skipped. A particle that leaves x = 0 therefore does not count as a
    contact.
    """
    x0, v0, a0 = start
    x1, v1, a1 = end
    coefficients = (
        x0,
        x0 + step * v0 / 5.0,
        x0 + step * (0.4 * v0 + step * a0 / 20.0),
        x1 - step * (0.4 * v1 - step * a1 / 20.0),
        x1 - step * v1 / 5.0,
        x1,
    )
    changes = 0
    last = 0.0
    for coefficient in coefficients:
        if coefficient * last < 0.0:
            changes += 1
        if coefficient != 0.0:
            last = coefficient
    return changes


def first_root(coefficients: Sequence[float] | Array, end: float) -> float:
    """
    Return the first zero of a polynomial that starts positive.

    The steps never pass a zero: from x > 0 with slope v and a bound B on the curvature, no zero is
    nearer than the positive root d of x + v d - B d^2/2. Near a zero, this root is Newton's step.
    The coefficients belong to rising powers. A constant term of zero means that the particle leaves
    the wall; it is divided out. Return -1 if there is no zero up to `end`. If `MOST_MOVES` steps do
    not reach the zero, return a time before it.
    """
    first = 1 if coefficients[0] == 0.0 else 0
    degree = len(coefficients) - 1 - first
    curvature = 0.0
    for m in range(degree, 1, -1):
        curvature = curvature * end + m * (m - 1) * abs(coefficients[first + m])
    time = 0.0
    for _ in range(MOST_MOVES):
        if not time <= end:
            return -1.0
        value = 0.0
        slope = 0.0
        for m in range(degree, -1, -1):
            slope = slope * time + value
            value = value * time + coefficients[first + m]
        if value <= 0.0:
            return time
        reach = np.sqrt(slope * slope + 2.0 * curvature * value)
        if slope < 0.0:
            move = 2.0 * value / (reach - slope)
        elif curvature > 0.0:
            move = (slope + reach) / curvature
        else:
            return -1.0
        if move <= RESOLUTION * time:
            return time
        time += move
    return time


def fit_path(start: PathPoint, end: PathPoint, step: float) -> Quintic:
    """Return the coefficients of the quintic between two points, for powers of time/step."""
    x0, v0, a0 = start
    x1, v1, a1 = end
    v0, v1 = v0 * step, v1 * step
    a0, a1 = 0.5 * a0 * step * step, 0.5 * a1 * step * step
    # Subtract the first three terms of the quintic from the position, velocity and acceleration at
    # the end of the step.
    x, v, a = x1 - x0 - v0 - a0, v1 - v0 - 2.0 * a0, a1 - a0
    # Scalars avoid an array, which would be allocated from the heap at every contact.
    a3, a4, a5 = 10.0 * x - 4.0 * v + a, -15.0 * x + 7.0 * v - 2.0 * a, 6.0 * x - 3.0 * v + a
    return x0, v0, a0, a3, a4, a5


def narrow(
    low: float, high: float, time: float, point: PathPoint
) -> tuple[float, float, float, bool]:
    """
    Refine the zero of a path between two times by one step.

    `point` is the point at `time`. Return narrower bounds, a better time between them, and whether
    this time is the zero up to rounding.
    """
    x, v, a = point
    if x == 0.0:
        return low, high, time, True
    if x > 0.0:
        low = time
    else:
        high = time
    better = time - x / v if v < 0.0 else -1.0
    if not low <= better <= high:
        better = 0.5 * (low + high)
    moved = abs(better - time)
    # The next Newton step would have two parts. One part is proportional to the acceleration and to
    # the square of this step; it must be below rounding. The other part comes from using the
    # velocity as the derivative; `SETTLED` limits it.
    near = moved * moved * abs(a) <= RESOLUTION * better * abs(v)
    return low, high, better, moved <= SETTLED * better and near


# Purposes for which the search requests a point of the path: to know the end of the step (LOOK), to
# divide the step (CUT), to refine the time of the contact (REFINE).
LOOK, CUT, REFINE = range(3)

# These fields of the run state hold the state of a search.
SEARCH_FIELDS = [
    ("search_stage", "i8"),  # purpose of the next point: LOOK, CUT or REFINE
    ("search_moves", "i8"),  # number of refinements so far
    ("search_step", "f8"),  # length of the step
    ("search_low", "f8"),  # times between which the current part of the step lies
    ("search_high", "f8"),
    # time of the next point; after the search, time of the contact, or -1 without a contact
    ("search_time", "f8"),
    ("search_start_x", "f8"),  # position, velocity and acceleration at the start of the part
    ("search_start_v", "f8"),
    ("search_start_a", "f8"),
    ("search_end_x", "f8"),  # position, velocity and acceleration at the end of the step
    ("search_end_v", "f8"),
    ("search_end_a", "f8"),
]


class SearchSteps(NamedTuple):
    """
    Functions for a contact search, which requests points of the trajectory one at a time.

    The run state holds the state of the search in the `SEARCH_FIELDS`.
    """

    #: ``is_free(start, end, step)`` returns whether the points at both ends of a step exclude a
    #: contact within the step.
    is_free: Callable
    #: ``begin(run_state, step, start)`` begins a search, whose first request is the end of the
    #: step.
    begin: Callable
    #: ``go_on(run_state, point)`` continues with the requested point and returns whether the search
    #: is over.
    go_on: Callable


def build_search_steps(register: Callable) -> SearchSteps:
    """Return the functions of a search, registered with a compiler by `register`."""
    count_changes = register(count_sign_changes)
    guess_path = register(fit_path)
    guess_root = register(first_root)
    narrow_down = register(narrow)

    @register
    def is_free(start: PathPoint, end: PathPoint, step: float) -> bool:
        return count_changes(start, end, step) == 0 and not (end[0] <= 0.0 and end[1] < 0.0)

    @register
    def begin(run_state: Any, step: float, start: PathPoint) -> None:
        run_state.search_stage, run_state.search_moves = LOOK, 0
        run_state.search_low, run_state.search_step = 0.0, step
        run_state.search_high = run_state.search_time = step
        run_state.search_start_x, run_state.search_start_v, run_state.search_start_a = start

    @register
    def shorten_substep(run_state: Any, point: PathPoint) -> bool:
        # `point` is the point at the end of the current part.
        step, low, high, after = (
            run_state.search_step,
            run_state.search_low,
            run_state.search_high,
            point,
        )
        before = (run_state.search_start_x, run_state.search_start_v, run_state.search_start_a)
        end = (run_state.search_end_x, run_state.search_end_v, run_state.search_end_a)
        while True:
            width = high - low
            changes = count_changes(before, after, width)
            if changes > 1 and width > NARROWEST * step:
                width *= 0.5
            elif changes == 1 or (after[0] <= 0.0 and after[1] < 0.0):
                # The position is positive at `low` (or zero, if the particle leaves the wall there)
                # and not positive at `high`.
                guess = low + width * guess_root(guess_path(before, after, width), 1.0)
                run_state.search_low, run_state.search_high, run_state.search_stage = (
                    low,
                    high,
                    REFINE,
                )
                run_state.search_time = guess if low < guess < high else 0.5 * (low + high)
                return False
            else:
                low, width, before = high, 2.0 * width, after
                if not low < step:
                    run_state.search_time = -1.0
                    return True
            high = low + width
            if high < step:
                run_state.search_low, run_state.search_high, run_state.search_time = low, high, high
                run_state.search_start_x, run_state.search_start_v, run_state.search_start_a = (
                    before
                )
                return False
            high, after = step, end

    @register
    def refine(run_state: Any, point: PathPoint) -> bool:
        low, high, time, settled = narrow_down(
            run_state.search_low, run_state.search_high, run_state.search_time, point
        )
        run_state.search_low, run_state.search_high, run_state.search_time = low, high, time
        run_state.search_moves += 1
        return settled or run_state.search_moves == MOST_ITERATIONS

    @register
    def go_on(run_state: Any, point: PathPoint) -> bool:
        if run_state.search_stage == REFINE:
            return refine(run_state, point)
        if run_state.search_stage == LOOK:
            run_state.search_stage = CUT
            run_state.search_end_x, run_state.search_end_v, run_state.search_end_a = point
        return shorten_substep(run_state, point)

    return SearchSteps(is_free, begin, go_on)


def build_contact_search(state_after: Callable, register: Callable) -> Callable:
    """
    Return the search for the first contact within a step.

    ``find_contact(step, start, end, run_state, path)`` returns the time of the first contact after
    the start, or -1 if there is none. The run state is a record with `SEARCH_FIELDS`.
    ``state_after(time, path)`` returns the point after one step of any size; `path` is passed on to
    it unchanged.
    """
    is_free, begin, go_on = build_search_steps(register)

    @register
    def find_contact(
        step: float, start: PathPoint, end: PathPoint, run_state: Any, path: Any
    ) -> float:
        if is_free(start, end, step):
            return -1.0
        begin(run_state, step, start)
        point = end
        while not go_on(run_state, point):
            point = state_after(run_state.search_time, path)
        return run_state.search_time

    return find_contact
