"""What a polynomial tells of a path: how often it may be zero, and when first."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

# Position, velocity and acceleration of particle 1.
PathPoint = tuple[float, float, float]
Quintic = tuple[float, float, float, float, float, float]

# Relative to the time sought: what rounding leaves.
RESOLUTION = 4e-16
# Newton-like steps double their digits, or halve the distance to a double zero: what takes longer
# is a motion that has exploded, whose bounds on the curvature are out of all proportion.
MOST_MOVES = 1000


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
