"""Compile Runge-Kutta steps of the front's equation, with central differences of high order."""

import math
from collections.abc import Callable
from functools import lru_cache

import numba
import numpy as np

from chaincor.lammps_inputs.arrays import Array

# Number of neighbours on each side in the differences. First derivatives have order 10, and third
# derivatives order 8.
REACH = 5


def antisymmetric_weights(derivative: int) -> Array:
    """
    Return weights c_j of a derivative, the sum of ``c_j (u_j - u_-j)``, at unit spacing.

    Parameters
    ----------
    derivative : int
        Odd order of the derivative.

    Returns
    -------
    numpy.ndarray of shape (REACH,)
        c_1 to c_REACH. The formula is exact for polynomials up to degree 2 REACH.
    """
    powers = 2 * np.arange(REACH) + 1
    factorials = np.array([math.factorial(power) for power in powers], dtype=float)
    series = 2.0 * np.arange(1, REACH + 1)[None, :] ** powers[:, None] / factorials[:, None]
    return np.linalg.solve(series, (powers == derivative).astype(float))


def largest_rate(weights: Array) -> float:
    """Return the largest rate of the difference formula for any wave number, at unit spacing."""
    wave_numbers = np.linspace(0.0, np.pi, 2001)
    sines = np.sin(np.arange(1, REACH + 1)[:, None] * wave_numbers)
    return float(np.abs(2.0 * weights @ sines).max())


@lru_cache(maxsize=8)
def compiled_steps(power: int) -> Callable[..., None]:
    """
    Compile Runge-Kutta steps of the front's equation with damping.

    The equation is u_t + (flux u^(power + 1))_x + spread u_xxx = sponge (level - u).

    Parameters
    ----------
    power : int
        Power of u in front of u_x, 1 to 3.

    Returns
    -------
    callable
        ``advance(u, steps, dt, first, last, flux, spread, sponge, level)`` changes u between the
        indices first and last. The arrays flux and spread are weights of differences, which contain
        the coefficients and the powers of the spacing. u is damped towards level at the rate
        sponge.
    """

    @numba.njit(inline="always")
    def mean_power(
        right: float, left: float
    ) -> float:  # difference of u^(power+1), divided by the difference of u
        if power == 1:
            return right + left
        if power == 2:
            return right * right + right * left + left * left
        return (right + left) * (right * right + left * left)

    # A loop that begins at 0 needs no check for negative indices and can be vectorised.
    @numba.njit(fastmath=True, error_model="numpy")
    def stage(
        w: Array,
        u: Array,
        total: Array,
        ahead: Array,
        share: float,
        part: float,
        flux: Array,
        spread: Array,
        sponge: Array,
        level: float,
    ) -> None:
        a1, a2, a3, a4, a5 = flux[0], flux[1], flux[2], flux[3], flux[4]
        b1, b2, b3, b4, b5 = spread[0], spread[1], spread[2], spread[3], spread[4]
        for i in range(u.size):
            m5, m4, m3, m2, m1 = w[i], w[i + 1], w[i + 2], w[i + 3], w[i + 4]
            p1, p2, p3, p4, p5 = w[i + 6], w[i + 7], w[i + 8], w[i + 9], w[i + 10]
            slope = (p1 - m1) * (a1 * mean_power(p1, m1) + b1)
            slope += (p2 - m2) * (a2 * mean_power(p2, m2) + b2)
            slope += (p3 - m3) * (a3 * mean_power(p3, m3) + b3)
            slope += (p4 - m4) * (a4 * mean_power(p4, m4) + b4)
            slope += (p5 - m5) * (a5 * mean_power(p5, m5) + b5)
            rate = sponge[i] * (level - w[i + 5]) - slope
            total[i] += share * rate
            ahead[i] = u[i] + part * rate

    @numba.njit
    def advance(
        u: Array,
        steps: int,
        dt: float,
        first: int,
        last: int,
        flux: Array,
        spread: Array,
        sponge: Array,
        level: float,
    ) -> None:
        whole, total = u[first - REACH : last + REACH].copy(), u[first:last].copy()
        one, two = whole.copy(), whole.copy()
        inside = slice(REACH, whole.size - REACH)
        here, damped = whole[inside], sponge[first:last]
        for _ in range(steps):
            law = (flux, spread, damped, level)
            stage(whole, here, total, one[inside], dt / 6.0, dt / 2.0, *law)
            stage(one, here, total, two[inside], dt / 3.0, dt / 2.0, *law)
            stage(two, here, total, one[inside], dt / 3.0, dt, *law)
            stage(one, here, total, two[inside], dt / 6.0, 0.0, *law)
            here[:] = total
        u[first:last] = here

    return advance
