"""
Estimate the uncertainty of a bond table, and make other forces that fit its rows.

A table gives values of a function at some lengths, with a limited number of digits. The error
between rows is estimated by omitting every second row. If the function is smooth and rows are
close, the omission increases the error of a cubic spline by a factor of sixteen. If the rows are
far apart or noisy, the error changes little.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from chaincor.lammps_inputs.arrays import Array

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


# A cubic requires this many rows.
LEAST_ROWS = 4
# Fewer rows do not show whether the error of a spline decreases with its order.
_FEW = 16
# Smallest weight of the error at omitted rows. In theory the weight is 1/16.
_LEAST_SHARE = 1.0 / 8.0
# Errors at omitted rows are averaged over this many neighbouring rows on each side.
_BESIDE = 3
# Orders of the differences from which the noise is estimated.
_ORDERS = range(3, 10)
# A row is an outlier if it differs from a spline through the other rows by this many times the
# errors of the other rows.
_OUTLIER = 20.0
# Number of rows that are checked as outliers, beginning with the most suspicious row.
_CANDIDATES = 4
# Number of rows in an altered table for each row of the user's table.
_FINER = 4
_SHAKES = 6


@dataclass(frozen=True)
class BondRows:
    """Rows of a table."""

    #: Strains of the rows, of shape (rows,).
    strains: Array
    forces: Array  #: Forces in the rows, of shape (rows,).
    #: Uncertainty of the force due to one unit in the last digits of force and length, of shape
    #: (rows,).
    digits: Array

    @classmethod
    def of(cls, spline: "CubicSpline", forces: Array, digits: Array) -> "BondRows":
        """Return the rows of a spline; `digits` are the `least_digits` of a ``Section``."""
        steep = np.abs(spline(spline.x, 1))
        return cls(spline.x, forces, digits[:, 2] + steep * digits[:, 0])

    def left_out(self, stride: int) -> Array:
        """Return the error at each row of a spline through every `stride`-th of the other rows."""
        rows = np.arange(len(self.strains))
        missed = np.zeros(len(rows))
        for start in range(stride):
            kept = rows % stride == (start + stride // 2) % stride
            kept[[0, -1]] = True
            asked = (rows % stride == start) & ~kept
            if np.count_nonzero(kept) > 2:
                spline = spline_through(self.strains[kept], self.forces[kept])
                missed[asked] = np.abs(self.forces - spline(self.strains))[asked]
        return missed

    def open_between(self) -> tuple[Array, Array]:
        """
        Return the error at omitted rows, if every second row is omitted, and its weight.

        Both have the shape (rows,) and are averaged over neighbours. The weight is 1 if rows are
        noisy or too far apart, and 1/8 if they resolve the force.
        """
        near, far = _beside(self.left_out(2)), _beside(self.left_out(4))
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(far > 0.0, near / far, _LEAST_SHARE)
        if len(self.strains) < _FEW:
            share = np.ones(len(near))
        return near, np.clip(2.0 * share, _LEAST_SHARE, 1.0)

    def noise(self) -> Array:
        """
        Return the standard deviation of the noise, of shape (rows,).

        For smooth forces, differences of order p decrease with p. For noise, they increase as the
        square root of the binomial coefficient (2p choose p), by which they are divided. The result
        is the smallest of these quotients for several orders (Hamming; More and Wild, SIAM J. Sci.
        Comput. 33, 1292, 2011).
        """
        count = len(self.forces)
        least = np.full(count, np.inf)
        for order in _ORDERS:
            if order >= count:
                break
            scaled = np.diff(self.forces, order) / math.comb(2 * order, order) ** 0.5
            # Row i contributes to the differences i - order to i.
            window = np.ones(order + 1) / (order + 1)
            inside = np.pad(scaled**2, order, mode="symmetric" if len(scaled) > order else "edge")
            least = np.minimum(least, np.sqrt(np.convolve(inside, window, mode="valid"))[:count])
        return least

    def errors(self) -> Array:
        """Return the approximate error of the force at each row, of shape (rows,)."""
        missed, share = self.open_between()
        return missed * share + 3.0 * self.noise() + self.digits

    def largest_error(self, low: float, high: float) -> float:
        """Return the largest approximate error of the force between two strains."""
        first, last = np.searchsorted(self.strains, (low, high))
        around = slice(max(first - 2, 0), last + 2)
        return float(np.max(self.errors()[around]))

    def alternatives(self) -> list["CubicSpline"]:
        """
        Return other splines of the force, which fit the rows equally well.

        The first two splines are moved away from splines through every second row, by the error of
        `open_between` times its weight. In all other splines, each row is changed at random within
        its digits and noise.
        """
        whole = spline_through(self.strains, self.forces)
        _, share = self.open_between()
        fine = np.unique(
            np.concatenate(
                [self.strains[:-1] + np.diff(self.strains) * k / _FINER for k in range(_FINER)]
                + [self.strains[-1:]]
            )
        )
        counts = np.interp(fine, self.strains, share)
        found = []
        rows = np.arange(len(self.strains))
        for start in (0, 1):
            kept = rows % 2 == start
            kept[[0, -1]] = True
            coarse = spline_through(self.strains[kept], self.forces[kept])
            found.append(spline_through(fine, whole(fine) + counts * (whole(fine) - coarse(fine))))
        rng = np.random.default_rng(20240229)
        width = np.hypot(self.digits / 12**0.5, self.noise())
        for _ in range(_SHAKES):
            shaken = self.forces + width * rng.standard_normal(len(width))
            found.append(spline_through(self.strains, shaken))
        return found

    def outlier(self, path: str) -> str:
        """Return the mistake if one row does not fit the other rows, or an empty text."""
        count = len(self.strains)
        if count < _FEW:
            return ""
        missed = self.left_out(2)
        # The errors two rows away from a row do not depend on this row. They show the usual error
        # for a smooth function.
        padded = np.pad(missed, 2, mode="reflect")
        smooth = np.maximum(padded[:-4], padded[4:]) + self.digits
        with np.errstate(divide="ignore", invalid="ignore"):
            sticks_out = np.nan_to_num(missed / smooth)
        for row in np.argsort(sticks_out)[::-1][:_CANDIDATES].tolist():
            around = [k for k in range(row - 4, row + 5) if 0 <= k < count and k != row]
            without = BondRows(
                *(np.delete(a, row) for a in (self.strains, self.forces, self.digits))
            )
            missed_without = np.insert(without.left_out(2), row, 0.0)
            spline = spline_through(without.strains, without.forces)
            off = abs(float(self.forces[row] - spline(self.strains[row])))
            agree = float(np.max(missed_without[around])) + 4.0 * float(self.digits[row])
            if off > _OUTLIER * agree and np.max(missed[around]) > 3.0 * agree:
                return (
                    f"table {path!r} has a force of {self.forces[row]:.6g} in row {row + 1}, but "
                    f"its other rows suggest {float(spline(self.strains[row])):.6g}. Correct or "
                    "remove this row"
                )
        return ""


@lru_cache(maxsize=64)
def _cached_spline(strains: bytes, forces: bytes) -> "CubicSpline":
    from scipy.interpolate import CubicSpline

    return CubicSpline(np.frombuffer(strains), np.frombuffer(forces))


def spline_through(strains: Array, forces: Array) -> "CubicSpline":
    """Return the cubic spline of a table, which can be evaluated beyond its ends."""
    return _cached_spline(np.ascontiguousarray(strains).tobytes(), forces.tobytes())


def _beside(values: Array) -> Array:
    """Return for each row the root mean square of the row and its neighbours."""
    padded = np.pad(values**2, _BESIDE, mode="reflect")
    window = np.ones(2 * _BESIDE + 1) / (2 * _BESIDE + 1)
    return np.sqrt(np.convolve(padded, window, mode="valid"))
