r"""
When particle 1 meets the wall within one step, to rounding.

The path of particle 1 over a step, x(s) for 0 <= s <= H, is that of the composed map itself,
:math:`x(s) = x_1(\Phi_s(z))`, so that a contact is located to rounding at any order. Only as many
particles as the map has stages can act on particle 1 within one step: the search moves those alone.

Where to look is told by the quintic that fits position, velocity and acceleration at both ends:
its Bernstein coefficients change sign at least as often as it has roots (Descartes' rule). None
means no contact, one exactly one; with more, the step is looked at in pieces. A departure from the
wall at s = 0 is a root of x(s) but not of x(s)/s, on which the search then works.
"""

from collections.abc import Callable

# Pieces of a step in which particle 1 may come and go.
PIECES = 8
# Newton's method needs about three evaluations; bisection to rounding would need 53.
MOST_ITERATIONS = 80
# Relative to the time sought: what rounding leaves.
RESOLUTION = 4e-16


def count_sign_changes(start, end, step):
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


def build_contact_search(probe: Callable, count_changes: Callable, register: Callable) -> Callable:
    """
    Return the search for the first contact within a step.

    Parameters
    ----------
    probe : callable
        ``probe(time, wall_distance, near, work, scheme, parameters)``: position, velocity and
        acceleration of particle 1 after one step of any size.
    count_changes : callable
        :func:`count_sign_changes`.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``find_contact(step, start, end, near, work, scheme, parameters)``: time of the first
        contact after the start, or -1 where there is none.
    """

    @register
    def refine(low, high, x0, near, work, scheme, parameters):
        # The position (over s after a departure) is positive at `low` and not at `high`.
        departing = x0 == 0.0
        time = 0.5 * (low + high)
        for _ in range(MOST_ITERATIONS):
            x, v, _ = probe(time, x0, near, work, scheme, parameters)
            if x == 0.0:
                return time
            if x > 0.0:
                low = time
            else:
                high = time
            slope = v - x / time if departing else v
            better = time - x / slope if slope < 0.0 else low
            if not low <= better <= high:
                better = 0.5 * (low + high)
            moved = abs(better - time)
            time = better
            if moved <= RESOLUTION * time:
                break
        return time

    @register
    def lowest(low, high, x0, near, work, scheme, parameters):
        # The moment of turning: the velocity is negative at `low` and positive at `high`.
        time = 0.5 * (low + high)
        for _ in range(MOST_ITERATIONS):
            x, v, a = probe(time, x0, near, work, scheme, parameters)
            if x < 0.0 or v == 0.0:
                break
            if v < 0.0:
                low = time
            else:
                high = time
            better = time - v / a if a > 0.0 else low
            if not low < better < high:
                better = 0.5 * (low + high)
            moved = abs(better - time)
            time = better
            if moved <= RESOLUTION * time:
                break
        return time, x

    @register
    def find_contact(step, start, end, near, work, scheme, parameters):
        x0 = start[0]
        changes = count_changes(start, end, step)
        if changes == 0:
            return -1.0
        if changes == 1:
            return refine(0.0, step, x0, near, work, scheme, parameters)
        low = 0.0
        before = start
        for piece in range(1, PIECES + 1):
            high = step * piece / PIECES
            after = end
            if piece < PIECES:
                after = probe(high, x0, near, work, scheme, parameters)
            if after[0] < 0.0:
                return refine(low, high, x0, near, work, scheme, parameters)
            if before[1] < 0.0 < after[1] and count_changes(before, after, high - low) > 0:
                turn, x = lowest(low, high, x0, near, work, scheme, parameters)
                if x < 0.0:
                    return refine(low, turn, x0, near, work, scheme, parameters)
            low = high
            before = after
        return -1.0

    return find_contact
