"""COR against speed (NH figures 4 and 7): minimum, collapse of the potentials, limits."""

from itertools import combinations

import numpy as np

from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.fits import Minimum, find_minimum
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.studies import CURVE_POTENTIALS
from chaincor.workflows.reproduce.typesetting import format_value

# Where "near 1" begins and ends for words that claim no more than 10 %.
_AROUND_SCALE = (0.9, 1.1)


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
        f"{name}: η = {low.value:.4f} at {low.place:.2f} v*" for name, low in lows.items()
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
    return Finding(
        float(max(gaps, key=abs)),
        max(p.error for p in slowest),
        f"η of the harmonic chain less η at {slowest[0].speed:g} v*, the largest of three",
        slowest,
    )


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
    """Count which of f/n and eta are larger, beyond their bars, above v* than below."""
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
        float(sum(rising)),
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
    gaps, slow = [], []
    for first, second in combinations(curves, 2):
        by_speed = {p.speed: p for p in curves[second]}
        pairs = [(p, by_speed[p.speed]) for p in curves[first] if p.speed in by_speed]
        if not pairs:
            return Finding(np.nan, np.nan, "no common speeds")
        gaps.append(max(pairs, key=_gap))
        slow += [_gap(pair) for pair in pairs if pair[0].speed < 1.0]
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
        + (f"; below v* no two are more than {max(slow):.3f} apart" if slow else ""),
        [point for points in curves.values() for point in points],
    )
