"""Compute functions of bonds without loss of digits, and fast exponentials."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array

# Series are used for |x| below this value. For larger |x|, the direct difference loses at most
# about 2/x = 20 units in the last place.
_SERIES_LIMIT = 0.1

# With 12 terms of a series in t^2 <= (0.1/1.9)^2, the remainder is below 1e-30 of the first term.
_ATANH_TERMS = [1.0 / (2 * k + 3) for k in range(12)]

# With 12 terms of x^2/2 (1 + x/3 + x^2/12 + ...), the remainder is 0.1^12 * 2/14! = 2e-23 of the
# first term.
_EXPM1_TERMS = [1.0]
for _k in range(3, 15):
    _EXPM1_TERMS.append(_EXPM1_TERMS[-1] / _k)


def _horner(terms: Sequence[float], x: Array) -> Array:
    total = np.zeros_like(x)
    for coefficient in reversed(terms):
        total = total * x + coefficient
    return total


def x_minus_log1p(x: ArrayLike) -> Array:
    r"""
    Return :math:`x - \ln(1 + x)`, x > -1, to full relative accuracy.

    With :math:`t = x/(2 + x)`, :math:`\ln(1+x) = 2\,\mathrm{artanh}\,t` and the linear terms
    cancel in closed form:

    .. math:: x - \ln(1+x) = t x - 2 t^3 (1/3 + t^2/5 + t^4/7 + \dots).
    """
    x = np.asarray(x, dtype=float)
    small = np.abs(x) < _SERIES_LIMIT
    t = np.where(small, x / (2.0 + x), 0.0)
    series = t * x - 2.0 * t**3 * _horner(_ATANH_TERMS, t * t)
    return np.where(small, series, x - np.log1p(x))


def expm1_minus_x(x: ArrayLike) -> Array:
    r"""Return :math:`e^x - 1 - x` to full relative accuracy."""
    x = np.asarray(x, dtype=float)
    small = np.abs(x) < _SERIES_LIMIT
    y = np.where(small, x, 0.0)
    series = 0.5 * y * y * _horner(_EXPM1_TERMS, y)
    return np.where(small, series, np.expm1(x) - x)


# The constants are: 1/ln 2; ln 2 as a sum of two numbers, the first with few bits; a number which
# rounds a double to an integer when it is added; and 1/2! to 1/13!, which make the series exact to
# 2e-17 up to ln(2)/2.
_PER_LN_2 = 1.4426950408889634
_LN_2, _LN_2_REST = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_TO_INTEGER = 1.5 * 2.0**52
_A2, _A3, _A4, _A5, _A6, _A7, _A8, _A9, _A10, _A11, _A12, _A13 = (
    1.0 / math.factorial(k) for k in range(2, 14)
)


def _exponentials() -> tuple[Callable, Callable]:
    """
    Return functions for exp(x) and exp(x) - 1 in arithmetic that compilers can vectorise.

    Compiled loops require that functions called in a kernel are in its closure.
    """

    def parts(exponent: Any) -> tuple[Any, Any]:
        """
        Return 2^k and exp(y) - 1 for x = k ln 2 + y with abs(y) <= ln(2)/2.

        The number 2^k is made from its bits. x is clipped to -708 and 709.
        """
        x = np.minimum(np.maximum(exponent, -708.0), 709.0)
        shifted = x * _PER_LN_2 + _TO_INTEGER
        k = shifted - _TO_INTEGER
        y = (x - k * _LN_2) - k * _LN_2_REST
        high = _A8 + y * (_A9 + y * (_A10 + y * (_A11 + y * (_A12 + y * _A13))))
        rest = _A2 + y * (_A3 + y * (_A4 + y * (_A5 + y * (_A6 + y * (_A7 + y * high)))))
        bits = np.int64((np.float64(shifted).view(np.int64) + 1023) << 52)
        return bits.view(np.float64), y + y * y * rest

    def exponential(exponent: Any) -> Any:
        """Return exp(x) with a relative error of about two epsilon."""
        power_of_2, less = parts(exponent)
        return power_of_2 + power_of_2 * less

    def exp_less_one(exponent: Any) -> Any:
        """Return exp(x) - 1 with a relative error of about two epsilon."""
        power_of_2, less = parts(exponent)
        return (power_of_2 - 1.0) + power_of_2 * less

    return exponential, exp_less_one


exponential, exp_less_one = _exponentials()
