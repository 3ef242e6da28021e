"""Long lj chains (NH figure 5): does dissipation vanish as n grows, at a fixed v/v*?"""

import numpy as np

from chaincor.analysis.theory import harmonic_dissipation_law
from chaincor.workflows.pages.typesetting import format_value
from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.fits import PowerLaw, fit_power_law
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.plan import PAPER_SIZE_SPEEDS

# The last part of each curve, from a fifth of its longest chain on: slow chains level off late.
_LAST_PART = 5.0
# Where slow chains still look harmonic.
_BEFORE = (100, 1000)

Laws = dict[float, tuple[PowerLaw, list[Point]]]


def last_exponents(measured: Measurements) -> Laws:
    """Fit 1 - eta over the last part of each curve: the law and its points, by speed."""
    found = {}
    for speed in PAPER_SIZE_SPEEDS:
        points = measured.select("sizes", "lj", speed=speed)
        longest = max((p.particles for p in points), default=0)
        last = [p for p in points if p.particles >= longest / _LAST_PART]
        found[speed] = (_law(last), last)
    return found


def _law(points: list[Point]) -> PowerLaw:
    return fit_power_law(
        [p.particles for p in points],
        [1.0 - p.restitution for p in points],
        errors=[p.error for p in points],
    )


def length_findings(measured: Measurements) -> dict[str, Finding]:
    """Return what is found on long chains, by the key of the rule that judges it."""
    laws = last_exponents(measured)
    slow = PAPER_SIZE_SPEEDS[-1]
    return {
        "long chains, fast": _exponent(laws, PAPER_SIZE_SPEEDS[0]),
        "long chains, slow": _exponent(
            laws,
            slow,
            f". That {slow:g} v*, its slowest, is very low, and that the law of model A is "
            f"expected there, is our reading{_before(measured, slow)}. The paper's own eq. (18), "
            "which is for n → ∞, gives 1 − η = C v₀/v* > 0 at every v₀: read as v₀ → 0 as well, "
            "the statement holds" + _longest_by_lammps(laws[slow][1]),
            f"as we read it: at {slow:g} v* 1 − η stays near {_lost_last(laws[slow][1])}, about "
            "C v₀/v*, as the paper's own eq. (18) implies; it vanishes if v₀ → 0 too",
        ),
    }


def falls(points: list[Point]) -> tuple[float, float]:
    """
    Return by how much 1 - eta falls from the first to the last of these, and the harmonic chain's.

    That of the harmonic chain is by its law, in shares of 1 - eta of the first point, as both are.
    """
    first, last = (1.0 - p.restitution for p in (points[0], points[-1]))
    harmonic = harmonic_dissipation_law(np.array([points[0].particles, points[-1].particles]))
    return (first - last) / first, float(harmonic[0] - harmonic[1]) / first


def _lost_last(points: list[Point]) -> str:
    return f"{1.0 - points[-1].restitution:.4f}" if points else "–"


def _longest_by_lammps(points: list[Point]) -> str:
    """Say where nothing checks the in-house engine."""
    alone = [p.particles for p in points if p.agrees is None]
    return f". In-house alone from n = {min(alone)} on: no LAMMPS check there" if alone else ""


def _exponent(laws: Laws, speed: float, remark: str = "", brief: str = "") -> Finding:
    law, points = laws[speed]
    if not points:
        return Finding(float("nan"), float("nan"), "no points")
    first, last = points[0], points[-1]
    harmonic = float(harmonic_dissipation_law(np.array(last.particles)))
    return Finding(
        law.exponent,
        law.exponent_error,
        f"exponent of 1 − η against n, {law.points} points, n = {law.first:.0f} to "
        f"{law.last:.0f}, where 1 − η goes from {_lost(first)} to {_lost(last)}; the harmonic law "
        f"ends at {harmonic:.4f}{remark}",
        points,
        brief=brief,
    )


def _lost(point: Point) -> str:
    return format_value(1.0 - point.restitution, point.error)


def _before(measured: Measurements, speed: float) -> str:
    """Say how 1 - eta falls before it levels off."""
    points = measured.select("sizes", "lj", speed=speed)
    law = _law([p for p in points if _BEFORE[0] <= p.particles <= _BEFORE[1]])
    if not np.isfinite(law.exponent_error):
        return ""
    return (
        f"; from n = {law.first:.0f} to {law.last:.0f} it does fall, as the paper says (exponent "
        f"{law.exponent:.2f} ± {law.exponent_error:.2f}), and hardly beyond"
    )
