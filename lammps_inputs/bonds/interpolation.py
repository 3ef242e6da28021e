r"""
How LAMMPS interpolates in a bond table: by straight lines, or a cubic spline, found as it does.

Of the spline the second derivatives M at the rows solve a tridiagonal system, from row to row and
back: of spacings h and difference quotients d,

.. math:: h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (d_i - d_{i-1}),

with the slopes at both ends given. SciPy's would take longer to import than a collision takes.
"""

from typing import Literal

import numpy as np

from chaincor.lammps_inputs.arrays import Array


def interpolate(
    style: Literal["linear", "spline"],
    x: Array,
    y: Array,
    slopes: tuple[float, float],
    asked: Array,
) -> Array:
    """
    Return the values at `asked` between rising places x, at least two, with values y.

    The spline has these `slopes` at the first and the last; beyond them the outer cubics go on.
    """
    if style == "linear":
        return np.interp(asked, x, y)
    bends = _bends(x, y, slopes)
    low = np.clip(np.searchsorted(x, asked, side="right") - 1, 0, len(x) - 2)
    h = x[low + 1] - x[low]
    a, b = (x[low + 1] - asked) / h, (asked - x[low]) / h
    cubic = (a**3 - a) * bends[low] + (b**3 - b) * bends[low + 1]
    return a * y[low] + b * y[low + 1] + cubic * (h * h / 6.0)


def _bends(x: Array, y: Array, slopes: tuple[float, float]) -> Array:
    """Return the second derivatives at the rows."""
    h = np.diff(x)
    beside = h.tolist()
    quotients = np.concatenate(([slopes[0]], np.diff(y) / h, [slopes[1]]))
    right = (6.0 * np.diff(quotients)).tolist()
    diagonal = (2.0 * (np.append(h, 0.0) + np.append(0.0, h))).tolist()
    # Numbers, not arrays of one: each needs the one before.
    pivot, bends = diagonal[0], [right[0]]
    pivots = [pivot]
    for i, width in enumerate(beside):
        share = width / pivot
        pivot = diagonal[i + 1] - share * width
        pivots.append(pivot)
        bends.append(right[i + 1] - share * bends[i])
    bends[-1] /= pivot
    for i in range(len(bends) - 2, -1, -1):
        bends[i] = (bends[i] - beside[i] * bends[i + 1]) / pivots[i]
    return np.array(bends)
