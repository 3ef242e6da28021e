"""COR against speed (NH figures 4 and 7): minimum, collapse of the potentials, limits."""

import numpy as np

from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.fits import Minimum, find_minimum
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.studies import CURVE_POTENTIALS

# Where the paper's figure shows the three potentials on one curve, and where log leaves it.
_COLLAPSE_LIMIT = 2.0
_LOG_LIMIT = 0.9
# "Almost the same curve" to the eye, in a figure whose axis spans 0.3.
_SAME_CURVE = 0.02


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
            f"mean of three potentials, each by a parabola through the three lowest points; the "
            f"bar is what five points change; {described}",
            everything,
            (min(places), max(places)),
        ),
        "low-speed limit": _low_speed_limit(measured, curves),
        "high-speed limit": _at_highest_speed(curves, "restitution"),
        "contacts at high speed": _at_highest_speed(curves, "contacts_per_particle"),
        "rise of contacts": _rise_of_contacts(curves["lj"]),
        "collapse lj toda": _difference(curves, "lj", "toda", 0.0, _COLLAPSE_LIMIT),
        "collapse lj log": _difference(curves, "lj", "log", 0.0, _LOG_LIMIT),
        "collapse lj log, fast": _difference(curves, "lj", "log", _LOG_LIMIT, _COLLAPSE_LIMIT),
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
    if not all(curves.values()):
        return Finding(np.nan, np.nan, "no points")
    fastest = [points[-1] for points in curves.values()]
    values = [
        p.restitution if quantity == "restitution" else p.contacts / p.particles for p in fastest
    ]
    return Finding(
        min(values),
        max(p.error for p in fastest) if quantity == "restitution" else 0.0,
        "lowest of three, at "
        + ", ".join(f"{p.speed:g} v* ({p.scene.label}, {p.engine_name})" for p in fastest),
        fastest,
    )


def _rise_of_contacts(points: list[Point]) -> Finding:
    """Find where f/n is half-way between its lowest value and its value at the highest speed."""
    if len(points) < 3:
        return Finding(np.nan, np.nan, "no points")
    speeds = np.array([p.speed for p in points])
    share = np.array([p.contacts / p.particles for p in points])
    lowest = int(np.argmin(share))
    half = 0.5 * (share[lowest] + share[-1])
    above = np.flatnonzero((share >= half) & (np.arange(share.size) > lowest))
    if not above.size:
        return Finding(np.nan, np.nan, "f/n does not rise")
    k = int(above[0])
    full = np.flatnonzero(share >= 1.0)
    eta = np.array([p.restitution for p in points])
    low = int(np.argmin(eta))
    rise = np.interp(0.5 * (eta[low] + eta[-1]), eta[low:], speeds[low:])
    one = f"f/n is exactly 1 from {speeds[full[0]]:.3g} v* on" if full.size else "f/n stays below 1"
    part = (half - share[k - 1]) / (share[k] - share[k - 1])
    return Finding(
        float(speeds[k - 1] * (speeds[k] / speeds[k - 1]) ** part),
        # f is a whole number: half a contact, on the slope between the two points.
        float(0.5 / points[k].particles * (speeds[k] - speeds[k - 1]) / (share[k] - share[k - 1])),
        f"speed at which f/n is half-way from its minimum, {share[lowest]:.2f} at "
        f"{speeds[lowest]:.2g} v*, to {share[-1]:.2f}; {one} (lj); η itself is half-way up at "
        f"{rise:.2f} v*",
        points,
    )


def _difference(
    curves: dict[str, list[Point]], first: str, second: str, low: float, high: float
) -> Finding:
    """Compare two potentials at the speeds they share."""
    by_speed = {p.speed: p for p in curves[second]}
    pairs = [(p, by_speed[p.speed]) for p in curves[first] if p.speed in by_speed]
    pairs = [(p, q) for p, q in pairs if low <= p.speed <= high]
    if not pairs:
        return Finding(np.nan, np.nan, "no common speeds")
    gaps = [abs(p.restitution - q.restitution) for p, q in pairs]
    widest = pairs[int(np.argmax(gaps))]
    return Finding(
        max(gaps),
        widest[0].error + widest[1].error,
        f"largest |η({first}) − η({second})| at {len(pairs)} speeds from {pairs[0][0].speed:g} "
        f"to {pairs[-1][0].speed:g} v*, found at {widest[0].speed:g} v*; "
        f"{sum(gap > _SAME_CURVE for gap in gaps)} of them differ by more than {_SAME_CURVE}",
        [p for pair in pairs for p in pair],
    )
