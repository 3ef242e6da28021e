"""Harmonic chains (NH section II): contacts at n = 500, the law in n, independence of v0."""

from dataclasses import dataclass

import numpy as np

from chaincor.analysis.contacts import contact_statistics
from chaincor.analysis.theory import HARMONIC_DISSIPATION_COEFFICIENT
from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.fits import PowerLaw, fit_over_ranges, fit_power_law
from chaincor.workflows.reproduce.measurements import Measurements, Point

# The paper's numbers in brackets are from a chain of this length.
PAPER_CHAIN = 500
# Shorter chains are not on the law.
_SHORTEST = 30
_PREFACTOR_RANGES = ((30, 200), (200, 1000), (1000, 3001), (3001, 20001))
_RANGES = ((10, 100), (30, 300), (100, 1000), (200, 2000), (1000, 20000), (30, 20000))


@dataclass(frozen=True)
class HarmonicLaw:
    """
    The law 1 - eta = A n^p for harmonic chains.

    Attributes
    ----------
    both : PowerLaw
        Both fitted, all points from n = 100 on.
    by_lammps : PowerLaw
        Both fitted, LAMMPS points from n = 30 on.
    mean_prefactor : PowerLaw
        A alone, p = -2/3, all points from n = 200 on (from n = 30 if there are none).
    ranges : list of PowerLaw
        Both fitted over several ranges, all points.
    """

    both: PowerLaw
    by_lammps: PowerLaw
    mean_prefactor: PowerLaw
    ranges: list[PowerLaw]


def harmonic_law(measured: Measurements) -> HarmonicLaw:
    """Fit the law."""
    points = measured.select("harmonic_sizes", "harmonic")
    ours = [p for p in points if p.source == "lammps" and p.particles >= _SHORTEST]
    long = [p for p in points if p.particles >= 200] or [
        p for p in points if p.particles >= _SHORTEST
    ]
    return HarmonicLaw(
        both=fit_power_law(*_coordinates([p for p in points if p.particles >= 100])),
        by_lammps=fit_power_law(*_coordinates(ours)),
        mean_prefactor=fit_power_law(*_coordinates(long), exponent=-2.0 / 3.0),
        ranges=fit_over_ranges(*_coordinates(points), _RANGES),
    )


def _coordinates(points: list[Point]) -> tuple[list[int], list[float]]:
    return [p.particles for p in points], [1.0 - p.restitution for p in points]


def _medians(points: list[Point]) -> str:
    parts = []
    for first, last in _PREFACTOR_RANGES:
        within = [
            (1.0 - p.restitution) * p.particles ** (2.0 / 3.0)
            for p in points
            if first <= p.particles < last
        ]
        if within:
            parts.append(f"{np.median(within):.3f} ({first} to {last})")
    return ", ".join(parts)


def harmonic_findings(measured: Measurements, law: HarmonicLaw) -> dict[str, Finding]:
    """Return what is found on harmonic chains, by the key of the rule that judges it."""
    points = measured.select("harmonic_sizes", "harmonic")
    fitted = [p for p in points if p.particles >= _SHORTEST]
    fit, ours, mean = law.both, law.by_lammps, law.mean_prefactor
    scatter = [(1.0 - p.restitution) * p.particles ** (2.0 / 3.0) for p in fitted] or [np.nan]
    return {
        **_paper_chain(points),
        "contact time": _contact_time(points),
        "harmonic exponent": Finding(
            fit.exponent,
            fit.exponent_error,
            f"fit to {fit.points} points, n = {fit.first:.0f} to {fit.last:.0f}; LAMMPS alone "
            f"{ours.exponent:.3f} ± {ours.exponent_error:.3f}, n = {ours.first:.0f} to "
            f"{ours.last:.0f}; by range "
            + ", ".join(f"{f.exponent:.2f} ({f.first:.0f} to {f.last:.0f})" for f in law.ranges),
            fitted,
        ),
        "harmonic prefactor": Finding(
            mean.prefactor,
            mean.prefactor_error,
            f"exponent fixed at -2/3, {mean.points} points, n = {mean.first:.0f} to "
            f"{mean.last:.0f}; single lengths from {min(scatter):.2f} to {max(scatter):.2f}; "
            f"median by range: {_medians(points)}",
            fitted,
        ),
        "formula prefactor": Finding(
            HARMONIC_DISSIPATION_COEFFICIENT,
            0.0,
            "the closed form of the integral that the printed approximation leads to, with "
            "v² = (π²/8) v₀²",
        ),
        "independence of v0": _independence(measured),
    }


def _paper_chain(points: list[Point]) -> dict[str, Finding]:
    chain = [p for p in points if p.particles == PAPER_CHAIN]
    nan = Finding(float("nan"), float("nan"), f"no result at n = {PAPER_CHAIN}")
    if not chain or chain[0].answer is None:
        return dict.fromkeys(("interval", "contacts per particle", "incoming speed"), nan)
    point = chain[0]
    arrays = point.answer.arrays  # type: ignore[union-attr]
    velocity = point.scene.impact_velocity
    numbers = contact_statistics(
        arrays["contact_times"], arrays["contact_speeds"], point.particles, velocity
    )
    assert numbers.mean_interval is not None
    assert numbers.mean_speed is not None
    where = f"n = {PAPER_CHAIN}, {point.engine_name}"
    return {
        "interval": Finding(
            numbers.mean_interval,
            1e-4,
            f"mean over {numbers.count - 1} intervals, {where}; "
            f"median {numbers.median_interval:.4f}",
            chain,
        ),
        "contacts per particle": Finding(
            numbers.per_particle,
            0.0,
            f"{numbers.count} contacts, {where}; the paper's 0.867 would be "
            f"{0.867 * PAPER_CHAIN:.1f} contacts, which is no whole number",
            chain,
        ),
        "incoming speed": Finding(
            numbers.mean_speed,
            1e-4,
            f"mean over {numbers.count} contacts, {where}; momentum alone asks for "
            f"n(1 + √η)/(2f) = "
            f"{(1.0 + point.restitution**0.5) / (2.0 * numbers.per_particle):.4f}",
            chain,
        ),
    }


def _contact_time(points: list[Point]) -> Finding:
    long = [p for p in points if p.particles >= 100]
    if not long:
        return Finding(float("nan"), float("nan"), "no chain of 100 or more")
    ratios = [p.answer.result["last_contact_time"] / (p.particles - 1.0) for p in long]  # type: ignore[union-attr,index]
    last = max(long, key=lambda p: p.particles)
    return Finding(
        float(np.mean(ratios)),
        float(np.ptp(ratios)) / 2.0,
        f"mean of t_c/τ over {len(long)} chains, n = {min(p.particles for p in long)} to "
        f"{last.particles}; {ratios[long.index(last)]:.4f} for the longest",
        long,
    )


def _independence(measured: Measurements) -> Finding:
    points = measured.select("harmonic_velocities", "harmonic")
    ours = [p for p in points if p.source == "lammps"]
    if len(ours) < 2:
        return Finding(float("nan"), float("nan"), "fewer than two velocities")
    etas = [p.restitution for p in ours]
    velocities = [p.scene.impact_velocity for p in ours]
    return Finding(
        float(np.ptp(etas)),
        2.0 * max(p.error for p in ours),
        f"largest difference of η between {len(ours)} velocities from {min(velocities):g} to "
        f"{max(velocities):g}, n = {ours[0].particles}, LAMMPS",
        points,
    )
