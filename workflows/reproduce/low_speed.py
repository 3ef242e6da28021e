"""What slow chains lose more than harmonic ones: power laws of the speed, and their limit."""

from dataclasses import dataclass, replace

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.reproduce.claims import Finding
from chaincor.workflows.reproduce.fits import (
    PowerLaw,
    fit_power_law,
    limit_at_zero,
    parameter_errors,
)
from chaincor.workflows.reproduce.measurements import NoNumber, Point, column

# One range for all that the paper fits at low speed, C and the slopes of figure 6, whose range it
# does not say: the decade from the slowest speed of its figures on, 0.008 v*.
FIT_RANGE = (0.01, 0.1)
# How far a number depends on it is told by its halves, and by going on to the fastest speed.
RANGES = (FIT_RANGE, (0.01, 0.0317), (0.0317, 0.1), (0.01, np.inf))
# The power in the limit v0 -> 0 is that of so many of the slowest speeds.
_SLOWEST = 4


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


def increase_of(points: list[Point], baseline: list[Point]) -> Increase | None:
    """
    Subtract the harmonic baseline; None where there is nothing to subtract.

    Of the baseline's points the in-house propagator's, which are exact, are preferred.
    """
    if not points or not baseline:
        return None
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
