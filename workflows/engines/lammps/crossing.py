"""When particle 1 crosses the wall in a composed step, told by both ends of the step."""

import math
from itertools import pairwise

from chaincor.workflows.errors import LostAtomsError

# Newton's method on a quintic that is nearly straight; where the last correction is longer than
# this part of a step, it was not.
_NEWTON_STEPS, _CONVERGED = 4, 1e-4


def first_crossing(start: list[float], end: list[float], step: float) -> float | None:
    """
    Return when x(t) first reaches zero within a step, or None where it does not.

    x(t) is the quintic through position, velocity and acceleration at both ends. A start at the
    wall (x = 0, moving away) is no crossing.
    """
    b = _bernstein(start, end, step)
    if not math.isfinite(b[5]):
        raise LostAtomsError(
            f"particle 1 is at {b[5]}; expected a finite number: use a smaller timestep"
        )
    part = _first_part(b, _ALONE)
    if part is None:
        return None
    refined = _newton(_quintic(start, end, step), part)
    if refined is None or not part <= refined <= part + _ALONE:
        refined = _first_part(b, RESOLUTION)
    return None if refined is None else step * refined


def _bernstein(start: list[float], end: list[float], step: float) -> list[float]:
    """
    Return the Bernstein coefficients of the quintic through both ends of a step.

    The polynomial is between the least and the largest of them: where none is negative, it is not
    negative anywhere in the step.
    """
    (x0, v0, a0), (x1, v1, a1), h = start, end, 0.2 * step
    bend = 1.25 * h * h  # h^2/20 of the whole step
    return [
        x0,
        x0 + h * v0,
        x0 + 2.0 * h * v0 + bend * a0,
        x1 - 2.0 * h * v1 + bend * a1,
        x1 - h * v1,
        x1,
    ]


# Parts of a step: in which two zeros need not be told apart, and in which Newton's method finds
# one that is alone.
RESOLUTION, _ALONE = 1e-3, 0.125


def _first_part(bernstein: list[float], alone: float) -> float | None:
    """
    Return at which part of a step a polynomial first falls below zero, or None where it does not.

    Halves are looked at from left to right. One whose coefficients are not negative has no zero,
    one where they change sign once has one. The first zero is no further from what is returned
    than `alone`, and where another one follows no further than the resolution.
    """
    if min(bernstein) >= 0.0:
        return None
    if bernstein[0] == 0.0:  # divide the departure out
        bernstein = [bk / k for k, bk in enumerate(bernstein) if k > 0]
    intervals = [(bernstein, 0.0, 1.0)]
    while intervals:
        b, left, width = intervals.pop()
        if min(b) >= 0.0:
            continue
        negative = [bk < 0.0 for bk in b]
        if width < RESOLUTION or (width <= alone and negative == sorted(negative)):
            return left
        # De Casteljau's means: the first of each row belong to the left half, the last to the
        # right one.
        row, first, last = b, [b[0]], [b[-1]]
        while len(row) > 1:
            row = [0.5 * (low + high) for low, high in pairwise(row)]
            first.append(row[0])
            last.append(row[-1])
        width *= 0.5
        intervals += [(last[::-1], left + width, width), (first, left, width)]
    return None


def _newton(c: list[float], part: float) -> float | None:
    """Improve a zero of a falling polynomial; None where it does not fall, or bends too much."""
    correction = 0.0
    for _ in range(_NEWTON_STEPS):
        value = slope = 0.0
        for ck in reversed(c):
            slope = slope * part + value
            value = value * part + ck
        if slope >= 0.0:
            return None
        correction = value / slope
        part -= correction
    return part if abs(correction) < _CONVERGED else None


def _quintic(start: list[float], end: list[float], step: float) -> list[float]:
    """Return the coefficients, in t/step, of the quintic through both ends of a step."""
    (x0, v0, a0), (x1, v1, a1), h = start, end, step
    c = [x0, v0 * h, 0.5 * a0 * h * h]
    p = x1 - sum(c)
    q = v1 * h - c[1] - 2.0 * c[2]
    r = 0.5 * (a1 * h * h) - c[2]
    return [*c, 10.0 * p - 4.0 * q + r, -15.0 * p + 7.0 * q - 2.0 * r, 6.0 * p - 3.0 * q + r]


def foretold_crossing(start: list[float], end: list[float], step: float) -> float | None:
    """
    Return when particle 1 will reach the wall in the step after one just done, if it clearly will.

    The quintic of the step done is continued into the next one.
    """
    x1, v1, _ = end
    if v1 >= 0.0 or x1 + 2.0 * v1 * step > 0.0:
        return None
    c = _quintic(start, end, step)
    if sum(ck * 2.0**k for k, ck in enumerate(c)) > 0.02 * v1 * step:
        return None  # it may just not get there
    part = _newton(c, 1.0 - x1 / (v1 * step))
    return (part - 1.0) * step if part is not None and 1.0 < part <= 2.0 else None
