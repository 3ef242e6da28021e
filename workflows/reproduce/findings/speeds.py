"""COR against speed (NH figures 4 and 7): minimum, collapse of the potentials, limits."""

from itertools import combinations

import numpy as np

from chaincor.workflows.pages.typesetting import format_value
from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.fits import Minimum, find_minimum
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.studies import CURVE_POTENTIALS

# Where "near 1" begins and ends for words that claim no more than 10 %.
_AROUND_SCALE = (0.9, 1.1)
# The limit v0 -> 0 is that of so many of the slowest speeds.
_SLOWEST = 4


def minima(measured: Measurements) -> dict[str, Minimum]:
    """Return the minimum of eta(v) of each potential."""
    found = {}
    for name in CURVE_POTENTIALS:
        points = measured.select("curves", name)
        found[name] = find_minimum([p.speed for p in points], [p.restitution for p in points])
    return found


def speed_findings(measured: Measurements) -> dict[str, Finding]:
    """Return what is found on eta against speed, by the key of the rule that judges it."""
    curves = {name: measured.select("curves", name) for name in CURVE_POTENTIALS}
    everything = [p for points in curves.values() for p in points]
    lows = minima(measured)
    places = [low.place for low in lows.values()]
    described = "; ".join(
        f"{name}: η = {low.value:.4f} at {low.place:.2f} v*{_above_minimum(low, curves[name])}"
        for name, low in lows.items()
    )
    return {
        "place of the minimum": Finding(
            float(np.mean(places)),
            float(max(low.place_error for low in lows.values())),
            f"mean of three potentials, each by a parabola through the three lowest points; ± what "
            f"a parabola through five changes; {described}",
            everything,
            (min(places), max(places)),
        ),
        "low-speed limit": _low_speed_limit(measured, curves),
        "high-speed limit": _at_highest_speed(curves, "restitution"),
        "contacts at high speed": _at_highest_speed(curves, "contacts_per_particle"),
        "rise of both": _rise_of_both(curves["lj"]),
        "one curve": _one_curve(curves),
    }


def _low_speed_limit(measured: Measurements, curves: dict[str, list[Point]]) -> Finding:
    harmonic = measured.select("harmonic_velocities", "harmonic")
    if not harmonic or not all(curves.values()):
        return Finding(np.nan, np.nan, "no points")
    slowest = [points[0] for points in curves.values()]
    gaps = [harmonic[0].restitution - p.restitution for p in slowest]
    used = [points[:_SLOWEST] for points in curves.values()]
    if len(used[0]) < _SLOWEST:
        return Finding(np.nan, np.nan, f"fewer than {_SLOWEST} speeds")
    limits = [_limit(harmonic[0], points) for points in used]
    value, error = max(limits, key=lambda limit: abs(limit[0]))
    return Finding(
        value,
        error,
        f"η of the harmonic chain less η, limit v₀ → 0 of a parabola through the {_SLOWEST} "
        f"slowest speeds, the largest of three; ± what one speed less and error bars change; at "
        f"{slowest[0].speed:g} v* it is still {max(gaps, key=abs):.5f}",
        [p for points in used for p in points],
    )


def _limit(harmonic: Point, points: list[Point]) -> tuple[float, float]:
    """Return the harmonic chain's eta less that of others at v0 -> 0, and its error."""
    speeds = np.array([p.speed for p in points])
    gaps = np.array([harmonic.restitution - p.restitution for p in points])
    limit, shorter = (
        float(np.polyfit(speeds[:count], gaps[:count], 2)[2]) for count in (_SLOWEST, _SLOWEST - 1)
    )
    design = np.vander(speeds, 3)
    weights = np.abs(np.linalg.pinv(design)[2])
    allowed = float(weights @ np.array([p.error for p in points])) + harmonic.error
    return limit, abs(limit - shorter) + allowed


def _above_minimum(low: Minimum, points: list[Point]) -> str:
    """Say how little higher eta is at v* itself."""
    at_scale = [p.restitution for p in points if p.speed == 1.0]
    return f" ({at_scale[0] - low.value:.3f} higher at v* itself)" if at_scale else ""


def _at_highest_speed(curves: dict[str, list[Point]], quantity: str) -> Finding:
    # What is set equal to hard spheres is no evidence that chains come near them.
    integrated = [[p for p in points if not p.is_limit] for points in curves.values()]
    if not all(integrated):
        return Finding(np.nan, np.nan, "no points")
    fastest = [points[-1] for points in integrated]
    values = [
        p.restitution if quantity == "restitution" else p.contacts / p.particles for p in fastest
    ]
    return Finding(
        min(values),
        max(p.error for p in fastest) if quantity == "restitution" else 0.0,
        "lowest of three, each at the fastest speed integrated: "
        + ", ".join(f"{p.speed:.3g} v* ({p.scene.label}, {p.engine_name})" for p in fastest),
        fastest,
    )


def _rise_of_both(points: list[Point]) -> Finding:
    """Say whether both f/n and eta are larger, beyond their bars, above v* than below: 1 or 0."""
    below = [p for p in points if p.speed <= _AROUND_SCALE[0]]
    above = [p for p in points if p.speed >= _AROUND_SCALE[1]]
    if not below or not above:
        return Finding(np.nan, np.nan, "no points on both sides of v*")
    slow, fast = below[-1], above[0]
    share = [p.contacts / p.particles for p in points]
    eta = [p.restitution for p in points]
    rising = (
        fast.contacts > slow.contacts,
        fast.restitution - slow.restitution > fast.error + slow.error,
    )
    lowest, low = min(share), int(np.argmin(eta))
    onset = next(p.speed for p in points[::-1] if p.contacts / p.particles == lowest)
    full = [p.speed for p in points if p.contacts == p.particles]
    return Finding(
        float(all(rising)),
        0.0,
        f"lj, {slow.speed:g} to {fast.speed:g} v*: f/n from {slow.contacts / slow.particles:g} "
        f"to {fast.contacts / fast.particles:g}, η from {slow.restitution:.3f} to "
        f"{fast.restitution:.3f}. f/n rises from its floor, {lowest:g}, beyond {onset:.2g} v*, η "
        f"from its minimum at {points[low].speed:.2g} v*"
        + (f"; f/n is 1 from {full[0]:.3g} v* on" if full else "")
        + ". That values just below and just above v* are compared is our reading",
        points,
    )


def _gap(pair: tuple[Point, Point]) -> float:
    return abs(pair[0].restitution - pair[1].restitution)


def _one_curve(curves: dict[str, list[Point]]) -> Finding:
    """Compare each two potentials at the speeds they share."""
    gaps, slow = [], {}
    for first, second in combinations(curves, 2):
        by_speed = {p.speed: p for p in curves[second]}
        pairs = [(p, by_speed[p.speed]) for p in curves[first] if p.speed in by_speed]
        if not pairs:
            return Finding(np.nan, np.nan, "no common speeds")
        gaps.append(max(pairs, key=_gap))
        below = [_gap(pair) for pair in pairs if pair[0].speed < 1.0]
        slow[first, second] = max(below, default=np.nan)
    p, q = widest = max(gaps, key=_gap)
    return Finding(
        _gap(widest),
        p.error + q.error,
        "largest difference at one speed: "
        + "; ".join(
            f"{format_value(_gap((a, b)), a.error + b.error)} "
            f"({a.scene.label} and {b.scene.label}, at {a.speed:.3g} v*)"
            for a, b in gaps
        )
        + f"; below v* no two are more than {max(slow.values()):.3f} apart, lj and toda no more "
        f"than {slow['lj', 'toda']:.3f}",
        [point for points in curves.values() for point in points],
        brief=f"lj and toda within {slow['lj', 'toda']:.3f} below v*, log up to "
        f"{max(slow.values()):.2f} away below v* and {_gap(widest):.2f} above it",
    )
