"""Points of one curve with their bars: power laws through them, the limit at 0, the minimum."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.reproduce.measurements import Point, column


@dataclass(frozen=True)
class PowerLaw:
    r"""A fit of :math:`y = A x^p`."""

    exponent: float  #: p.
    #: That of the scatter and that of the points, added in quadrature; nan with fewer than three
    #: points, and 0 where p is fixed.
    exponent_error: float
    prefactor: float  #: A.
    prefactor_error: float  #: As that of p.
    first: float  #: Smallest x.
    last: float  #: Largest x.
    points: int  #: How many.

    def at(self, x: ArrayLike) -> Array:
        """Return the fitted curve A x^p."""
        return self.prefactor * np.asarray(x, dtype=float) ** self.exponent


@dataclass(frozen=True)
class Curve:
    """A quantity of points, in the order of what it is drawn against or fitted to."""

    points: Sequence[Point]
    x: Array  #: Such as v0/v* or n.
    y: Array  #: The quantity.
    errors: Array  #: Its error bars.

    @classmethod
    def of(cls, points: Sequence[Point], x: str, y: str) -> Self:
        """Return an attribute of points against another, with the error bars of eta."""
        return cls(points, *(column(points, name) for name in (x, y, "error")))

    @property
    def largest_relative_error(self) -> float:
        """Largest error bar, as a share of the quantity it belongs to."""
        return float(np.max(np.abs(self.errors / self.y)))

    def between(self, first: float, last: float) -> "Curve":
        """Return the part that is within a range of x."""
        kept = np.flatnonzero((self.x >= first) & (self.x <= last)).tolist()
        points = [self.points[k] for k in kept]
        return Curve(points, self.x[kept], self.y[kept], self.errors[kept])

    def over(
        self, ranges: Sequence[tuple[float, float]], fit: "Callable[[Curve], PowerLaw]"
    ) -> list[PowerLaw]:
        """Fit the part within each range, where a point is left over to take an error from."""
        laws = (fit(self.between(*ends)) for ends in ranges)
        return [law for law in laws if np.isfinite(law.prefactor_error)]

    def power_law(self, exponent: float | None = None) -> PowerLaw:
        r"""
        Fit :math:`\ln y = \ln A + p \ln x` by least squares, all points alike.

        Most points are exact to far less than their scatter about a power law, which is real. The
        error of a fit is the standard error of that scatter and what the error bars of y allow
        together, added in quadrature: they are bounds, not samples, and may all err the same way.

        `exponent` fixes p. All is nan with fewer than two points, or if a number is not positive.
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
        """Fit a line through the origin by least squares; all is nan with fewer than two points."""
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
    Return the errors of the parameters of a linear fit, all points alike.

    `design`, of shape (points, parameters), is what multiplies the parameters, `residuals` what the
    fit leaves over, and `bars` are the error bars of the points. Errors are nan where no point is
    left over.
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
    Return fits of quantities against x as rows of the report's table, by what was fitted.

    Verdicts and numbers of the text are of the first; the others tell how it depends on the range.
    """
    return [
        {"what": what, "x": x, **asdict(law), "judged": k == 0}
        for what, laws in fits.items()
        for k, law in enumerate(laws)
    ]


def limit_at_zero(x: Array, y: Array, degree: int) -> tuple[float, float]:
    """Return what a polynomial through points, x rising, has at 0, and what one less changes."""
    limit, shorter = (
        float(np.polyfit(x[:count], y[:count], degree)[-1]) for count in (x.size, x.size - 1)
    )
    return limit, abs(limit - shorter)


@dataclass(frozen=True)
class Minimum:
    """The lowest point of a curve, from a parabola through the points around it."""

    place: float  #: Where.
    value: float  #: How low.
    #: What the place changes by if the parabola goes through five points, not three; half the
    #: distance of the neighbouring points where there are no five.
    place_error: float


def find_minimum(x: Array, y: Array) -> Minimum:
    """
    Return the minimum of a curve given by points, x rising and positive; the parabola is in ln x.

    It is nan where the lowest point is at an end: then there is no minimum.
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
