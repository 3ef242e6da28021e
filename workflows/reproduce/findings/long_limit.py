"""Low speed and long chains at once (lj): the scaling of 1 - eta, and C as n goes to infinity."""

from dataclasses import dataclass

import numpy as np

from chaincor.workflows.reproduce.measurements import Measurements, Point

# Shorter chains and faster collisions are not in the limit.
_SHORTEST = 100
_FASTEST = 0.12
# Where (v0/v*) n^(2/3) is larger than these, the harmonic part of the dissipation is small.
BEYOND_HARMONIC = (3.5, 5.0)


def scaled_speed(point: Point) -> float:
    """
    Return the one variable that decides in slow collisions of long chains.

    Nonlinearity steepens a front by a share v0/v* of the way it goes, 2n; dispersion widens it as
    n^(1/3). Their ratio is (v0/v*) n^(2/3).
    """
    return point.speed * point.particles ** (2.0 / 3.0)


def slow_long_chains(measured: Measurements) -> list[Point]:
    """Return the lj points near the limit of low speed and long chains, by scaled speed."""
    points = {
        (p.particles, p.speed): p
        for study in ("slopes", "sizes")
        for p in measured.select(study, "lj")
        if p.particles >= _SHORTEST and p.speed <= _FASTEST
    }
    return sorted(points.values(), key=scaled_speed)


@dataclass(frozen=True)
class SlopeLimit:
    """
    C in the limit of long chains, taken before that of low speed.

    Attributes
    ----------
    value, error : float
        Limit of (1 - eta)/(v0/v*) as v0 -> 0 of a straight line, and its standard error.
    least_scaled_speed : float
        The line is fitted to points above this.
    points : int
        How many.
    """

    value: float
    error: float
    least_scaled_speed: float
    points: int


def slope_limits(measured: Measurements) -> list[SlopeLimit]:
    """Fit the limit over each of two ranges that holds at least four points."""
    points = slow_long_chains(measured)
    limits = []
    for least in BEYOND_HARMONIC:
        chosen = [p for p in points if scaled_speed(p) >= least]
        if len(chosen) < 4:
            continue
        speeds = np.array([p.speed for p in chosen])
        chords = np.array([1.0 - p.restitution for p in chosen]) / speeds
        line, covariance = np.polyfit(speeds, chords, 1, cov=True)
        limits.append(
            SlopeLimit(float(line[1]), float(covariance[1, 1] ** 0.5), least, len(chosen))
        )
    return limits


def describe_limits(limits: list[SlopeLimit]) -> str:
    """
    Write what is known of the limit: ``0.97 to 1.03``, and the fits that say so.

    Fits over different ranges exclude each other, so that neither bar is that of the limit.
    """
    if not limits:
        return "too few points"
    low = min(limit.value - limit.error for limit in limits)
    high = max(limit.value + limit.error for limit in limits)
    fits = "; ".join(
        f"{limit.value:.3f} ± {limit.error:.3f} by {limit.points} points with (v₀/v*) n^(2/3) > "
        f"{limit.least_scaled_speed:g}"
        for limit in limits
    )
    return f"between {low:.2f} and {high:.2f} ({fits})"
