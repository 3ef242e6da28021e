"""Draw the dissipation of harmonic chains against their length (NH figure 3), and its power law."""

from functools import partial
from typing import Any

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, VERMILION
from chaincor.analysis.slow_chains.curve import FRONT_LEAD
from chaincor.analysis.theory import (
    HARMONIC_DISSIPATION_COEFFICIENT,
    harmonic_dissipation_law,
    harmonic_dissipation_limit,
)
from chaincor.workflows.reproduce.claims import ClaimFinding, claim, digits, words
from chaincor.workflows.reproduce.curve import Curve, PowerLaw, fit_rows
from chaincor.workflows.reproduce.drawing import Axes, Figure, draw_points, point_record
from chaincor.workflows.reproduce.measurements import Measurements, column
from chaincor.workflows.reproduce.plan import ReproductionPlan, Study, harmonic_chains

_KEY = "harmonic_lengths"
# The paper prints this power in eq. (12).
_POWER = -2.0 / 3.0
# The judged fits begin at this length, because shorter chains in figure 3 do not follow the law.
_LAW_FROM = 100
# Fits over these ranges show how the result depends on the range.
_RANGES = ((30, 300), (100, 1000), (200, 2000), (500, 20000), (1000, 20000))
_PREFACTOR_RANGES = ((100, 1000), (1000.5, 3000), (3000.5, 20000))
# Eta scatters with the phase of the last contacts. Each point is therefore an average over this
# many lengths, from 6 % below to 6 % above the nominal length.
_PHASES = 7
_PARTS = np.linspace(0.94, 1.06, _PHASES)


def study(plan: ReproductionPlan) -> Study:
    """Return the scenes of harmonic chains of all lengths, for LAMMPS and for the echo method."""
    near, tolerance = plan.harmonic_sizes, plan.tolerance
    far = harmonic_chains([n for n in plan.harmonic_far_sizes if n not in near], tolerance)
    title = "harmonic chains of many lengths"
    return Study("harmonic_sizes", title, harmonic_chains(near, tolerance), echoed=far)


def study_of_longest(plan: ReproductionPlan) -> Study:
    """Return the scenes of harmonic chains from which the limit of long chains is found."""
    lengths = [round(n * part) for n in plan.harmonic_longest for part in _PARTS]
    scenes = harmonic_chains(lengths, plan.tolerance)
    title = "harmonic chains, for the limit of long ones"
    return Study("harmonic_longest", title, (), echoed=scenes)


def _longest_chains(
    measured: Measurements,
) -> tuple[list[tuple[int, float, float]], float, float]:
    """
    Extrapolate n^(2/3) (1 - eta) from the longest chains to n -> infinity.

    Return, for each size, the size, the mean of n^(2/3) (1 - eta) over similar lengths, and the
    standard error of this mean. Also return the limit and its error.
    """
    points = measured.points["harmonic_longest"]
    n, factors = column(points, "particles"), column(points, "scaled_dissipation")
    grouped = factors.reshape(-1, _PHASES)
    errors = grouped.std(axis=1, ddof=1) / _PHASES**0.5
    weights = 1.0 / np.repeat(errors, _PHASES) / _PHASES**0.5
    design = np.column_stack((np.ones_like(n), n**_POWER)) * weights[:, None]
    known = (factors - 2.0 * FRONT_LEAD * n ** (-1.0 / 3.0)) * weights
    limit = float(np.linalg.lstsq(design, known, rcond=None)[0][0])
    error = float(np.linalg.inv(design.T @ design)[0, 0] ** 0.5)
    means = grouped.mean(axis=1).tolist()
    groups = zip(measured.plan.harmonic_longest, means, errors.tolist(), strict=True)
    return list(groups), limit, error


def _curve(measured: Measurements) -> Curve:
    return Curve.of(measured.select("harmonic_sizes", "harmonic"), "particles", "dissipation")


def _long(measured: Measurements) -> Curve:
    """Return the chains that are long enough for fits; all chains if none is."""
    curve = _curve(measured)
    long = curve.between(_LAW_FROM, np.inf)
    return long if long.points else curve


def _laws(measured: Measurements, power: float | None = None) -> list[PowerLaw]:
    """Fit 1 - eta = A n^p to the long chains and over other ranges; `power`, if given, fixes p."""
    fit = partial(Curve.power_law, exponent=power)
    ranges = _RANGES if power is None else _PREFACTOR_RANGES
    return [fit(_long(measured)), *_curve(measured).over(ranges, fit)]


@claim(
    "eq. (12)",
    words(_POWER),
    "1 − η ∝ n^(−2/3)",
    text="1 − η ∝ n^(−2/3) agrees very well",
    figure=_KEY,
)
def _harmonic_exponent(measured: Measurements) -> ClaimFinding:
    fit, *others = _laws(measured)
    exponents = [other.exponent for other in others]
    return ClaimFinding(
        fit.exponent,
        fit.exponent_error,
        f"fit to {fit.points} points, n = {fit.first:.0f} to {fit.last:.0f}; over other ranges "
        "see [the fits](#fits)",
        _long(measured).points,
        (min(exponents), max(exponents)) if exponents else None,
    )


@claim(
    "eq. (12)",
    digits("0.652"),
    "0.652 as the limit of long harmonic chains",
    text="1 − η = 0.652 n^(−2/3) for long chains agrees very well: the limit of n^(2/3)(1 − η)",
    correction="the limit is {value:.3f}; chains near n = 6000 have 0.652, longer ones less",
    figure=_KEY,
)
def _harmonic_prefactor(measured: Measurements) -> ClaimFinding:
    groups, limit, error = _longest_chains(measured)
    by_range = ", ".join(
        f"{fit.prefactor:.3f} ± {fit.prefactor_error:.3f} (n = {fit.first:.0f} to {fit.last:.0f})"
        for fit in _laws(measured, _POWER)[1:]
    )
    means = ", ".join(
        f"{mean:.4f} ± {bar:.4f} (n = {particles})" for particles, mean, bar in groups
    )
    return ClaimFinding(
        limit,
        error,
        f"limit of exact collisions around n = {means} (each {_PHASES} lengths "
        "within 6 %), less the lead of the front, 2β n^(−1/3) with β = "
        f"{FRONT_LEAD:.4f}, and a term in n^(−2/3) that is fitted; derived "
        f"without a fit it is {harmonic_dissipation_limit():.4f}. The mean "
        f"falls with the length: {by_range}. The claim is judged by its digits "
        "and as a limit, because the paper derives it for long chains",
        _long(measured).points,
    )


@claim("eq. (12)", digits("0.652"), "how 0.652 is derived", text="0.652 follows from eqs. (7)–(11)")
def _formula_prefactor(measured: Measurements) -> ClaimFinding:
    return ClaimFinding(
        HARMONIC_DISSIPATION_COEFFICIENT,
        0.0,
        "the closed form of the integral that the printed approximation leads to, with "
        "v² = (π²/8) v₀²",
    )


def figure(measured: Measurements) -> Figure:
    """Return the figure of 1 - eta, and of its ratio to the law, against n for harmonic chains."""
    points = measured.select("harmonic_sizes", "harmonic")
    laws, factors = _laws(measured), _laws(measured, _POWER)
    fit, mean = laws[0], factors[0]
    groups = _longest_chains(measured)[0]

    def draw(ax: Axes, below: Axes) -> None:
        drawn = [p for p in points if p.particles >= 3]
        n = np.geomspace(3, max(p.particles for p in drawn), 60)
        fitted = n[n >= 0.98 * mean.first]
        for source, label, size in (
            ("reference", "reference engine", 2.8),
            ("lammps", "LAMMPS", 4.5),
        ):
            chosen = [p for p in drawn if p.source == source]
            curve = Curve.of(chosen, "particles", "dissipation")
            factors = curve.x**-_POWER
            scaled = Curve(chosen, curve.x, curve.y * factors, curve.errors * factors)
            for panel, shown in ((ax, curve), (below, scaled)):
                draw_points(panel, shown, color=BLUE, label=label, size=size)
        ax.plot(n, harmonic_dissipation_law(n), color=BLACK, label=r"paper: $0.652\,n^{-2/3}$")
        label = rf"${mean.prefactor:.2f}\,n^{{-2/3}}$ (fit, all points from $n={mean.first:.0f}$)"
        dashed: dict[str, Any] = {"color": VERMILION, "linestyle": "--", "linewidth": 1.0}
        ax.plot(fitted, mean.at(fitted), label=label, **dashed)
        ax.set(yscale="log", ylabel=r"dissipation $1-\eta$")
        ax.legend(loc="lower left")
        below.axhline(HARMONIC_DISSIPATION_COEFFICIENT, color=BLACK, label="paper: 0.652")
        limit = harmonic_dissipation_limit()
        below.axhline(limit, color=BLACK, linestyle=":", label=f"limit: {limit:.4f}")
        below.plot(fitted, np.full_like(fitted, mean.prefactor), label="fit", **dashed)
        sizes, means, _ = zip(*groups, strict=True)
        below.plot(sizes, means, ".", color=BLACK, markersize=7.0, label="means, longer chains")
        below.set(xscale="log", ylim=(0.25, 1.5), ylabel=r"$n^{2/3}(1-\eta)$")
        below.set_xlabel(r"number of particles $n$")
        below.legend(loc="upper right", ncols=3, fontsize=7)

    return Figure(
        key=_KEY,
        title="Dissipation of harmonic chains against their length",
        caption=(
            "The paper's figure 3. Filled: LAMMPS; open: more lengths, by the echo "
            "of the free end. The chain with n = 2 loses nothing and is not shown. "
            f"1 − η ∝ n^p, n = {fit.first:.0f} to {fit.last:.0f}: p = "
            f"{fit.exponent:.3f} ± {fit.exponent_error:.3f}; over other ranges see "
            "[the fits](#fits). Below: n^(2/3)(1 − η). Its scatter is no noise, "
            "because error bars are smaller than the dots. It comes from the last "
            "contacts, whose times change with n. The mean falls with the length "
            f"to {harmonic_dissipation_limit():.4f} (dotted), the limit of a front "
            "that disperses as an Airy function. Black dots are means over "
            f"{_PHASES} lengths of longer chains. They fall below the solid line, "
            "which is 0.652, the limit of the paper's approximate formula."
        ),
        alt=(
            "1 − η falls along a straight line of slope −2/3 from n = 30 on; "
            "below, n^(2/3)(1 − η) scatters between 0.6 and 0.85 around 0.68, with "
            "less scatter for longer chains, and its mean falls below 0.652 to "
            "0.62 at n = 30000, above the dotted limit of 0.5626."
        ),
        draw=draw,
        records=[point_record(p) for p in points],
        fits=[row for of in (laws, factors) for row in fit_rows("n", {"1 − η, harmonic": of})],
        size=(6.4, 5.6),
        panels=(1.5, 1.0),
        sharex=True,
    )
