"""Power laws through points, with uncertainties, and how they depend on the range."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chaincor.workflows.reproduce.measurements import Point


@dataclass(frozen=True)
class PowerLaw:
    r"""A fit of :math:`y = A x^p`."""

    #: p and its error: that of the scatter and that of the points, added in quadrature; nan with
    #: fewer than three points, and 0 where p is fixed.
    exponent: float
    exponent_error: float  #: See ``exponent``.
    #: A and its error.
    prefactor: float
    prefactor_error: float  #: See ``prefactor``.
    #: Range of x.
    first: float
    last: float  #: See ``first``.
    points: int  #: How many.

    def at(self, x: ArrayLike) -> NDArray[np.float64]:
        """Return the fitted curve A x^p."""
        return self.prefactor * np.asarray(x, dtype=float) ** self.exponent


def fit_rows(what: str, x: str, laws: Iterable[PowerLaw], judged: int = 0) -> list[dict[str, Any]]:
    """
    Return fits as rows of the report's table: what was fitted against which x, and the law.

    Of the first `judged` it is said that a verdict, or a number of the text, is this one.
    """
    return [
        {"what": what, "x": x, **asdict(law), "judged": k < judged} for k, law in enumerate(laws)
    ]


def fit_power_law(
    x: ArrayLike, y: ArrayLike, exponent: float | None = None, errors: ArrayLike = 0.0
) -> PowerLaw:
    r"""
    Fit :math:`\ln y = \ln A + p \ln x` by least squares, all points alike.

    Most points are exact to far less than their scatter about a power law, which is real. The error
    of a fit is the standard error of that scatter and what the error bars of y, `errors`, allow
    together, added in quadrature: they are bounds, not samples, and may all err the same way.

    `exponent` fixes p. All is nan with fewer than two points, or if a number is not positive.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    nan = float("nan")
    if x.size < 2 or not (np.all(x > 0.0) and np.all(y > 0.0)):
        return PowerLaw(nan, nan, nan, nan, nan, nan, x.size)
    logarithms = np.log(x), np.log(y)
    if exponent is None:
        design = np.column_stack((logarithms[0], np.ones_like(x)))
        target = logarithms[1]
    else:
        design = np.ones((x.size, 1))
        target = logarithms[1] - exponent * logarithms[0]
    solution = np.linalg.lstsq(design, target, rcond=None)[0]
    freedom = x.size - design.shape[1]
    deviations = np.full(design.shape[1], nan)
    if freedom > 0:
        deviations = parameter_errors(design, target - design @ solution, np.asarray(errors) / y)
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


def parameter_errors(
    design: NDArray[np.float64], residuals: NDArray[np.float64], bars: NDArray[np.float64]
) -> NDArray[np.float64]:
    """
    Return the errors of the parameters of a linear fit, all points alike.

    Parameters
    ----------
    design : ndarray of shape (points, parameters)
        What multiplies the parameters.
    residuals, bars : ndarray of shape (points,)
        What the fit leaves over, and the error bars of the points.
    """
    freedom = design.shape[0] - design.shape[1]
    inverse = np.linalg.inv(design.T @ design)
    scatter = np.sum(residuals**2) / freedom * np.diag(inverse)
    allowed = np.abs(inverse @ design.T) @ np.broadcast_to(bars, residuals.shape)
    return np.sqrt(scatter + allowed**2)


def fit_dissipation(points: Sequence[Point], exponent: float | None = None) -> PowerLaw:
    """Fit a power law of the length to 1 - eta."""
    lengths, losses = [p.particles for p in points], [p.dissipation for p in points]
    return fit_power_law(lengths, losses, exponent, [p.error for p in points])


def fit_over_lengths(
    points: Sequence[Point],
    ranges: Sequence[tuple[float, float]],
    exponent: float | None = None,
) -> list[PowerLaw]:
    """Do the same over each range, from first to last length, that holds three points or more."""
    parts = ([p for p in points if first <= p.particles <= last] for first, last in ranges)
    return [fit_dissipation(part, exponent) for part in parts if len(part) >= 3]


def limit_at_zero(x: ArrayLike, y: ArrayLike, degree: int) -> tuple[float, float]:
    """Return what a polynomial through points, x rising, has at 0, and what one less changes."""
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    limit, shorter = (
        float(np.polyfit(x[:count], y[:count], degree)[-1]) for count in (x.size, x.size - 1)
    )
    return limit, abs(limit - shorter)


@dataclass(frozen=True)
class Minimum:
    """The lowest point of a curve, from a parabola through the points around it."""

    #: Where, and how low.
    place: float
    value: float  #: See ``place``.
    #: What the place changes by if the parabola goes through five points, not three; half the
    #: distance of the neighbouring points where there are no five.
    place_error: float


def find_minimum(x: ArrayLike, y: ArrayLike) -> Minimum:
    """
    Return the minimum of a curve given by points, x rising and positive; the parabola is in ln x.

    It is nan where the lowest point is at an end: then there is no minimum.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    nan = float("nan")
    if x.size < 3:
        return Minimum(nan, nan, nan)
    k = int(np.argmin(y))
    if k in (0, x.size - 1):
        return Minimum(nan, float(y[k]), nan)
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
