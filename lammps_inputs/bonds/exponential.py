"""Exponentials for compiled loops: written out, for no compiler vectorises a call of exp."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

# 1/ln 2; ln 2 in two parts, of which the first has few bits; a number to which doubles can be
# added only rounded to integers; 1/2! to 1/13!, after which the series is exact to 2e-17 up to
# ln(2)/2.
_PER_LN_2 = 1.4426950408889634
_LN_2, _LN_2_REST = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_TO_INTEGER = 1.5 * 2.0**52
_A2, _A3, _A4, _A5, _A6, _A7, _A8, _A9, _A10, _A11, _A12, _A13 = (
    1.0 / math.factorial(k) for k in range(2, 14)
)


def _exponentials() -> tuple[Callable, Callable]:
    """Return both functions; what they call they close over, as compiled loops need it."""

    def parts(exponent: Any) -> tuple[Any, Any]:
        """
        Return 2^k and exp(y) - 1, whose x = k ln 2 + y with abs(y) <= ln(2)/2.

        2^k is made of its bits. Beyond -708 and 709 x is taken for these.
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
        """Return exp(x) to two epsilon or so."""
        power_of_2, less = parts(exponent)
        return power_of_2 + power_of_2 * less

    def exp_less_one(exponent: Any) -> Any:
        """Return exp(x) - 1 to two epsilon or so."""
        power_of_2, less = parts(exponent)
        return (power_of_2 - 1.0) + power_of_2 * less

    return exponential, exp_less_one


exponential, exp_less_one = _exponentials()
