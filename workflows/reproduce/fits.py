"""Power laws through points, of the length and of the speed, and how they depend on the range."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.reproduce.claims import Finding
from chaincor.workflows.reproduce.measurements import NoNumber, Point, column

# One range for all that the paper fits at low speed, C and the slopes of figure 6, whose range it
# does not say: the decade from the slowest speed of its figures on, 0.008 v*.
FIT_RANGE = (0.01, 0.1)
# How far a number depends on it is told by its halves, and by going on to the fastest speed.
RANGES = (FIT_RANGE, (0.01, 0.0317), (0.0317, 0.1), (0.01, np.inf))
# The power in the limit v0 -> 0 is that of so many of the slowest speeds.
_SLOWEST = 4


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
    if x.size < 2 or not (np.all(x > 0.0) and np.all(y > 0.0)):
        return PowerLaw(np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, x.size)
    target, ones = np.log(y), np.ones((x.size, 1))
    if exponent is None:
        design = np.column_stack((np.log(x), ones))
    else:
        design, target = ones, target - exponent * np.log(x)
    solution = np.linalg.lstsq(design, target, rcond=None)[0]
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


def parameter_errors(design: Array, residuals: Array, bars: Array) -> Array:
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
    allowed = np.abs(inverse @ design.T) @ np.broadcast_to(bars, residuals.shape)
    return np.sqrt(scatter + allowed**2)


def fit_dissipation(points: Sequence[Point], exponent: float | None = None) -> PowerLaw:
    """Fit a power law of the length to 1 - eta."""
    lengths, losses = column(points, "particles"), column(points, "dissipation")
    return fit_power_law(lengths, losses, exponent, column(points, "error"))


def fit_over_lengths(
    points: Sequence[Point], ranges: Sequence[tuple[float, float]], exponent: float | None = None
) -> list[PowerLaw]:
    """Do the same over each range, from first to last length, that holds three points or more."""
    parts = ([p for p in points if first <= p.particles <= last] for first, last in ranges)
    return [fit_dissipation(part, exponent) for part in parts if len(part) >= 3]


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


@dataclass(frozen=True)
class Increase:
    """1 - eta of anharmonic chains less that of the harmonic one of the same length."""

    points: list[Point]  #: Anharmonic, in the order of speed.
    baseline: Point  #: The harmonic chain.
    speeds: Array  #: v0/v*.
    values: Array  #: The increase.
    errors: Array  #: Its error bar.

    @property
    def largest_relative_error(self) -> float:
        """Largest error bar, as a share of the increase it belongs to."""
        return float(np.max(np.abs(self.errors / self.values)))

    def fits(self) -> list[PowerLaw]:
        """Fit a power law over the range that is judged and over the others, where points do."""
        fits = (self.fit(*ends) for ends in RANGES)
        return [fit for fit in fits if np.isfinite(fit.exponent_error)]

    def fit(self, first: float, last: float) -> PowerLaw:
        """Fit a power law over a range of speeds."""
        within = (self.speeds >= 0.999 * first) & (self.speeds <= 1.001 * last)
        return fit_power_law(self.speeds[within], self.values[within], errors=self.errors[within])

    def slope(self, first: float, last: float) -> PowerLaw:
        """Fit a line through the origin by least squares; nan with fewer than two points."""
        within = (self.speeds >= first) & (self.speeds <= last)
        u, y = self.speeds[within], self.values[within]
        if u.size < 2:
            return PowerLaw(1.0, 0.0, np.nan, np.nan, np.nan, np.nan, u.size)
        slope = float(u @ y / (u @ u))
        error = float(parameter_errors(u[:, None], y - slope * u, self.errors[within])[0])
        return PowerLaw(1.0, 0.0, slope, error, float(u[0]), float(u[-1]), u.size)

    def slopes(self) -> list[PowerLaw]:
        """Fit lines over the same ranges, where there are two points."""
        slopes = (self.slope(*ends) for ends in RANGES)
        return [slope for slope in slopes if slope.points > 1]

    def within(self, first: float, last: float) -> list[Point]:
        """Return the points of a range of speeds."""
        return [p for p in self.points if first <= p.speed <= last]

    def local_powers(self) -> tuple[Array, Array]:
        """
        Return speeds half-way between neighbours, and the power between these.

        It is nan where dissipation does not increase.
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            powers = np.diff(np.log(self.values)) / np.diff(np.log(self.speeds))
        return np.sqrt(self.speeds[1:] * self.speeds[:-1]), powers

    def limit_power(self, order: int) -> tuple[float, float]:
        """
        Return the power of the increase in the limit v0 -> 0, and its error.

        What comes next is smaller by v0^(r-2), r being the `order` of the lowest anharmonic term,
        so that the power between neighbouring speeds changes in proportion to that: a straight line
        through those of the slowest speeds. The error is what one speed less changes, and what
        error bars of eta allow.
        """
        places, powers = self.local_powers()
        x, y = places[: _SLOWEST - 1] ** (order - 2), powers[: _SLOWEST - 1]
        if y.size < _SLOWEST - 1 or not np.all(np.isfinite(y)):
            return np.nan, np.nan
        limit, change = limit_at_zero(x, y, 1)
        relative = np.abs(self.errors / self.values)[:2]
        noise = float(np.sum(relative)) / np.log(self.speeds[1] / self.speeds[0])
        return limit, float(change + noise)

    def limit_finding(self, order: int, quantity: str = "the increase") -> Finding:
        """Say what the power is in the limit."""
        limit, error = self.limit_power(order)
        places, powers = self.local_powers()
        if not powers.size:
            raise NoNumber("one speed only")
        return Finding(
            limit,
            error,
            f"limit v₀ → 0 of the power of {quantity} between neighbouring speeds, by the "
            f"{_SLOWEST} slowest; at {places[0]:.2g} v* it is {powers[0]:.3f}; ± what one speed "
            "less and error bars change",
            self.points[:_SLOWEST],
        )

    def of_contact_times(self) -> "Increase":
        """
        Return what t_c is shorter than that of the harmonic chain, in place of the increase.

        Contact times have no bar of their own: what the two engines differ by stands for it.
        """
        both = np.array(
            [
                [point.answers[end].result["last_contact_time"] for end in (0, -1)]
                for point in (self.baseline, *self.points)
            ]
        )
        bars, times = np.abs(both[:, 0] - both[:, 1]), both[:, 1]
        return replace(self, values=times[0] - times[1:], errors=bars[0] + bars[1:])


def increase_of(points: list[Point], baseline: list[Point]) -> Increase:
    """
    Subtract the harmonic baseline; NoNumber where there is nothing to subtract.

    Of the baseline's points the in-house propagator's, which are exact, are preferred.
    """
    if not points or not baseline:
        raise NoNumber("no points")
    zero = baseline[0]
    exact = zero.restitution, zero.error
    if zero.in_house is not None and zero.in_house.result:
        exact = zero.in_house.result["restitution"], zero.bar_of(zero.in_house)
    return Increase(
        points=points,
        baseline=zero,
        speeds=column(points, "speed"),
        values=exact[0] - column(points, "restitution"),
        errors=exact[1] + column(points, "error"),
    )
