"""Long lj chains (NH figure 5): does dissipation vanish as n grows, at a fixed v0/v*?"""

from typing import Any

import numpy as np

from chaincor.analysis.figures.style import CYCLE, GREY, MARKERS, new_figure
from chaincor.analysis.theory import harmonic_dissipation_law
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.pages.typesetting import format_fitted, format_value
from chaincor.workflows.reproduce.claims import Finding, claim, words
from chaincor.workflows.reproduce.drawing import Canvas, Figure, draw_points, point_record
from chaincor.workflows.reproduce.fits import PowerLaw, fit_dissipation, fit_rows
from chaincor.workflows.reproduce.measurements import Measurements, NoNumber, Point, Study
from chaincor.workflows.reproduce.plan import PAPER_SIZE_SPEEDS, Plan

_KEY = "lj_lengths"
_SLOW = PAPER_SIZE_SPEEDS[-1]
# The last part of each curve, from a fifth of its longest chain on: slow chains level off late.
_LAST_PART = 5.0
# LAMMPS's time goes as n^2 v0/v*; beyond this much a point takes 3 to 8 % of that of all.
_DEAREST = 3e5
# Where slow chains still look harmonic.
_BEFORE = (100, 1000)


def study(plan: Plan) -> Study:
    """Return lj chains of many lengths at the paper's speeds."""
    near = [(n, u) for u in PAPER_SIZE_SPEEDS for n in plan.sizes]
    far = [(n, u) for n, u in near if n * n * u > _DEAREST]
    far += [(n, u) for u, sizes in plan.far_sizes.items() for n in sizes]

    def chains(chosen: list[tuple[int, float]]) -> tuple[Scene, ...]:
        return tuple(
            Scene(potential="lj", particles=n, speed=u, tolerance=plan.tolerance) for n, u in chosen
        )

    return Study(
        "sizes",
        "lj chains of many lengths at five speeds",
        chains([pair for pair in near if pair not in far]),
        chains(far),
    )


def last_exponents(measured: Measurements) -> dict[float, tuple[PowerLaw, list[Point]]]:
    """Fit 1 - eta over the last part of each curve: the law and its points, by speed."""
    found = {}
    for speed in PAPER_SIZE_SPEEDS:
        points = measured.select("sizes", "lj", speed=speed)
        longest = max((p.particles for p in points), default=0)
        last = [p for p in points if p.particles >= longest / _LAST_PART]
        found[speed] = (fit_dissipation(last), last)
    return found


def fits(measured: Measurements) -> list[dict[str, Any]]:
    """Return the rows of the table of fits."""
    return [
        row
        for speed, (law, _) in last_exponents(measured).items()
        for row in fit_rows(f"1 − η, lj, {speed:g} v*", "n", [law], judged=1)
    ]


@claim(
    "section III, figure 5",
    '"in very low-velocity collision, as expected from the result for model A, … 1 − η will '
    "approach to zero\" in the thermodynamic limit: read as at a fixed v₀, with model A's "
    "exponent −2/3",
    words(-2.0 / 3.0),
    "1 − η of slow chains vanishes in the limit",
    key="long chains, slow",
    correction="at a fixed v₀ the exponent of the longest chains is {value:.2f}; if v₀ → 0 "
    "too, 1 − η does vanish",
    figure=_KEY,
)
def _long_chains_slow(measured: Measurements) -> Finding:
    points = last_exponents(measured)[_SLOW][1]
    lost = f"{points[-1].dissipation:.4f}" if points else "–"
    alone = [p.particles for p in points if p.agrees is None]
    return _exponent(
        measured,
        _SLOW,
        f". That {_SLOW:g} v*, its slowest, is very low, and that the law of model A is "
        f"expected there, is our reading{_before(measured)}. The paper's own eq. (18), "
        "which is for n → ∞, gives 1 − η = C v₀/v* > 0 at every v₀: read as v₀ → 0 as well, "
        "the statement holds"
        + (f". In-house alone from n = {min(alone)} on: no LAMMPS check there" if alone else ""),
        f"as we read it: at {_SLOW:g} v* 1 − η stays near {lost}, about "
        "C v₀/v*, as the paper's own eq. (18) implies; it vanishes if v₀ → 0 too",
    )


@claim(
    "section III, figure 5",
    "near v* 1 − η stays constant in the limit (at 0.78 v*: exponent 0)",
    words(0.0, 2.0 / 3.0, "2/3, the power that it is told from"),
    "dissipation of fast chains does not vanish in the limit",
    key="long chains, fast",
    figure=_KEY,
)
def _long_chains_fast(measured: Measurements) -> Finding:
    return _exponent(measured, PAPER_SIZE_SPEEDS[0])


def _exponent(measured: Measurements, speed: float, remark: str = "", brief: str = "") -> Finding:
    law, points = last_exponents(measured)[speed]
    if not points:
        raise NoNumber("no points")
    first, last = (format_value(p.dissipation, p.error) for p in (points[0], points[-1]))
    harmonic = float(harmonic_dissipation_law(np.array(points[-1].particles)))
    return Finding(
        law.exponent,
        law.exponent_error,
        f"exponent of 1 − η against n, {law.points} points, n = {law.first:.0f} to "
        f"{law.last:.0f}, where 1 − η goes from {first} to {last}; the harmonic law "
        f"ends at {harmonic:.4f}{remark}",
        points,
        brief=brief,
    )


def _before(measured: Measurements) -> str:
    """Say how 1 - eta of the slowest chains falls before it levels off."""
    points = measured.select("sizes", "lj", speed=_SLOW)
    law = fit_dissipation([p for p in points if _BEFORE[0] <= p.particles <= _BEFORE[1]])
    if not np.isfinite(law.exponent_error):
        return ""
    return (
        f"; from n = {law.first:.0f} to {law.last:.0f} it does fall, as the paper says (exponent "
        f"{law.exponent:.2f} ± {law.exponent_error:.2f}), and hardly beyond"
    )


def _falls(points: list[Point]) -> tuple[float, float]:
    """
    Return by how much 1 - eta falls from the first to the last of these, and the harmonic chain's.

    That of the harmonic chain is by its law, in shares of 1 - eta of the first point, as both are.
    """
    first, last = points[0].dissipation, points[-1].dissipation
    harmonic = harmonic_dissipation_law(np.array([points[0].particles, points[-1].particles]))
    return (first - last) / first, float(harmonic[0] - harmonic[1]) / first


def long_chains(measured: Measurements) -> str:
    """Say whether dissipation vanishes in long chains at some speed."""
    laws = {speed: found for speed, found in last_exponents(measured).items() if len(found[1]) > 1}
    if not laws:
        return "Too few lengths to say."
    parts = [
        f"{format_value(points[-1].dissipation, points[-1].error)} at {speed:g} v* "
        f"(n = {points[-1].particles}; exponent from n = {points[0].particles} on "
        f"{law.exponent:z.3f})"
        for speed, (law, points) in laws.items()
    ]
    ends = [(points[0].particles, points[-1].particles) for _, points in laws.values()]
    longest, factors = [last for _, last in ends], [last / first for first, last in ends]
    # By the harmonic law 1 - eta itself would fall by these shares.
    expected = [1.0 - factor ** (-2.0 / 3.0) for factor in factors]
    both = [_falls(points) for _, points in laws.values()]
    falling = any(2.0 * ours > share for (ours, _), share in zip(both, expected, strict=True))
    answer = "At some of these speeds it still falls" if falling else "No sign that it does"
    rest = (
        " What still falls is no more than the vanishing harmonic part."
        if all(ours <= harmonic for ours, harmonic in both)
        else ""
    )
    return (
        f"{answer}, up to n = {min(longest)} to {max(longest)}: over the last factor of "
        f"{min(factors):.2g} to {max(factors):.2g} in n, 1 − η changes by "
        f"{_percent([-ours for ours, _ in both])}, where by the harmonic law, of exponent −2/3, it "
        f"would by {_percent([-share for share in expected])}.{rest} Exponents are not exactly 0, "
        "and bars of fits to "
        "three or four points are formal. 1 − η of the longest chains: "
        + "; ".join(parts)
        + ". A slow chain looks harmonic until (v₀/v*) n^(2/3) is about 1 (see [the figure of C]"
        "(#slope))."
    )


def _percent(shares: list[float]) -> str:
    low, high = (f"{100.0 * share:+.1f}" for share in (min(shares), max(shares)))
    return f"{low} to {high} %"


def middle_speeds(measured: Measurements) -> str:
    """Say what is found at the speeds that the paper plots without a word."""
    laws = last_exponents(measured)
    parts = [
        f"at {speed:g} v* 1 − η = {points[-1].dissipation:.4f} at n = "
        f"{points[-1].particles}, exponent {law.exponent:z.2f} from n = {points[0].particles} "
        f"to {points[-1].particles}"
        for speed, (law, points) in laws.items()
        if points and speed in PAPER_SIZE_SPEEDS[1:-1]
    ]
    return (
        "The paper plots them without a word, so there is no verdict. They change by a few per "
        "cent at most: " + "; ".join(parts) + "."
    )


def figure(measured: Measurements) -> Figure:
    """Return 1 - eta against n for lj chains at the paper's speeds, and the harmonic chain's."""
    points = {speed: measured.select("sizes", "lj", speed=speed) for speed in PAPER_SIZE_SPEEDS}
    harmonic = measured.select("harmonic_sizes", "harmonic")
    return Figure(
        key=_KEY,
        title="Dissipation of Lennard-Jones chains against their length, at five speeds",
        caption=(
            "The paper's figure 5, carried on to longer chains. Filled: LAMMPS; open: in-house. "
            "Grey: the harmonic chain, whose dissipation vanishes as n^(−2/3). A curve that levels "
            "off stays finite in the limit of long chains; there is no sign here that "
            "one does not. Exponent of 1 − η from a fifth of the longest chain on: "
            + ", ".join(
                f"{format_fitted(law.exponent, law.exponent_error)} at {speed:.3f} v* "
                f"({law.points} points to n = {last[-1].particles})"
                for speed, (law, last) in last_exponents(measured).items()
                if last
            )
            + ". Bars of fits to three or four points are formal: their scatter alone."
        ),
        records=[point_record(p) for ps in points.values() for p in ps],
        draw=lambda: _draw(points, [p for p in harmonic if p.particles >= 10]),
        alt=(
            "1 − η against n at five speeds: flat at 0.78, 0.39 and 0.16 v*; falling and then flat "
            "at 0.078 and 0.008 v*, while the harmonic chain goes on falling."
        ),
    )


def _draw(points: dict[float, list[Point]], harmonic: list[Point]) -> Canvas:
    canvas, ax = new_figure(figsize=(6.4, 4.4))
    x, y = [p.particles for p in harmonic], [p.dissipation for p in harmonic]
    ax.plot(x, y, ".", color=GREY, markersize=2.5, label="harmonic")
    for (speed, group), color, marker in zip(points.items(), CYCLE, MARKERS, strict=False):
        x, y = [p.particles for p in group], [p.dissipation for p in group]
        label = rf"$v_0 = {speed:.3f}\,v^*$"
        draw_points(ax, group, x, y, color=color, marker=marker, label=label, line=True)
    ax.set(xscale="log", yscale="log", xlabel=r"number of particles $n$")
    ax.set_ylabel(r"dissipation $1-\eta$")
    ax.legend(loc="lower left", ncols=2)
    return canvas
