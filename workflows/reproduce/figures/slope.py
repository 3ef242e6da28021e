"""The constant C of the low-speed law, 1 - eta = C v0/v* (NH eq. 18), against speed and length."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import cycle, product
from typing import TYPE_CHECKING, Any

import numpy as np

from chaincor.analysis.figures.style import BLACK, CYCLE, MARKERS, VERMILION, new_figure
from chaincor.analysis.pair_theory import pair_interval_slope
from chaincor.analysis.slow_chains.curve import (
    STEEP_LIMIT,
    limiting_loss,
    long_chain_slope,
)
from chaincor.analysis.theory import low_speed_dissipation_slope
from chaincor.lammps_inputs.bonds.potentials import LennardJones, Logarithmic, Toda
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.claims import TREND, Finding, claim, digits, words
from chaincor.workflows.reproduce.drawing import IMPACT_SPEED, Figure, draw_points
from chaincor.workflows.reproduce.figures.increase import increase_records
from chaincor.workflows.reproduce.fits import PowerLaw, fit_rows, parameter_errors
from chaincor.workflows.reproduce.low_speed import (
    FIT_RANGE,
    RANGES,
    Increase,
    increase_of,
    lj_increases,
)
from chaincor.workflows.reproduce.measurements import (
    Measurements,
    NoNumber,
    Point,
    Study,
    harmonic_scene,
)
from chaincor.workflows.reproduce.plan import Plan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

_KEY = "slope"
# What the paper prints for the shortening of the interval of two lj particles, and for C.
_PAPER_ALPHA = 0.808
_PAPER_SLOPE = 2.61
# Shorter chains are not in the limit of long ones.
_SHORTEST = 100
# Where (v0/v*) n^(2/3) is larger than these, the harmonic part of the dissipation is small.
BEYOND_HARMONIC = (3.5, 5.0, 8.0)
# And up to these speeds a straight line does; the range of C is that over all these cuts.
FASTEST = (0.05, 0.12, 0.2, 0.31)
_LEAST_POINTS = 4


def study(plan: Plan) -> Study:
    """Return lj and harmonic chains of several lengths at low speed."""

    def chains(lengths: tuple[int, ...]) -> tuple[Scene, ...]:
        tolerance = plan.tolerance
        return (
            *(harmonic_scene(n, tolerance) for n in lengths),
            *(
                Scene(potential="lj", particles=n, speed=u, tolerance=tolerance)
                for n in lengths
                for u in plan.slope_speeds
            ),
        )

    return Study(
        "slopes", "initial slope C, lj", chains(plan.slope_sizes), chains(plan.slope_far_sizes)
    )


def theoretical_slope() -> float:
    """Return the C that follows from the paper's theory for lj, 4 alpha."""
    return low_speed_dissipation_slope(pair_interval_slope(LennardJones()))


@claim(
    "eq. (18)",
    "C = 32α/π² = 2.61",
    digits("2.61"),
    "C = 32α/π² = 2.61",
    correction="it is {value:.2f} with the paper's own α",
)
def _printed_constant(measured: Measurements) -> Finding:
    return Finding(32.0 * _PAPER_ALPHA / np.pi**2, 0.0, f"32α/π² with α = {_PAPER_ALPHA}")


@claim(
    "eq. (18)",
    "C = 2.61 follows from eqs. (7)–(10) and (15)",
    digits("2.61"),
    "how C = 2.61 is derived",
    correction="with the factor v²/v₀² = π²/8 that was dropped, C = 4α = {value:.2f}",
)
def _theoretical_slope(measured: Measurements) -> Finding:
    return Finding(
        theoretical_slope(),
        0.0,
        "4α: eq. (7) with v² = (π²/8) v₀² kept, as the 0.652 of the harmonic law has it; see "
        "eqs. (16), (18) among the [slips](#slips)",
    )


def _lj_increases(measured: Measurements) -> dict[int, Increase]:
    found = lj_increases(measured)
    if not found:
        raise NoNumber("no points")
    return found


def _all_slopes(found: dict[int, Increase]) -> list[float]:
    """Return C of all lengths over all ranges."""
    slopes = [increase.slope(*ends).prefactor for increase in found.values() for ends in RANGES]
    return [value for value in slopes if np.isfinite(value)]


@claim(
    "section III",
    "simulation: C = 0.66",
    digits("0.66"),
    "C = 0.66 of the simulation",
    correction="{value:.2f} at n = 100",
    unsaid="over which range of speeds, nor for which length",
    figure=_KEY,
)
def _simulated_slope(measured: Measurements) -> Finding:
    found = _lj_increases(measured)
    shortest = found[min(found)]
    fit, used = shortest.slope(*FIT_RANGE), shortest.within(*FIT_RANGE)
    known = _all_slopes(found)
    lengths = ", ".join(f"{i.slope(*FIT_RANGE).prefactor:.2f} (n = {n})" for n, i in found.items())
    ends = f"{used[0].speed:.3g} to {used[-1].speed:.3g} v*" if used else "no points"
    return Finding(
        fit.prefactor,
        fit.prefactor_error,
        f"line through the origin, {len(used)} points, {ends}; by length: {lengths}; over "
        "other ranges see [the fits](#fits); for n → ∞ see [beyond the paper](#beyond)",
        used,
        (min(known), max(known)) if known else None,
    )


@claim(
    "after eq. (18)",
    '"the constant C is not in accord": theory and simulation disagree',
    TREND,
    "theory and simulation disagree on C, as the authors say",
    figure=_KEY,
)
def _not_in_accord(measured: Measurements) -> Finding:
    slopes = _all_slopes(_lj_increases(measured))
    if not slopes:
        raise NoNumber("no points")
    theory = theoretical_slope()
    return Finding(
        float(min(_PAPER_SLOPE, theory) > max(slopes)),
        0.0,
        f"theory: {_PAPER_SLOPE} as printed, {theory:.2f} with the dropped factor put back, which "
        f"is further still from every simulated value, {min(slopes):.2f} to {max(slopes):.2f} "
        "here; the authors say so themselves",
    )


@claim(
    "after eq. (18)",
    "1 − η ∝ v^p, p = 1, agrees with simulation at low speed (lj)",
    words(1.0),
    "dissipation of lj chains grows as v₀",
    figure=_KEY,
)
def _power_lj(measured: Measurements) -> Finding:
    found = _lj_increases(measured)
    limit = found[min(found)].limit_finding(3)
    return replace(limit, text=f"n = {min(found)}: {limit.text}")


@claim(
    "after eq. (18)",
    '"the exponent is the same for other types of chains": p = 1 for toda and log',
    words(1.0),
    "that of toda and log chains too",
    figure="restitution_curves",
)
def _power_of_other_types(measured: Measurements) -> Finding:
    baseline = measured.select("harmonic_velocities", "harmonic")
    powers = {}
    for name in ("toda", "log"):
        increase = increase_of(measured.select("curves", name), baseline)
        if increase is None:
            raise NoNumber("no points")
        powers[name] = increase.limit_finding(3)
    farthest = max(powers.values(), key=lambda finding: abs(finding.value - 1.0))
    described = ", ".join(
        f"{name} {finding.value:.3f} ± {finding.error:.3f}" for name, finding in powers.items()
    )
    text = f"of two the one further from 1, {described}: {farthest.text}"
    return replace(farthest, text=text)


CLAIMS = (
    _printed_constant,
    _theoretical_slope,
    _simulated_slope,
    _not_in_accord,
    _power_lj,
    _power_of_other_types,
)


def scaled_speed(point: Point) -> float:
    """
    Return the one variable that decides in slow collisions of long chains.

    Nonlinearity steepens a front by a share v0/v* of the way it goes, 2n; dispersion widens it as
    n^(1/3). Their ratio is (v0/v*) n^(2/3).
    """
    return point.speed * point.particles ** (2.0 / 3.0)


def slow_long_chains(measured: Measurements) -> list[Point]:
    """Return the lj points near the limit of low speed and long chains, by scaled speed."""
    points = {
        (p.particles, p.speed): p
        for study in ("slopes", "sizes")
        for p in measured.select(study, "lj")
        if p.particles >= _SHORTEST and p.speed <= FASTEST[-1]
    }
    return sorted(points.values(), key=scaled_speed)


@dataclass(frozen=True)
class SlopeLimit:
    """
    C in the limit of long chains, taken before that of low speed.

    Attributes
    ----------
    value, error : float
        Limit of (1 - eta)/(v0/v*) as v0 -> 0 of a straight line, and its error: of the scatter,
        and of what the points' bars allow.
    least_scaled_speed, fastest : float
        The line is fitted to points between these.
    points : int
        How many.
    """

    value: float
    error: float
    least_scaled_speed: float
    fastest: float
    points: int


def slope_limits(measured: Measurements) -> list[SlopeLimit]:
    """Fit the limit over each pair of cuts that leaves at least four points."""
    points = slow_long_chains(measured)
    limits = []
    for least, fastest in product(BEYOND_HARMONIC, FASTEST):
        chosen = [p for p in points if scaled_speed(p) >= least and p.speed <= fastest]
        if len(chosen) < _LEAST_POINTS:
            continue
        speeds = np.array([p.speed for p in chosen])
        chords = np.array([1.0 - p.restitution for p in chosen]) / speeds
        bars = np.array([p.error for p in chosen]) / speeds
        design = np.column_stack((np.ones_like(speeds), speeds))
        line = np.linalg.lstsq(design, chords, rcond=None)[0]
        error = parameter_errors(design, chords - design @ line, bars)[0]
        limits.append(SlopeLimit(float(line[0]), float(error), least, fastest, len(chosen)))
    return limits


def middle(limits: list[SlopeLimit]) -> float:
    """Return the median of the fits; nan if there are none."""
    return float(np.median([limit.value for limit in limits])) if limits else float("nan")


def describe_limits(limits: list[SlopeLimit]) -> str:
    """
    Write what is known of the limit: ``0.98, between 0.93 and 1.03 as cuts have it``.

    Fits with different cuts exclude each other, so that no single bar is that of the limit.
    """
    if not limits:
        return "unknown: too few points"
    low = min(limit.value - limit.error for limit in limits)
    high = max(limit.value + limit.error for limit in limits)
    return (
        f"about {middle(limits):.2f}, between {low:.2f} and {high:.2f} as the cuts have it "
        f"({len(limits)} straight lines in v₀ through the points with (v₀/v*) n^(2/3) above "
        f"{_several(limit.least_scaled_speed for limit in limits)} and v₀/v* up to "
        f"{_several(limit.fastest for limit in limits)})"
    )


def _several(values: Iterable[float]) -> str:
    *first, last = [f"{value:g}" for value in sorted(set(values))]
    return f"{', '.join(first)} or {last}" if first else last


def fits(measured: Measurements) -> list[dict[str, Any]]:
    """Return the rows of the table of fits."""
    rows = []
    for n, increase in lj_increases(measured).items():
        slopes = [increase.slope(*ends) for ends in RANGES]
        known = [slope for slope in slopes if slope.points > 1]
        judged = int(slopes[0].points > 1)
        rows += fit_rows(f"increase, lj, n = {n}", "v₀/v*", known, judged)
    for limit in slope_limits(measured):
        what = f"1 − η, lj, n → ∞, (v₀/v*) n^(2/3) > {limit.least_scaled_speed:g}"
        law = PowerLaw(1.0, 0.0, limit.value, limit.error, 0.0, limit.fastest, limit.points)
        rows += fit_rows(what, "v₀/v*", [law], judged=1)
    return rows


def infinite_chain(measured: Measurements) -> str:
    """Say what becomes of C as n goes to infinity."""
    peaks = [
        f"{float(np.max(increase.values / increase.speeds)):.2f} (n = {n})"
        for n, increase in lj_increases(measured).items()
    ]
    return (
        "In an infinite chain the harmonic part is gone and C is the limit of (1 − η)/(v₀/v*) as "
        f"v₀ → 0, taken after n → ∞. It can be derived: {STEEP_LIMIT}(2) κ v* with κ = −U‴(1), "
        "which is "
        + ", ".join(
            f"{long_chain_slope(bond):.2f} for {bond.name}"
            for bond in (LennardJones(), Toda(), Logarithmic())
        )
        + " (see docs/explanation/slow_chains.md). Measured on lj, it depends on which points a "
        "straight line is put through, by more than the bars of the fits: C is "
        + describe_limits(slope_limits(measured))
        + f". {_checked(measured)} The paper has 0.66 and 2.61, and says that the two disagree: "
        "our numbers agree with it on that, and with the dropped factor put back the theory gives "
        f"{theoretical_slope():.2f}, further still "
        "from every simulated value. Largest (η_harmonic − η)/(v₀/v*) at one length: "
        + ", ".join(peaks)
        + "."
    )


def _checked(measured: Measurements) -> str:
    """Say how many of the points of the limit LAMMPS has as well."""
    points = [p for p in slow_long_chains(measured) if scaled_speed(p) >= BEYOND_HARMONIC[0]]
    checked = [p for p in points if p.agrees is not None]
    longest = max((p.particles for p in checked), default=0)
    return (
        f"Of the {len(points)} points, {len(checked)} are by LAMMPS as well (to n = {longest}), "
        "the others by the in-house engine alone."
    )


def figure(measured: Measurements) -> Figure:
    """
    Return the increase divided by the speed for lj chains, and the scaling of long chains.

    Above, constant where 1 - eta grows as C v; below, all lengths on one curve.
    """
    found = lj_increases(measured)
    compared = max((n for n, i in found.items() if i.points[0].agrees is not None), default=0)
    return Figure(
        key=_KEY,
        title="The constant C of the low-speed law, against speed and length",
        caption=(
            "Above, (η_harmonic − η)/(v₀/v*) of lj chains (filled: LAMMPS; open: in-house): a law "
            "1 − η = C v₀/v* would be a horizontal line. The paper prints 0.66 from its simulation "
            "and 2.61 from its theory, and says that they disagree: the theory with its dropped "
            "factor put back gives 3.24, further still from every value here. C depends on the "
            f"speed and on n. In this part chains beyond {compared} are by the "
            "in-house engine alone. Below, chains of all lengths from 100 on, up to "
            f"{FASTEST[-1]:g} v*, fall nearly on one curve of x = (v₀/v*) n^(2/3), the fastest "
            "below it. A front that the wall sends into the chain steepens, because compressed "
            "bonds carry sound faster, and spreads, because short waves are slower: x is the ratio "
            "of the two. Slow or short chains are harmonic (a constant), long ones follow y = C x, "
            "however slow, while v₀ ≪ v*; black, the limit of long chains without a fit, to which "
            "chains come as n^(−1/3). For C of an "
            "infinite chain see [beyond the paper](#beyond)."
        ),
        records=increase_records(found, "length"),
        draw=lambda: _draw(found, slow_long_chains(measured), slope_limits(measured)),
        alt=(
            "Above, curves rise with speed, the higher the longer the chain, and fall again. "
            "Below, all lengths lie nearly on one curve, constant at 0.65 and then a straight line."
        ),
    )


def _draw(found: dict[int, Increase], long: list[Point], limits: list[SlopeLimit]) -> "Canvas":
    canvas, (ax, below) = new_figure(2, 1, figsize=(6.4, 7.0))
    for (n, i), color, marker in zip(found.items(), CYCLE, MARKERS, strict=False):
        u, y, bars = i.speeds, i.values / i.speeds, i.errors / i.speeds
        ax.plot(u, y, color=color, linewidth=0.8, alpha=0.6)
        draw_points(ax, i.points, u, y, errors=bars, color=color, marker=marker, label=f"$n={n}$")
    ax.axhline(0.66, color=BLACK, linewidth=1.0, linestyle="--", label="paper, simulation: 0.66")
    ax.set(xscale="log", ylim=(0.0, 1.1), xlabel=IMPACT_SPEED)
    ax.set_ylabel(r"$(\eta_{\rm harmonic}-\eta)\,/\,(v_0/v^*)$")
    ax.legend(loc="lower right", ncols=2)
    _draw_scaling(below, long, limits)
    return canvas


def _draw_scaling(ax: "Axes", points: list[Point], limits: list[SlopeLimit]) -> None:
    import matplotlib as mpl

    lengths = sorted({p.particles for p in points})
    shades = mpl.colormaps["viridis"](np.linspace(0.0, 0.92, len(lengths)))
    for n, color, marker in zip(lengths, shades, cycle(MARKERS), strict=False):
        group = [p for p in points if p.particles == n]
        x = [scaled_speed(p) for p in group]
        y = [p.dissipation * n ** (2.0 / 3.0) for p in group]
        open_: dict[str, Any] = {"markersize": 4.5, "markerfacecolor": "none"}
        ax.plot(x, y, marker, color=color, label=f"$n={n}$", **open_)
    reach = np.geomspace(0.1, 30.0, 30)
    # Up to y = 30, where the table ends; lj has y = kappa v* x.
    steepness = long_chain_slope(LennardJones()) / STEEP_LIMIT
    known = np.geomspace(0.1, 30.0 / steepness, 60)
    loss = limiting_loss(np.minimum(steepness * known, 30.0))
    ax.plot(known, loss, color=BLACK, linewidth=0.9, label=r"theory, $n\to\infty$")
    if limits:
        value = middle(limits)
        label = rf"$y=C\,x$, $C={value:.2f}$"
        ax.plot(reach, value * reach, "--", color=VERMILION, linewidth=1.0, label=label)
    ax.set(xscale="log", yscale="log", ylim=(0.3, 40.0))
    ax.set(xlabel=r"$x=(v_0/v^*)\,n^{2/3}$", ylabel=r"$y=(1-\eta)\,n^{2/3}$")
    ax.legend(loc="upper left", ncols=2, fontsize=8)
