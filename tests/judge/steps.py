r"""
Integrate by Taylor series of high order, for the judge, and find every hit of the wall.

The state is the distance x of particle 1 from the wall, the strains s and the velocities v. With
the tensions T = U'(s), :math:`s_i' = v_{i+1} - v_i` and :math:`v_i' = T_i - T_{i-1}` give the
coefficients of the series one after another, with a recurrence for the tensions of each law. Time
is in units of the previous step, so that no coefficient overflows. On each step, x is a polynomial,
which lies between its Bernstein coefficients. The step is halved until each part has no root or one
root.
"""

import math

import numpy as np
from numba import njit

HARMONIC, LJ, TODA, LOG, POWER = range(5)
DONE, MORE, RESTING, BROKEN = range(4)

# Below this bond length, lj and log bonds use their length as the state instead of their strain.
_SHORT = 0.5
# A free flight has no natural step, so this step is in units of 1/sqrt(stiffness).
_LONGEST_STEP = 50.0
_GROWTH = 6.0
_HALVINGS = 45


@njit(error_model="numpy", cache=True)
def _tensions(law, parameter, power, k, length, strain, work, tension):
    """Compute coefficient k of U'(s) from coefficients 0 to k of s."""
    bonds = length.size
    if law == HARMONIC:
        for i in range(bonds):
            tension[i] = strain[k, i]
    elif law == POWER:
        for i in range(bonds):
            work[1, k, i] = strain[k, i]
        for layer in range(2, power):
            here, before = work[layer], work[layer - 1]
            for i in range(bonds):
                here[k, i] = 0.0
            for j in range(k + 1):
                for i in range(bonds):
                    here[k, i] += strain[j, i] * before[k - j, i]
        for i in range(bonds):
            tension[i] = strain[k, i] + parameter * power * work[power - 1, k, i]
    elif law == TODA:
        decay = work[0]
        if k == 0:
            for i in range(bonds):
                decay[0, i] = math.exp(-parameter * strain[0, i])
                tension[i] = -math.expm1(-parameter * strain[0, i]) / parameter
        else:
            for i in range(bonds):
                decay[k, i] = 0.0
            for j in range(1, k + 1):
                share = -parameter * j / k
                for i in range(bonds):
                    decay[k, i] += share * strain[j, i] * decay[k - j, i]
            for i in range(bonds):
                tension[i] = -decay[k, i] / parameter
    elif law == LOG:
        inverse = work[0]
        if k == 0:
            for i in range(bonds):
                inverse[0, i] = 1.0 / length[i]
                tension[i] = strain[0, i] * inverse[0, i]
        else:
            for i in range(bonds):
                inverse[k, i] = 0.0
            for j in range(1, k + 1):
                for i in range(bonds):
                    inverse[k, i] -= strain[j, i] * inverse[k - j, i]
            for i in range(bonds):
                inverse[k, i] *= inverse[0, i]
                tension[i] = -inverse[k, i]
    else:
        seventh, thirteenth = work[0], work[1]
        if k == 0:
            for i in range(bonds):
                s, r = strain[0, i], length[i]
                logarithm = math.log(r) if r < _SHORT else math.log1p(s)
                seventh[0, i] = math.exp(-7.0 * logarithm)
                thirteenth[0, i] = math.exp(-13.0 * logarithm)
                tension[i] = -seventh[0, i] * math.expm1(-6.0 * logarithm) / 6.0
        else:
            for i in range(bonds):
                seventh[k, i] = 0.0
                thirteenth[k, i] = 0.0
            for j in range(1, k + 1):
                # r f' = a f r' for f = r^a, coefficient by coefficient.
                one = -(7.0 * j + (k - j)) / k
                two = -(13.0 * j + (k - j)) / k
                for i in range(bonds):
                    seventh[k, i] += one * strain[j, i] * seventh[k - j, i]
                for i in range(bonds):
                    thirteenth[k, i] += two * strain[j, i] * thirteenth[k - j, i]
            for i in range(bonds):
                seventh[k, i] /= length[i]
                thirteenth[k, i] /= length[i]
                tension[i] = (seventh[k, i] - thirteenth[k, i]) / 6.0


@njit(error_model="numpy", cache=True)
def _series(law, parameter, power, order, unit, length, strain, velocity, work, tension):
    """Compute coefficients 1 to `order` of strains and velocities in powers of time/unit."""
    particles = velocity.shape[1]
    bonds = particles - 1
    for k in range(order):
        _tensions(law, parameter, power, k, length, strain, work, tension)
        step = unit / (k + 1)
        for i in range(bonds):
            strain[k + 1, i] = step * (velocity[k, i + 1] - velocity[k, i])
        for i in range(1, bonds):
            velocity[k + 1, i] = step * (tension[i] - tension[i - 1])
        velocity[k + 1, 0] = step * tension[0] if bonds else 0.0
        if bonds:
            velocity[k + 1, bonds] = -step * tension[bonds - 1]


@njit(error_model="numpy", cache=True)
def _step(order, tolerance, speed, singular, length, strain, velocity):
    """Return the step, in units of the series, for which the last two terms are negligible."""
    shortest = np.inf
    for k in (order - 1, order):
        largest = 0.0
        for i in range(velocity.shape[1]):
            size = abs(velocity[k, i])
            if not size <= 1e300:
                return np.nan
            largest = max(largest, size / speed)
        if singular:
            for i in range(length.size):
                largest = max(largest, abs(strain[k, i]) / min(1.0, length[i]))
        if largest > 0.0:
            shortest = min(shortest, (tolerance / largest) ** (1.0 / k))
    return shortest


@njit(error_model="numpy", cache=True)
def _value(a, degree, u):
    value = a[degree]
    for k in range(degree - 1, -1, -1):
        value = value * u + a[k]
    return value


@njit(error_model="numpy", cache=True)
def _bisect(a, degree, low, high):
    """Return the root between a positive and a negative value."""
    for _ in range(100):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        if _value(a, degree, middle) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@njit(error_model="numpy", cache=True)
def first_root(a, degree, basis, stack, ends):
    """
    Return the first root in (0, 1] of a polynomial that is positive at 0, or 2 for none.

    A polynomial lies between its smallest and largest Bernstein coefficients, and has at most as
    many roots as the coefficients have changes of sign. A part of the step is dropped only if it
    can have no root, bisected only if it has one root, and otherwise halved. In a part of length
    2^-45 with the same sign at both ends, rounding does not distinguish a touch from a miss. Such a
    touch changes no velocity and is not counted.
    """
    for j in range(degree + 1):
        total = 0.0
        for k in range(j + 1):
            total += basis[j, k] * a[k]
        stack[0, j] = total
    ends[0, 0], ends[0, 1] = 0.0, 1.0
    top = 0
    while top >= 0:
        here = stack[top]
        low, high = ends[top, 0], ends[top, 1]
        changes = 0
        negative = here[0] <= 0.0
        any_negative = negative
        for j in range(1, degree + 1):
            now = here[j] <= 0.0
            if now != negative:
                changes += 1
            negative = now
            any_negative = any_negative or now
        if not any_negative:
            top -= 1
        elif changes == 1 and here[0] > 0.0:
            return _bisect(a, degree, low, high)
        elif high - low < 2.0**-_HALVINGS:
            if here[degree] <= 0.0:
                return high
            top -= 1
        else:
            left, middle = stack[top + 1], 0.5 * (low + high)
            # By de Casteljau's algorithm, `here` becomes the right half, and the next entry on the
            # stack the left half.
            for j in range(degree + 1):
                left[j] = here[0]
                for k in range(degree - j):
                    here[k] = 0.5 * (here[k] + here[k + 1])
            ends[top, 0] = middle
            ends[top + 1, 0], ends[top + 1, 1] = low, middle
            top += 1
    return 2.0


@njit(error_model="numpy", cache=True)
def advance(
    law, parameter, power, order, tolerance, speed, state, length, s, v, basis, horizon, hits, limit
):
    """
    Integrate until the horizon, a full list of hits or `limit` steps.

    `state` contains x, t, the unit of time, the time of the last hit and the number of steps.
    `horizon` contains the multiple of the last hit's time and the least time. Times and speeds of
    hits are written to `hits`. Returns the reason for the end and the number of new hits.
    """
    bonds = s.size
    strain = np.zeros((order + 1, bonds))
    velocity = np.zeros((order + 1, bonds + 1))
    work = np.zeros((max(2, power), order + 1, bonds))
    tension = np.zeros(bonds)
    path = np.zeros(order + 1)
    stack = np.zeros((_HALVINGS + 3, order + 1))
    ends = np.zeros((_HALVINGS + 3, 2))
    x, t, unit, last = state[0], state[1], state[2], state[3]
    singular = law in (LJ, LOG)
    found = 0
    ended = MORE
    for _ in range(limit):
        if found == hits.shape[0]:
            break
        if x == 0.0 and v[0] < 0.0:
            hits[found, 0], hits[found, 1] = t, -v[0]
            found += 1
            v[0] = -v[0]
            last = t
        if t >= max(horizon[0] * last, horizon[1]):
            ended = DONE
            break
        strain[0], velocity[0] = s, v
        _series(law, parameter, power, order, unit, length, strain, velocity, work, tension)
        if x == 0.0 and v[0] == 0.0 and velocity[1, 0] < 0.0:
            ended = RESTING
            break
        ratio = _step(order, tolerance, speed, singular, length, strain, velocity)
        ratio = min(ratio, _GROWTH, _LONGEST_STEP / unit)
        if not ratio * unit > 1e-250 or t + ratio * unit == np.inf:
            ended = BROKEN
            break
        path[0] = x
        scale = unit
        for k in range(order):
            path[k + 1] = velocity[k, 0] * scale / (k + 1)
        grown = 1.0
        for k in range(order + 1):
            path[k] *= grown
            grown *= ratio
        # From the wall, x/u has the same roots as x except for the departure at u = 0.
        start = 1 if x == 0.0 else 0
        degree = order - start
        root = first_root(path[start:], degree, basis[start], stack, ends)
        u = min(root, 1.0)
        x = 0.0 if root <= 1.0 else _value(path, order, 1.0)
        far = u * ratio
        for i in range(bonds):
            change = strain[order, i]
            for k in range(order - 1, 0, -1):
                change = change * far + strain[k, i]
            change *= far
            if singular and length[i] < _SHORT:
                length[i] += change
                s[i] = length[i] - 1.0
            else:
                s[i] += change
                length[i] = 1.0 + s[i]
        for i in range(bonds + 1):
            change = velocity[order, i]
            for k in range(order - 1, 0, -1):
                change = change * far + velocity[k, i]
            v[i] += change * far
        t += far * unit
        unit *= ratio
        state[4] += 1.0
        if root <= 1.0 and v[0] > 0.0:
            # The touch is so light that rounding changed the sign of the speed.
            v[0] = -v[0]
    state[0], state[1], state[2], state[3] = x, t, unit, last
    return ended, found


def bernstein_basis(degree: int) -> np.ndarray:
    """Return the matrix from powers on [0, 1] to Bernstein coefficients: C(j, k)/C(degree, k)."""
    return np.array(
        [
            [math.comb(j, k) / math.comb(degree, k) for k in range(degree + 1)]
            for j in range(degree + 1)
        ]
    )
