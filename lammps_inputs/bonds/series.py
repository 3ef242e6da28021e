"""Functions of a small argument that keep all their digits where the textbook form cancels."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array

# Series are used for |x| below this; above it the direct difference loses at most a factor of
# about 2/x^2 * x = 20 units in the last place of the result.
_SERIES_LIMIT = 0.1

# 12 terms of a series in t^2 <= (0.1/1.9)^2 leave a remainder below 1e-30 of the first term.
_ATANH_TERMS = [1.0 / (2 * k + 3) for k in range(12)]

# x^2/2 (1 + x/3 + x^2/12 + ...): 12 terms leave 0.1^12 * 2/14! = 2e-23 of the first.
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
    Return :math:`x - \ln(1 + x)` to full relative accuracy.

    With :math:`t = x/(2 + x)`, :math:`\ln(1+x) = 2\,\mathrm{artanh}\,t` and the linear terms
    cancel in closed form:

    .. math:: x - \ln(1+x) = t x - 2 t^3 (1/3 + t^2/5 + t^4/7 + \dots).

    Parameters
    ----------
    x : array_like
        Argument, larger than -1.

    Returns
    -------
    numpy.ndarray
        Non-negative values, of the shape of `x`.
    """
    x = np.asarray(x, dtype=float)
    small = np.abs(x) < _SERIES_LIMIT
    t = np.where(small, x / (2.0 + x), 0.0)
    series = t * x - 2.0 * t**3 * _horner(_ATANH_TERMS, t * t)
    return np.where(small, series, x - np.log1p(x))


def expm1_minus_x(x: ArrayLike) -> Array:
    r"""
    Return :math:`e^x - 1 - x` to full relative accuracy.

    Parameters
    ----------
    x : array_like
        Argument.

    Returns
    -------
    numpy.ndarray
        Non-negative values, of the shape of `x`.
    """
    x = np.asarray(x, dtype=float)
    small = np.abs(x) < _SERIES_LIMIT
    y = np.where(small, x, 0.0)
    series = 0.5 * y * y * _horner(_EXPM1_TERMS, y)
    return np.where(small, series, np.expm1(x) - x)
