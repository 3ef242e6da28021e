"""Low speed and long chains at once (lj): the scaling of 1 - eta, and C as n goes to infinity."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product

import numpy as np

from chaincor.workflows.reproduce.fits import parameter_errors
from chaincor.workflows.reproduce.measurements import Measurements, Point

# Shorter chains are not in the limit.
_SHORTEST = 100
# Where (v0/v*) n^(2/3) is larger than these, the harmonic part of the dissipation is small.
BEYOND_HARMONIC = (3.5, 5.0, 8.0)
# And up to these speeds a straight line does; the range of C is that over all these cuts.
FASTEST = (0.05, 0.12, 0.2, 0.31)
_LEAST_POINTS = 4


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
        if p.particles >= _SHORTEST and p.speed <= FASTEST[-1]
    }
    return sorted(points.values(), key=scaled_speed)


@dataclass(frozen=True)
class SlopeLimit:
    """
    C in the limit of long chains, taken before that of low speed.

    Attributes
    ----------
    value, error : float
        Limit of (1 - eta)/(v0/v*) as v0 -> 0 of a straight line, and its error: of the scatter,
        and of what the points' bars allow.
    least_scaled_speed, fastest : float
        The line is fitted to points between these.
    points : int
        How many.
    """

    value: float
    error: float
    least_scaled_speed: float
    fastest: float
    points: int


def slope_limits(measured: Measurements) -> list[SlopeLimit]:
    """Fit the limit over each pair of cuts that leaves at least four points."""
    points = slow_long_chains(measured)
    limits = []
    for least, fastest in product(BEYOND_HARMONIC, FASTEST):
        chosen = [p for p in points if scaled_speed(p) >= least and p.speed <= fastest]
        if len(chosen) < _LEAST_POINTS:
            continue
        speeds = np.array([p.speed for p in chosen])
        chords = np.array([1.0 - p.restitution for p in chosen]) / speeds
        bars = np.array([p.error for p in chosen]) / speeds
        design = np.column_stack((np.ones_like(speeds), speeds))
        line = np.linalg.lstsq(design, chords, rcond=None)[0]
        error = parameter_errors(design, chords - design @ line, bars)[0]
        limits.append(SlopeLimit(float(line[0]), float(error), least, fastest, len(chosen)))
    return limits


def middle(limits: list[SlopeLimit]) -> float:
    """Return the median of the fits; nan if there are none."""
    return float(np.median([limit.value for limit in limits])) if limits else float("nan")


def describe_limits(limits: list[SlopeLimit]) -> str:
    """
    Write what is known of the limit: ``0.98, between 0.93 and 1.03 as cuts have it``.

    Fits with different cuts exclude each other, so that no single bar is that of the limit.
    """
    if not limits:
        return "unknown: too few points"
    low = min(limit.value - limit.error for limit in limits)
    high = max(limit.value + limit.error for limit in limits)
    return (
        f"about {middle(limits):.2f}, between {low:.2f} and {high:.2f} as the cuts have it "
        f"({len(limits)} straight lines in v₀ through the points with (v₀/v*) n^(2/3) above "
        f"{_several(limit.least_scaled_speed for limit in limits)} and v₀/v* up to "
        f"{_several(limit.fastest for limit in limits)})"
    )


def _several(values: Iterable[float]) -> str:
    *first, last = [f"{value:g}" for value in sorted(set(values))]
    return f"{', '.join(first)} or {last}" if first else last
