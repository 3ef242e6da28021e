"""Long lj chains (NH figure 5): does dissipation vanish as n grows, at a fixed v/v*?"""

import numpy as np

from analysis.theory import harmonic_dissipation_law
from workflows.reproduce.findings.finding import Finding
from workflows.reproduce.fits import PowerLaw, fit_power_law
from workflows.reproduce.measurements import Measurements, Point
from workflows.reproduce.plan import PAPER_SIZE_SPEEDS

# The last part of each curve, from a tenth of its longest chain on.
_LAST_PART = 10.0


def last_exponents(measured: Measurements) -> dict[float, tuple[PowerLaw, list[Point]]]:
    """
    Return the power law of 1 - eta over the last decade in n, by speed.

    Parameters
    ----------
    measured : Measurements
        All points.

    Returns
    -------
    dict of float to (PowerLaw, list of Point)
        The fit and the points it is made to.
    """
    found = {}
    for speed in PAPER_SIZE_SPEEDS:
        points = measured.select("sizes", "lj", speed=speed)
        longest = max((p.particles for p in points), default=0)
        last = [p for p in points if p.particles >= longest / _LAST_PART]
        law = fit_power_law([p.particles for p in last], [1.0 - p.restitution for p in last])
        found[speed] = (law, last)
    return found


def length_findings(measured: Measurements) -> dict[str, Finding]:
    """
    Return what is found on long chains.

    Parameters
    ----------
    measured : Measurements
        All points.

    Returns
    -------
    dict of str to Finding
        By the key of the rule that judges it.
    """
    laws = last_exponents(measured)
    fast, slow = PAPER_SIZE_SPEEDS[0], PAPER_SIZE_SPEEDS[-1]
    fast_law, fast_points = laws[fast]
    found = {
        "long chains, fast": Finding(
            fast_law.exponent,
            fast_law.exponent_error,
            f"exponent of 1 - eta against n at {fast} v*, n = {fast_law.first:.0f} to "
            f"{fast_law.last:.0f}; a constant has 0; "
            + ", ".join(
                f"{law.exponent:.2f} at {u} v*" for u, (law, _) in laws.items() if u != fast
            ),
            fast_points,
        )
    }
    slow_points = laws[slow][1]
    if not slow_points:
        missing = Finding(float("nan"), float("nan"), "no points")
        return found | {"long chains, slow": missing}
    longest = max(slow_points, key=lambda p: p.particles)
    dissipation = 1.0 - longest.restitution
    law = float(harmonic_dissipation_law(np.array(longest.particles)))
    others = [
        f"{(1.0 - last.restitution) / u:.2f} ({u} v*, n = {last.particles})"
        for u, (_, points) in laws.items()
        for last in points[-1:]
    ]
    found["long chains, slow"] = Finding(
        dissipation / law,
        longest.error / law,
        f"(1 - eta) at {slow} v*, n = {longest.particles}: {dissipation:.6f}, over the 0.652 "
        f"n^(-2/3) with which it would vanish; (1 - eta)/(v/v*) at the longest chains is "
        + ", ".join(others),
        slow_points,
    )
    return found
