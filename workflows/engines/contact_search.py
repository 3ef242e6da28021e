r"""
Contact search of both engines: when the gap closes within one step, to rounding.

The path of particle 1 over a step, x(s) for 0 <= s <= H, is that of the composed map itself,
:math:`x(s) = x_1(\Phi_s(z))`, so that a contact is located to rounding at any order. Only as many
particles as the map has stages can act on particle 1 within one step: the search moves those alone.

Where to look is told by the quintic that fits position, velocity and acceleration at both ends:
its Bernstein coefficients change sign at least as often as it has roots (Descartes' rule). None
means no contact, one exactly one; with more, the step is halved until it is one of these. A
departure from the wall at s = 0 is not counted, for zeros have no sign.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array

# Position, velocity and acceleration of particle 1.
PathPoint = tuple[float, float, float]
Quintic = tuple[float, float, float, float, float, float]

# Relative to the time sought: what rounding leaves.
RESOLUTION = 4e-16
# Newton-like steps double their digits, or halve the distance to a double zero: what takes longer
# is a motion that has exploded, whose bounds on the curvature are out of all proportion.
MOST_MOVES = 1000
# Parts of a step that are not cut further. A visit to the wall as short as this changes the
# velocity of particle 1 by a part in 1e6 of what its acceleration does in a step.
NARROWEST = 2.0**-20
# Newton's method needs about three evaluations; bisection to rounding would need 53.
MOST_ITERATIONS = 80
# Slope of the map and velocity differ by a part in 1e3 (Verlet) or less: so small a move of
# Newton's method is its last.
SETTLED = 1e-13


def count_sign_changes(start: PathPoint, end: PathPoint, step: float) -> int:
    """
    Bound the number of contacts between two points.

    These are the sign changes among the Bernstein coefficients of the Hermite quintic; zeros do not
    count, so that neither does a departure from x = 0.
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
    Return the first zero of a polynomial that starts positive, by steps that cannot pass it.

    From x > 0 with slope v and a bound B on the curvature, no zero is nearer than the positive
    root of x + v d - B d^2/2; near a zero that is Newton's step. Coefficients are of rising powers;
    a zero constant term is a departure, and divided out. -1 where there is no zero up to `end`;
    where `MOST_MOVES` do not reach it, a time before it.
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
    """Return the quintic between two points, in powers of the time over the step between them."""
    x0, v0, a0 = start
    x1, v1, a1 = end
    v0, v1 = v0 * step, v1 * step
    a0, a1 = 0.5 * a0 * step * step, 0.5 * a1 * step * step
    # What is left to position, velocity and acceleration by the first three terms.
    x, v, a = x1 - x0 - v0 - a0, v1 - v0 - 2.0 * a0, a1 - a0
    # No array, which would be taken from the heap at every contact.
    a3, a4, a5 = 10.0 * x - 4.0 * v + a, -15.0 * x + 7.0 * v - 2.0 * a, 6.0 * x - 3.0 * v + a
    return x0, v0, a0, a3, a4, a5


def narrow(
    low: float, high: float, time: float, point: PathPoint
) -> tuple[float, float, float, bool]:
    """
    Take one step towards the zero of a path between two times, one of which has the point.

    Returns narrower bounds, a better time within them, and whether that is the zero to the last
    digits.
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
    # Newton's next move would be the curvature's share of this one squared, and what the slope of
    # the map and the velocity differ by.
    near = moved * moved * abs(a) <= RESOLUTION * better * abs(v)
    return low, high, better, moved <= SETTLED * better and near


# What the next point of a path is for: the end of the step, a part of the step, the zero.
LOOK, CUT, REFINE = range(3)

# Where a search stands: fields of the ledger of a run.
SEARCH_FIELDS = [
    ("search_stage", "i8"),  # what the next point is for
    ("search_moves", "i8"),  # how often the zero was refined
    ("search_step", "f8"),  # in which it is searched
    ("search_low", "f8"),  # the part of that which is looked at
    ("search_high", "f8"),
    ("search_time", "f8"),  # when the next point is; in the end that of the contact, or -1
    ("search_start_x", "f8"),  # position, velocity and acceleration where that part begins
    ("search_start_v", "f8"),
    ("search_start_a", "f8"),
    ("search_end_x", "f8"),  # the same at the end of the step
    ("search_end_v", "f8"),
    ("search_end_a", "f8"),
]


class SearchSteps(NamedTuple):
    """
    The parts of a search, which asks for one point of a path after the other.

    The ledger says where it stands, see `SEARCH_FIELDS`.
    """

    #: ``is_free(start, end, step)``: whether there is no contact, as the ends of a step tell.
    is_free: Callable
    begin: Callable  #: ``begin(ledger, step, start)``: a search within a step, by its end.
    #: ``go_on(ledger, point)``: with the point that was asked for; returns whether it is over.
    go_on: Callable


def build_search_steps(register: Callable) -> SearchSteps:
    """Return the parts of a search; `register` makes functions known to a compiler."""
    count_changes = register(count_sign_changes)
    guess_path = register(fit_path)
    guess_root = register(first_root)
    narrow_down = register(narrow)

    @register
    def is_free(start: PathPoint, end: PathPoint, step: float) -> bool:
        return count_changes(start, end, step) == 0 and not (end[0] <= 0.0 and end[1] < 0.0)

    @register
    def begin(ledger: Any, step: float, start: PathPoint) -> None:
        ledger.search_stage, ledger.search_moves = LOOK, 0
        ledger.search_low, ledger.search_step = 0.0, step
        ledger.search_high = ledger.search_time = step
        ledger.search_start_x, ledger.search_start_v, ledger.search_start_a = start

    @register
    def shorten_substep(ledger: Any, point: PathPoint) -> bool:
        # From where it has the point at the end of a part.
        step, low, high, after = ledger.search_step, ledger.search_low, ledger.search_high, point
        before = (ledger.search_start_x, ledger.search_start_v, ledger.search_start_a)
        end = (ledger.search_end_x, ledger.search_end_v, ledger.search_end_a)
        while True:
            width = high - low
            changes = count_changes(before, after, width)
            if changes > 1 and width > NARROWEST * step:
                width *= 0.5
            elif changes == 1 or (after[0] <= 0.0 and after[1] < 0.0):
                # The position is positive at `low`, a departure apart, and not at `high`.
                guess = low + width * guess_root(guess_path(before, after, width), 1.0)
                ledger.search_low, ledger.search_high, ledger.search_stage = low, high, REFINE
                ledger.search_time = guess if low < guess < high else 0.5 * (low + high)
                return False
            else:
                low, width, before = high, 2.0 * width, after
                if not low < step:
                    ledger.search_time = -1.0
                    return True
            high = low + width
            if high < step:
                ledger.search_low, ledger.search_high, ledger.search_time = low, high, high
                ledger.search_start_x, ledger.search_start_v, ledger.search_start_a = before
                return False
            high, after = step, end

    @register
    def refine(ledger: Any, point: PathPoint) -> bool:
        low, high, time, settled = narrow_down(
            ledger.search_low, ledger.search_high, ledger.search_time, point
        )
        ledger.search_low, ledger.search_high, ledger.search_time = low, high, time
        ledger.search_moves += 1
        return settled or ledger.search_moves == MOST_ITERATIONS

    @register
    def go_on(ledger: Any, point: PathPoint) -> bool:
        if ledger.search_stage == REFINE:
            return refine(ledger, point)
        if ledger.search_stage == LOOK:
            ledger.search_stage = CUT
            ledger.search_end_x, ledger.search_end_v, ledger.search_end_a = point
        return shorten_substep(ledger, point)

    return SearchSteps(is_free, begin, go_on)


def build_contact_search(state_after: Callable, register: Callable) -> Callable:
    """
    Return the search for the first contact within a step.

    ``find_contact(step, start, end, ledger, path)`` is the time of the first contact after the
    start, or -1 where there is none, the ledger a record with `SEARCH_FIELDS`. For the point after
    one step of any size it asks ``probe(time, path)``; the path is whatever that needs.
    """
    is_free, begin, go_on = build_search_steps(register)

    @register
    def find_contact(
        step: float, start: PathPoint, end: PathPoint, ledger: Any, path: Any
    ) -> float:
        if is_free(start, end, step):
            return -1.0
        begin(ledger, step, start)
        point = end
        while not go_on(ledger, point):
            point = state_after(ledger.search_time, path)
        return ledger.search_time

    return find_contact
