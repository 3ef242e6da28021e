r"""
When particle 1 meets the wall within one step, to rounding.

The path of particle 1 over a step, x(s) for 0 <= s <= H, is that of the composed map itself,
:math:`x(s) = x_1(\Phi_s(z))`, so that a contact is located to rounding at any order. Only as many
particles as the map has stages can act on particle 1 within one step: the search moves those alone.

Where to look is told by the quintic that fits position, velocity and acceleration at both ends:
its Bernstein coefficients change sign at least as often as it has roots (Descartes' rule). None
means no contact, one exactly one; with more, the step is halved until it is one of these. A
departure from the wall at s = 0 is not counted, for zeros have no sign.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from chaincor.workflows.engines.in_house.polynomials import (
    RESOLUTION,
    PathPoint,
    count_sign_changes,
    first_root,
    fit_path,
)

# Parts of a step that are not cut further. A visit to the wall as short as this changes the
# velocity of particle 1 by a part in 1e6 of what its acceleration does in a step.
NARROWEST = 2.0**-20
# Newton's method needs about three evaluations; bisection to rounding would need 53.
MOST_ITERATIONS = 80
# Slope of the map and velocity differ by a part in 1e3 (Verlet) or less: so small a move of
# Newton's method is its last.
SETTLED = 1e-13


def narrow(
    low: float, high: float, time: float, point: PathPoint
) -> tuple[float, float, float, bool]:
    """
    Take one step towards the zero of a path.

    Parameters
    ----------
    low, high : float
        Times between which the zero is.
    time : float
        One of these.
    point : tuple of float
        Position, velocity and acceleration then.

    Returns
    -------
    low, high, time : float
        The narrower bounds, and a better time within them.
    settled : bool
        Whether it is the zero to the last digits.
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
    def cut(ledger: Any, point: PathPoint) -> bool:
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
        return cut(ledger, point)

    return SearchSteps(is_free, begin, go_on)


def build_contact_search(probe: Callable, register: Callable) -> Callable:
    """
    Return the search for the first contact within a step.

    Parameters
    ----------
    probe : callable
        ``probe(time, path)``: position, velocity and acceleration of particle 1 after one step
        of any size; `path` is whatever it needs for that.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``find_contact(step, start, end, ledger, path)``: time of the first contact after the start,
        or -1 where there is none. `start` and `end` are position, velocity and acceleration,
        `ledger` a record with `SEARCH_FIELDS`.
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
            point = probe(ledger.search_time, path)
        return ledger.search_time

    return find_contact
