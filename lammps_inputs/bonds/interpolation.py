r"""
Interpolate in a bond table like LAMMPS, by straight lines or a cubic spline.

The second derivatives M of the spline at the rows solve a tridiagonal system, with the spacings h
and the difference quotients d:

.. math:: h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (d_i - d_{i-1}),

The slopes at both ends are given. SciPy's spline would take longer to import than a collision takes
to run.
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
    Return the values at `asked`, interpolated between two or more increasing x with values y.

    The spline has the given `slopes` at the first and the last x. Beyond them, the outer cubics are
    continued.
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
    """Return the second derivatives of the spline at the rows."""
    h = np.diff(x)
    beside = h.tolist()
    quotients = np.concatenate(([slopes[0]], np.diff(y) / h, [slopes[1]]))
    right = (6.0 * np.diff(quotients)).tolist()
    diagonal = (2.0 * (np.append(h, 0.0) + np.append(0.0, h))).tolist()
    # Plain loops over Python numbers are needed, because each result depends on the previous one.
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
