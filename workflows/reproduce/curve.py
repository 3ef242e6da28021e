"""Fit points with error bars: power laws, limits at 0 and minima."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.reproduce.measurements import MeasuredPoint, column


@dataclass(frozen=True)
class PowerLaw:
    r"""Fit of :math:`y = A x^p`."""

    exponent: float  #: Exponent p.
    #: Error of p: the quadratic sum of the errors from the scatter and from the error bars. The
    #: error is nan if there are fewer than three points, and 0 if p is fixed.
    exponent_error: float
    prefactor: float  #: Prefactor A.
    prefactor_error: float  #: Error of A, computed like the error of p.
    first: float  #: Smallest x.
    last: float  #: Largest x.
    points: int  #: Number of points.

    def at(self, x: ArrayLike) -> Array:
        """Return the fitted curve A x^p."""
        return self.prefactor * np.asarray(x, dtype=float) ** self.exponent


@dataclass(frozen=True)
class Curve:
    """Points with a quantity y against x, in the order of x."""

    points: Sequence[MeasuredPoint]
    x: Array  #: Abscissae, such as v0/v* or n.
    y: Array  #: Values of the quantity y.
    errors: Array  #: Error bars of y.

    @classmethod
    def of(cls, points: Sequence[MeasuredPoint], x: str, y: str) -> Self:
        """Return the curve of one attribute against another; the error bars are those of eta."""
        return cls(points, *(column(points, name) for name in (x, y, "error")))

    @property
    def largest_relative_error(self) -> float:
        """Largest relative error bar of y."""
        return float(np.max(np.abs(self.errors / self.y)))

    def between(self, first: float, last: float) -> "Curve":
        """Return the part of the curve within a range of x."""
        kept = np.flatnonzero((self.x >= first) & (self.x <= last)).tolist()
        points = [self.points[k] for k in kept]
        return Curve(points, self.x[kept], self.y[kept], self.errors[kept])

    def over(
        self, ranges: Sequence[tuple[float, float]], fit: "Callable[[Curve], PowerLaw]"
    ) -> list[PowerLaw]:
        """Fit the curve within each range that has enough points for an error of the fit."""
        laws = (fit(self.between(*ends)) for ends in ranges)
        return [law for law in laws if np.isfinite(law.prefactor_error)]

    def power_law(self, exponent: float | None = None) -> PowerLaw:
        r"""
        Fit :math:`\ln y = \ln A + p \ln x` by least squares with equal weights.

        The points scatter about a power law by far more than their error bars. The error of a fit
        is therefore the quadratic sum of two parts: the standard error from the scatter, and the
        largest change that the error bars of y allow. Error bars are bounds and no standard
        deviations, so the errors of all points may have the same sign.

        `exponent`, if given, fixes p. All results are nan if there are fewer than two points, or if
        any x or y is not positive.
        """
        x, y = self.x, self.y
        if x.size < 2 or not (np.all(x > 0.0) and np.all(y > 0.0)):
            return _no_law(x.size)
        target, ones = np.log(y), np.ones((x.size, 1))
        if exponent is None:
            design = np.column_stack((np.log(x), ones))
        else:
            design, target = ones, target - exponent * np.log(x)
        solution = np.linalg.lstsq(design, target, rcond=None)[0]
        deviations = _parameter_errors(design, target - design @ solution, self.errors / y)
        prefactor = float(np.exp(solution[-1]))
        return PowerLaw(
            exponent=float(solution[0]) if exponent is None else exponent,
            exponent_error=float(deviations[0]) if exponent is None else 0.0,
            prefactor=prefactor,
            prefactor_error=prefactor * float(deviations[-1]),
            first=float(x.min()),
            last=float(x.max()),
            points=x.size,
        )

    def line(self) -> PowerLaw:
        """Fit a line through the origin by least squares; nan for fewer than two points."""
        x, y = self.x, self.y
        if x.size < 2:
            return _no_law(x.size)
        slope = float(x @ y / (x @ x))
        error = float(_parameter_errors(x[:, None], y - slope * x, self.errors)[0])
        return PowerLaw(1.0, 0.0, slope, error, float(x.min()), float(x.max()), x.size)


def _no_law(points: int) -> PowerLaw:
    return PowerLaw(np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, points)


def _parameter_errors(design: Array, residuals: Array, bars: Array) -> Array:
    """
    Return the errors of the parameters of a linear fit with equal weights.

    `design`, of shape (points, parameters), is the matrix of the linear model. `residuals` are the
    residuals of the fit, and `bars` are the error bars of the points. Errors are nan unless there
    are more points than parameters.
    """
    points, parameters = design.shape
    if points <= parameters:
        return np.full(parameters, np.nan)
    inverse = np.linalg.inv(design.T @ design)
    scatter = np.sum(residuals**2) / (points - parameters) * np.diag(inverse)
    allowed = np.abs(inverse @ design.T) @ bars
    return np.sqrt(scatter + allowed**2)


def fit_rows(x: str, fits: Mapping[str, Sequence[PowerLaw]]) -> list[dict[str, Any]]:
    """
    Return fits of quantities against x, as rows for the report's table.

    Verdicts, and numbers in the text, use the first fit of a quantity. The other fits show how the
    result depends on the range.
    """
    return [
        {"what": what, "x": x, **asdict(law), "judged": k == 0}
        for what, laws in fits.items()
        for k, law in enumerate(laws)
    ]


def limit_at_zero(x: Array, y: Array, degree: int) -> tuple[float, float]:
    """
    Extrapolate a polynomial to 0.

    Return the value at 0, and how much this value changes without the last point. The values of x
    must increase.
    """
    limit, shorter = (
        float(np.polyfit(x[:count], y[:count], degree)[-1]) for count in (x.size, x.size - 1)
    )
    return limit, abs(limit - shorter)


@dataclass(frozen=True)
class Minimum:
    """Minimum of a curve, from a parabola through neighbouring points."""

    place: float  #: Position x of the minimum.
    value: float  #: Value of the curve at the minimum.
    #: Error of the position: the change if the parabola is fitted to five points instead of three.
    #: If there are fewer than five points, the error is half the distance between the neighbouring
    #: points.
    place_error: float


def find_minimum(x: Array, y: Array) -> Minimum:
    """
    Return the minimum of points, from a parabola in ln x.

    The values of x must be positive and must increase. The minimum is nan if the lowest point is
    the first or the last point.
    """
    k = int(np.argmin(y)) if y.size else 0
    if not 0 < k < y.size - 1:
        return Minimum(np.nan, float(y[k]) if y.size else np.nan, np.nan)
    places, values = [], []
    for reach in (1, 2):
        if reach <= k < x.size - reach:
            near = slice(k - reach, k + reach + 1)
            a, b, c = np.polyfit(np.log(x[near] / x[k]), y[near], 2)
            places.append(float(x[k] * np.exp(-b / (2.0 * a))))
            values.append(float(c - b * b / (4.0 * a)))
    spacing = float(0.25 * (x[k + 1] - x[k - 1]))
    error = abs(places[1] - places[0]) if len(places) > 1 else spacing
    return Minimum(places[0], values[0], error)
