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

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Position, velocity and acceleration of particle 1.
PathPoint = tuple[float, float, float]
Quintic = tuple[float, float, float, float, float, float]

# Parts of a step that are not cut further. A visit to the wall as short as this changes the
# velocity of particle 1 by a part in 1e6 of what its acceleration does in a step.
NARROWEST = 2.0**-20
# Newton's method needs about three evaluations; bisection to rounding would need 53.
MOST_ITERATIONS = 80
# Relative to the time sought: what rounding leaves.
RESOLUTION = 4e-16
# Newton-like steps double their digits, or halve the distance to a double zero: what takes longer
# is a motion that has exploded, whose bounds on the curvature are out of all proportion.
MOST_MOVES = 1000
# Slope of the map and velocity differ by a part in 1e3 (Verlet) or less: so small a move of
# Newton's method is its last.
SETTLED = 1e-13


def count_sign_changes(start: PathPoint, end: PathPoint, step: float) -> int:
    """
    Bound the number of contacts between two moments.

    Parameters
    ----------
    start, end : tuple of float
        Position, velocity and acceleration of particle 1.
    step : float
        Time between them.

    Returns
    -------
    int
        Sign changes among the Bernstein coefficients of the Hermite quintic; zeros do not count,
        so that neither does a departure from x = 0.
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


def first_root(coefficients: Sequence[float] | NDArray[np.float64], end: float) -> float:
    """
    Return the first zero of a polynomial that starts positive, by steps that cannot pass it.

    From x > 0 with slope v and a bound B on the curvature, no zero is nearer than the positive
    root of x + v d - B d^2/2; near a zero that is Newton's step.

    Parameters
    ----------
    coefficients : tuple of float or ndarray
        Of rising powers. A zero constant term is a departure, and divided out.
    end : float
        Where the search ends.

    Returns
    -------
    float
        The zero, or -1 where there is none up to `end`; where `MOST_MOVES` do not reach it, a
        time before it.
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
    """
    Fit a quintic to the path of particle 1 between two moments.

    Parameters
    ----------
    start, end : tuple of float
        Position, velocity and acceleration.
    step : float
        Time between them.

    Returns
    -------
    tuple of float
        Six coefficients, of rising powers of the time since the start over the step.
    """
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


def build_contact_search(probe: Callable, register: Callable) -> Callable:
    """
    Return the search for the first contact within a step.

    Parameters
    ----------
    probe : callable
        ``probe(time, search)``: position, velocity and acceleration of particle 1 after one step
        of any size; `search` is whatever it needs for that.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``find_contact(step, start, end, search)``: time of the first contact after the start, or
        -1 where there is none. `start` and `end` are position, velocity and acceleration.
    """
    count_changes = register(count_sign_changes)
    guess_path = register(fit_path)
    guess_root = register(first_root)
    narrow_down = register(narrow)

    @register
    def refine(low: float, high: float, guess: float, search: Any) -> float:
        # The position is positive at `low`, a departure apart, and not at `high`.
        time = guess if low < guess < high else 0.5 * (low + high)
        for _ in range(MOST_ITERATIONS):
            low, high, time, settled = narrow_down(low, high, time, probe(time, search))
            if settled:
                break
        return time

    @register
    def find_contact(step: float, start: PathPoint, end: PathPoint, search: Any) -> float:
        low, width, before = 0.0, step, start
        while low < step:
            high = low + width
            after = end
            if high < step:
                after = probe(high, search)
            else:
                high = step
            width = high - low
            changes = count_changes(before, after, width)
            if changes > 1 and width > NARROWEST * step:
                width *= 0.5
                continue
            if changes == 1 or (after[0] <= 0.0 and after[1] < 0.0):
                guess = low + width * guess_root(guess_path(before, after, width), 1.0)
                return refine(low, high, guess, search)
            low, width, before = high, 2.0 * width, after
        return -1.0

    return find_contact
