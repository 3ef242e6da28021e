"""Dissipation of harmonic chains against their length (NH figure 3), and its law (NH eq. 12)."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, VERMILION, new_figure
from chaincor.analysis.slow_chains.curve import FRONT_LEAD
from chaincor.analysis.theory import (
    HARMONIC_DISSIPATION_COEFFICIENT,
    harmonic_dissipation_law,
    harmonic_dissipation_limit,
)
from chaincor.workflows.reproduce.claims import Finding, claim, digits, words
from chaincor.workflows.reproduce.drawing import Canvas, Figure, draw_points, point_record
from chaincor.workflows.reproduce.fits import PowerLaw, fit_dissipation, fit_over_lengths, fit_rows
from chaincor.workflows.reproduce.measurements import (
    Measurements,
    Point,
    Study,
    harmonic_scene,
)
from chaincor.workflows.reproduce.plan import Plan

# The factor that the paper prints in eq. (12).
_PAPER_FACTOR = 0.652
_POWER = -2.0 / 3.0
# The fits that are judged begin here: shorter chains are not on the law, as figure 3 shows.
_LAW_FROM = 100
# How far they depend on the range is told by these.
_RANGES = ((30, 300), (100, 1000), (200, 2000), (500, 20000), (1000, 20000))
_PREFACTOR_RANGES = ((100, 1000), (1000.5, 3000), (3000.5, 20000))
# So many lengths within 6 %: they scatter by the phase of the last contacts.
_PHASES = 7
_PARTS = np.linspace(0.94, 1.06, _PHASES)


def study(plan: Plan) -> Study:
    """Return harmonic chains of all lengths: by LAMMPS, and by the echo of their free end."""
    return Study(
        "harmonic_sizes",
        "harmonic chains of many lengths",
        tuple(harmonic_scene(n, plan.tolerance) for n in plan.harmonic_sizes),
        echoed=tuple(
            harmonic_scene(n, plan.tolerance)
            for n in plan.harmonic_far_sizes
            if n not in plan.harmonic_sizes
        ),
    )


def study_of_longest(plan: Plan) -> Study:
    """Return harmonic chains around the lengths that the limit is found from."""
    lengths = [round(n * part) for n in plan.harmonic_longest for part in _PARTS]
    return Study(
        "harmonic_longest",
        "harmonic chains, for the limit of long ones",
        (),
        echoed=tuple(harmonic_scene(n, plan.tolerance) for n in lengths),
    )


@dataclass(frozen=True)
class Group:
    """Mean and standard error of n^(2/3) (1 - eta) over lengths around one."""

    particles: int
    mean: float
    error: float


@dataclass(frozen=True)
class Longest:
    """Groups of very long harmonic chains, and the limit of n^(2/3) (1 - eta) from them."""

    groups: tuple[Group, ...]
    limit: float
    limit_error: float


def longest_chains(measured: Measurements) -> Longest:
    """Take the chains around each of the longest sizes to n -> infinity."""
    sizes, points = measured.plan.harmonic_longest, measured.points["harmonic_longest"]
    n = np.array([point.particles for point in points], dtype=float)
    factors = np.array([_scaled(point) for point in points])
    grouped = factors.reshape(-1, _PHASES)
    errors = grouped.std(axis=1, ddof=1) / _PHASES**0.5
    weights = 1.0 / np.repeat(errors, _PHASES) / _PHASES**0.5
    design = np.column_stack((np.ones_like(n), n**_POWER)) * weights[:, None]
    known = (factors - 2.0 * FRONT_LEAD * n ** (-1.0 / 3.0)) * weights
    limit = float(np.linalg.lstsq(design, known, rcond=None)[0][0])
    error = float(np.linalg.inv(design.T @ design)[0, 0] ** 0.5)
    means = zip(sizes, grouped.mean(axis=1), errors, strict=True)
    return Longest(tuple(Group(k, float(m), float(e)) for k, m, e in means), limit, error)


@dataclass(frozen=True)
class HarmonicLaw:
    """The law 1 - eta = A n^p for harmonic chains."""

    #: All from n = 100 on (all there are if none is so long): what is fitted and judged.
    points: list[Point]
    #: A and p fitted; A alone, with p = -2/3.
    both: PowerLaw
    mean_prefactor: PowerLaw  #: See ``both``.
    #: Both, and A alone, fitted over other ranges.
    ranges: list[PowerLaw]
    prefactors: list[PowerLaw]  #: See ``ranges``.


def harmonic_law(measured: Measurements) -> HarmonicLaw:
    """Fit the law."""
    points = measured.select("harmonic_sizes", "harmonic")
    long = [p for p in points if p.particles >= _LAW_FROM] or points
    return HarmonicLaw(
        points=long,
        both=fit_dissipation(long),
        mean_prefactor=fit_dissipation(long, _POWER),
        ranges=fit_over_lengths(points, _RANGES),
        prefactors=fit_over_lengths(points, _PREFACTOR_RANGES, _POWER),
    )


def fits(measured: Measurements) -> list[dict[str, Any]]:
    """Return the rows of the table of fits."""
    law, what = harmonic_law(measured), "1 − η, harmonic"
    return [
        *fit_rows(what, "n", [law.both, *law.ranges], judged=1),
        *fit_rows(what, "n", [law.mean_prefactor, *law.prefactors], judged=1),
    ]


def _span(values: list[float]) -> tuple[float, float] | None:
    return (min(values), max(values)) if values else None


@claim(
    "eq. (12)",
    "1 − η ∝ n^(−2/3) agrees very well",
    words(_POWER),
    "1 − η ∝ n^(−2/3)",
    figure="harmonic_lengths",
)
def _harmonic_exponent(measured: Measurements) -> Finding:
    law = harmonic_law(measured)
    fit = law.both
    return Finding(
        fit.exponent,
        fit.exponent_error,
        f"fit to {fit.points} points, n = {fit.first:.0f} to {fit.last:.0f}; over other ranges "
        "see [the fits](#fits)",
        law.points,
        _span([f.exponent for f in law.ranges]),
    )


@claim(
    "eq. (12)",
    "1 − η = 0.652 n^(−2/3) for long chains agrees very well: the limit of n^(2/3)(1 − η)",
    words(_PAPER_FACTOR),
    "the factor 0.652 of eq. (12)",
    correction="the limit is {value:.3f}; chains near n = 6000 have 0.652, longer ones less",
    figure="harmonic_lengths",
)
def _harmonic_prefactor(measured: Measurements) -> Finding:
    law = harmonic_law(measured)
    longest = longest_chains(measured)
    by_range = ", ".join(
        f"{fit.prefactor:.3f} ± {fit.prefactor_error:.3f} (n = {fit.first:.0f} to {fit.last:.0f})"
        for fit in law.prefactors
    )
    means = ", ".join(
        f"{group.mean:.4f} ± {group.error:.4f} (n = {group.particles})" for group in longest.groups
    )
    return Finding(
        longest.limit,
        longest.limit_error,
        f"limit of exact collisions around n = {means} (each {_PHASES} lengths within 6 %), less "
        "the lead of the front, 2β n^(−1/3) with β = "
        f"{FRONT_LEAD:.4f}, and a term in n^(−2/3) that is fitted; derived without a fit it is "
        f"{harmonic_dissipation_limit():.4f}. The mean falls with the length: {by_range}. Judged "
        "as words, because the paper says that the law agrees very well, and as the limit, because "
        "it is derived as that",
        law.points,
    )


@claim("eq. (12)", "0.652 follows from eqs. (7)–(11)", digits("0.652"), "how 0.652 is derived")
def _formula_prefactor(measured: Measurements) -> Finding:
    return Finding(
        HARMONIC_DISSIPATION_COEFFICIENT,
        0.0,
        "the closed form of the integral that the printed approximation leads to, with "
        "v² = (π²/8) v₀²",
    )


def _scaled(point: Point) -> float:
    return point.dissipation * point.particles ** (2.0 / 3.0)


def figure(measured: Measurements) -> Figure:
    """Return 1 - eta against n for harmonic chains, and what is left without the law."""
    points, law = measured.select("harmonic_sizes", "harmonic"), harmonic_law(measured)
    fit = law.both
    return Figure(
        key="harmonic_lengths",
        title="Dissipation of harmonic chains against their length",
        caption=(
            "The paper's figure 3. Filled: LAMMPS; open: more lengths, by the echo of their free "
            f"end; n = 2, which loses nothing, has no place. 1 − η ∝ n^p, n = {fit.first:.0f} to "
            f"{fit.last:.0f}: p = {fit.exponent:.3f} ± {fit.exponent_error:.3f}; over other ranges "
            "see [the fits](#fits). Below, n^(2/3)(1 − η): its scatter is no noise (error bars are "
            "smaller than the dots), but comes from the last contacts, whose times change with n. "
            f"Its mean falls with the length, to {harmonic_dissipation_limit():.4f} (dotted), the "
            "limit of a front that disperses as Airy's function; black dots: means over "
            f"{_PHASES} lengths of longer chains; solid: 0.652, the limit of the paper's "
            "approximate formula, which they fall through."
        ),
        records=[point_record(point) for point in points],
        draw=lambda: _draw(
            [p for p in points if p.particles >= 3],
            law.mean_prefactor,
            longest_chains(measured).groups,
        ),
        alt=(
            "1 − η falls along a straight line of slope −2/3 from n = 30 on; below, multiplied by "
            "n^(2/3), it scatters between 0.6 and 0.85 around 0.68, less the longer the chain, and "
            "its mean falls through 0.652 to 0.62 at n = 30000, above the dotted limit of 0.5626."
        ),
    )


def _draw(points: list[Point], mean: PowerLaw, longest: tuple[Group, ...]) -> Canvas:
    canvas, (ax, below) = new_figure(
        2, 1, figsize=(6.4, 5.6), sharex=True, height_ratios=(1.5, 1.0)
    )
    n = np.geomspace(3, max(p.particles for p in points), 60)
    fitted = n[n >= 0.98 * mean.first]
    for source, label, size in (("in-house", "in-house", 2.8), ("lammps", "LAMMPS", 4.5)):
        chosen = [p for p in points if p.source == source]
        x = [p.particles for p in chosen]
        looks: dict[str, Any] = {"color": BLUE, "label": label, "size": size}
        draw_points(ax, chosen, x, [p.dissipation for p in chosen], **looks)
        draw_points(below, chosen, x, [_scaled(p) for p in chosen], **looks)
    ax.plot(n, harmonic_dissipation_law(n), color=BLACK, label=r"paper: $0.652\,n^{-2/3}$")
    label = rf"${mean.prefactor:.2f}\,n^{{-2/3}}$ (fit, all points from $n={mean.first:.0f}$)"
    dashed: dict[str, Any] = {"color": VERMILION, "linestyle": "--", "linewidth": 1.0}
    ax.plot(fitted, mean.at(fitted), label=label, **dashed)
    ax.set(yscale="log", ylabel=r"dissipation $1-\eta$")
    ax.legend(loc="lower left")
    below.axhline(HARMONIC_DISSIPATION_COEFFICIENT, color=BLACK)
    below.axhline(harmonic_dissipation_limit(), color=BLACK, linestyle=":")
    below.plot(fitted, np.full_like(fitted, mean.prefactor), **dashed)
    sizes, means = [g.particles for g in longest], [g.mean for g in longest]
    below.plot(sizes, means, ".", color=BLACK, markersize=7.0, label="means, longer chains")
    below.set(xscale="log", ylim=(0.25, 1.5), ylabel=r"$n^{2/3}(1-\eta)$")
    below.set_xlabel(r"number of particles $n$")
    return canvas
