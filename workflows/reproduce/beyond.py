"""Beyond the paper: what the measurements say on questions it does not ask."""

from dataclasses import dataclass

import numpy as np

from chaincor.workflows.reproduce.figures.spectra import half_of_vibration
from chaincor.workflows.reproduce.findings.lengths import last_exponents
from chaincor.workflows.reproduce.findings.long_limit import describe_limits, slope_limits
from chaincor.workflows.reproduce.findings.low_speed import lj_increases
from chaincor.workflows.reproduce.findings.speeds import minima
from chaincor.workflows.reproduce.measurements import Measurements, Point

# An exponent above this, half of the harmonic one, is nearer to a constant.
_CONSTANT = -1.0 / 3.0


@dataclass(frozen=True)
class Remark:
    """A question, in one line, and the answer of the data, with numbers."""

    question: str
    answer: str


def remarks(measured: Measurements) -> tuple[Remark, ...]:
    """Return what is found beyond the paper, in the order of the figures."""
    points = measured.select("curves", "lj")
    return (
        Remark(
            "Does dissipation vanish in long chains at any speed v > 0?", _long_chains(measured)
        ),
        Remark("What becomes of C in the limit n → ∞?", _slope_limit(measured)),
        Remark("Where does the lost energy sit?", _spectra(points)),
        Remark("When do lj chains break?", _breaking(points)),
        Remark("Which restitution is meant?", _kinematic(measured)),
    )


def _long_chains(measured: Measurements) -> str:
    laws = {speed: found for speed, found in last_exponents(measured).items() if found[1]}
    parts = [
        f"{1.0 - points[-1].restitution:.6f} ± {points[-1].error:.0e} at {speed:g} v* "
        f"(n = {points[-1].particles}; last exponent {law.exponent:z.2f})"
        for speed, (law, points) in laws.items()
    ]
    levels_off = [f"{speed:g}" for speed, (law, _) in laws.items() if law.exponent > _CONSTANT]
    return (
        "An exponent of 0 is a constant, −2/3 the harmonic law: "
        f"{len(levels_off)} of {len(laws)} speeds level off ({', '.join(levels_off)} v*). 1 − η of "
        "the longest chains: " + "; ".join(parts) + ". A slow chain looks harmonic until "
        "(v₀/v*) n^(2/3) is about 1 (see the figure of C)."
    )


def _slope_limit(measured: Measurements) -> str:
    peaks = [
        f"{float(np.max(increase.values / increase.speeds)):.2f} (n = {n})"
        for n, increase in lj_increases(measured).items()
    ]
    return (
        "In an infinite chain the harmonic part is gone and C is the limit of (1 − η)/(v₀/v*) as "
        "v₀ → 0, taken after n → ∞. By a straight line in v₀, which depends on the range: "
        + describe_limits(slope_limits(measured))
        + ". The paper has 0.66 and 2.61. Largest (η_harmonic − η)/(v₀/v*) at one length: "
        + ", ".join(peaks)
        + "."
    )


def _spectra(points: list[Point]) -> str:
    chosen = [p for p in points if p.speed in (0.4, 0.78, 2.0)] or points[:1]
    return "Half of the vibrational energy is in the lowest modes up to " + ", ".join(
        f"j = {half_of_vibration(p)} of {p.particles - 1} at {p.speed:.3g} v*" for p in chosen
    )


def _breaking(points: list[Point]) -> str:
    broken = [p for p in points if p.answer is not None and p.answer.result["fragments"] > 1]  # type: ignore[index]
    if not broken:
        return "None of these did."
    most = max(broken, key=lambda p: p.answer.result["fragments"])  # type: ignore[union-attr,index]
    return (
        f"The slowest that is in pieces at its last contact flies at {broken[0].speed:.3g} v*, the "
        f"fastest at {broken[-1].speed:.3g} v*; the most, "
        f"{most.answer.result['fragments']}, are there at "  # type: ignore[union-attr,index]
        f"{most.speed:.3g} v* (n = {most.particles})."
    )


def _kinematic(measured: Measurements) -> str:
    lows = ", ".join(
        f"η = {low.value:.3f}, e = {low.value**0.5:.3f} ({name})"
        for name, low in minima(measured).items()
    )
    return (
        f"η is a ratio of energies; e = √η, of speeds, is what others print. At the minima: {lows}."
    )
