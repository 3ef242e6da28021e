"""Long lj chains (NH figure 5): does dissipation vanish as n grows, at a fixed v/v*?"""

import numpy as np

from chaincor.analysis.theory import harmonic_dissipation_law
from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.fits import PowerLaw, fit_power_law
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.plan import PAPER_SIZE_SPEEDS

# The last part of each curve, from a fifth of its longest chain on: slow chains level off late.
_LAST_PART = 5.0


Laws = dict[float, tuple[PowerLaw, list[Point]]]


def last_exponents(measured: Measurements) -> Laws:
    """Fit 1 - eta over the last part of each curve: the law and its points, by speed."""
    found = {}
    for speed in PAPER_SIZE_SPEEDS:
        points = measured.select("sizes", "lj", speed=speed)
        longest = max((p.particles for p in points), default=0)
        last = [p for p in points if p.particles >= longest / _LAST_PART]
        law = fit_power_law([p.particles for p in last], [1.0 - p.restitution for p in last])
        found[speed] = (law, last)
    return found


def length_findings(measured: Measurements) -> dict[str, Finding]:
    """Return what is found on long chains, by the key of the rule that judges it."""
    laws = last_exponents(measured)
    return {
        "long chains, fast": _exponent(laws, PAPER_SIZE_SPEEDS[0], "a constant has 0"),
        "long chains, slow": _exponent(
            laws, PAPER_SIZE_SPEEDS[-1], "the harmonic law −2/3, a constant 0"
        ),
    }


def _exponent(laws: Laws, speed: float, meaning: str) -> Finding:
    law, points = laws[speed]
    if not points:
        return Finding(float("nan"), float("nan"), "no points")
    first, last = points[0], points[-1]
    harmonic = float(harmonic_dissipation_law(np.array(last.particles)))
    others = ", ".join(
        f"{other.exponent:z.2f} at {u} v* (n = {other.first:.0f} to {other.last:.0f})"
        for u, (other, _) in laws.items()
        if u != speed
    )
    return Finding(
        law.exponent,
        law.exponent_error,
        f"exponent of 1 − η against n, {law.points} points, n = {law.first:.0f} to "
        f"{law.last:.0f}; {meaning}. 1 − η goes from {1.0 - first.restitution:.6f} to "
        f"{1.0 - last.restitution:.6f}, where the harmonic law ends at {harmonic:.6f}. Other "
        f"speeds: {others}",
        points,
    )
