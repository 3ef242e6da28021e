"""Draw restitution against speed for three bonds (NH figure 4), and judge claims about it."""

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np

from chaincor.analysis.figures.style import GREY
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.pages.typesetting import format_value
from chaincor.workflows.reproduce.claims import ClaimFinding, claim, words
from chaincor.workflows.reproduce.curve import Curve, Minimum, find_minimum, limit_at_zero
from chaincor.workflows.reproduce.drawing import (
    IMPACT_SPEED,
    Axes,
    Figure,
    draw_curves,
    point_record,
)
from chaincor.workflows.reproduce.measurements import MeasuredPoint, Measurements, NoNumber, column
from chaincor.workflows.reproduce.plan import PAPER_SIZE_SPEEDS, ReproductionPlan, Study, chains

# Differences and limits are compared with the range of eta in our curve for lj chains.
FALL = (0.26, "0.26, the fall of η of lj chains here")
_KEY = "restitution_curves"
# Bonds in the paper's order, with their names in the legend.
_BONDS = {"lj": "Lennard-Jones", "toda": r"Toda ($b=10$)", "log": "logarithmic"}
# The limit v0 -> 0 is found from this number of slowest speeds.
_SLOWEST = 4


def study(plan: ReproductionPlan) -> Study:
    """Return the scenes of chains with each of the three bonds at all speeds."""
    lengths, speeds = (plan.curve_particles,), plan.curve_speeds
    scenes = (chains(name, lengths, speeds, plan.tolerance) for name in _BONDS)
    return Study("curves", "η against speed, lj, toda, log", sum(scenes, ()))


def curves(measured: Measurements) -> dict[str, list[MeasuredPoint]]:
    """Return the points for each bond."""
    return {name: measured.select("curves", name) for name in _BONDS}


def minima(measured: Measurements) -> dict[str, Minimum]:
    """Return the minimum of eta(v) for each bond."""
    return {
        name: find_minimum(column(points, "speed"), column(points, "restitution"))
        for name, points in curves(measured).items()
    }


@claim(
    "section III",
    words(0.0, 0.0275, "0.0275, what the harmonic chain loses"),
    "slow chains are harmonic",
    text="η → η of the harmonic chain as v₀ → 0: difference 0 in the limit",
    key="low-speed limit",
    figure=_KEY,
)
def _low_speed_limit(measured: Measurements) -> ClaimFinding:
    harmonic = measured.select("harmonic_velocities", "harmonic", 1)[0]
    used = [
        measured.select("curves", name, _SLOWEST, f"fewer than {_SLOWEST} speeds")[:_SLOWEST]
        for name in _BONDS
    ]
    gaps = [harmonic.restitution - points[0].restitution for points in used]
    limits = [_limit(harmonic, points) for points in used]
    value, error = max(limits, key=lambda limit: abs(limit[0]))
    return ClaimFinding(
        value,
        error,
        f"η of the harmonic chain less η, limit v₀ → 0 of a parabola through the {_SLOWEST} "
        "slowest speeds, the largest of three; ± change if one speed is left out, with error "
        "bars; at "
        f"{used[0][0].speed:g} v* it is still {max(gaps, key=abs):.5f}",
        [p for points in used for p in points],
    )


def _limit(harmonic: MeasuredPoint, points: list[MeasuredPoint]) -> tuple[float, float]:
    """Return eta of the harmonic chain minus the limit of eta as v0 -> 0, and the error."""
    speeds, gaps = column(points, "speed"), harmonic.restitution - column(points, "restitution")
    limit, change = limit_at_zero(speeds, gaps, 2)
    weights = np.abs(np.linalg.pinv(np.vander(speeds, 3))[2])
    return limit, change + (float(weights @ column(points, "error")) + harmonic.error)


@claim(
    "sections III and IV",
    words(1.0),
    "the minimum of η at v*",
    text="minimum of η near v₀/v* = 1 (the abstract: at a certain velocity)",
    correction="it is at {value:.2f} v* on average",
    figure=_KEY,
)
def _place_of_the_minimum(measured: Measurements) -> ClaimFinding:
    every, lows = curves(measured), minima(measured)
    places = [low.place for low in lows.values()]
    described = []
    for name, low in lows.items():
        at_scale = [p.restitution for p in every[name] if p.speed == 1.0]
        higher = f" ({at_scale[0] - low.value:.3f} higher at v* itself)" if at_scale else ""
        described.append(f"{name}: η = {low.value:.4f} at {low.place:.2f} v*{higher}")
    return ClaimFinding(
        float(np.mean(places)),
        float(max(low.place_error for low in lows.values())),
        "mean of three potentials, each by a parabola through the three lowest points; ± change "
        f"with a parabola through five points; {'; '.join(described)}",
        [p for points in every.values() for p in points],
        (min(places), max(places)),
    )


@claim(
    "section III, figure 4; section IV",
    words(0.0, *FALL),
    "one curve η(v₀/v*) for all three bonds",
    text="η of lj, toda and log lies on almost the same curve: differences are 0",
    correction="they are up to {value:.3f} apart: log leaves the curve of the others",
    figure=_KEY,
)
def _one_curve(measured: Measurements) -> ClaimFinding:
    every = curves(measured)
    gaps, slow = [], {}
    for first, second in combinations(every, 2):
        by_speed = {p.speed: p for p in every[second]}
        pairs = [(p, by_speed[p.speed]) for p in every[first] if p.speed in by_speed]
        if not pairs:
            raise NoNumber("no common speeds")
        gaps.append(max(pairs, key=_gap))
        below = [_gap(pair) for pair in pairs if pair[0].speed < 1.0]
        slow[first, second] = max(below, default=np.nan)
    p, q = widest = max(gaps, key=_gap)
    largest, like = max(slow.values()), slow["lj", "toda"]
    return ClaimFinding(
        _gap(widest),
        p.error + q.error,
        "largest difference at one speed: "
        + "; ".join(
            f"{format_value(_gap((a, b)), a.error + b.error)} "
            f"({a.scene.label} and {b.scene.label}, at {a.speed:.3g} v*)"
            for a, b in gaps
        )
        + f"; below v* no two are more than {largest:.3f} apart, lj and toda no more than "
        f"{like:.3f}",
        [point for points in every.values() for point in points],
        brief=f"lj and toda within {like:.3f} below v*, log up to {largest:.2f} away below v* and "
        f"{_gap(widest):.2f} above it",
    )


def _gap(pair: tuple[MeasuredPoint, MeasuredPoint]) -> float:
    return abs(pair[0].restitution - pair[1].restitution)


def unit_of_speed(measured: Measurements) -> str:
    """Explain why the report gives all speeds as v0/v*."""
    lj = measured.select("curves", "lj", 1)
    natural = {name: Scene(potential=name, speed=1.0).impact_velocity for name in _BONDS}
    lows = {name: low.place for name, low in minima(measured).items()}
    absolute = [u / natural["lj"] for u in PAPER_SIZE_SPEEDS]
    lost = np.interp(np.log(absolute), np.log(column(lj, "speed")), column(lj, "dissipation"))
    return (
        'Section III begins with "we discuss the velocity dependence on the scale of v*", but '
        "captions print v₀ = 0.780 and text v = 1. Read as v₀/v*: minima of the three potentials "
        f"are at {_span(lows.values())} v*, but they are at "
        f"{_span(place * natural[name] for name, place in lows.items())} speeds of sound: only in "
        "v* are the minima at nearly the same place, and are lj and toda one curve. "
        "Read as speeds of sound, the five speeds of figure 5 would be "
        f"{', '.join(f'{u:.2g}' for u in absolute)} v*, where 1 − η of lj chains "
        f"(n = {lj[0].particles}) is {', '.join(f'{y:.3f}' for y in lost)}: the fastest would lose "
        "least, against the text, which has a constant there. So v₀ is taken as v₀/v* throughout."
    )


def _span(values: Iterable[float]) -> str:
    ordered = sorted(values)
    return f"{ordered[0]:.2f} to {ordered[-1]:.2f}"


def both_restitutions(measured: Measurements) -> str:
    """Give eta and e at the minima."""
    lows = ", ".join(
        f"η = {low.value:.3f}, e = {low.value**0.5:.3f} ({name})"
        for name, low in minima(measured).items()
    )
    return (
        f"η is a ratio of energies; e = √η, of speeds, is what others print. At the minima: {lows}."
    )


def figure(measured: Measurements) -> Figure:
    """Return the figure of eta against v0/v* for lj, toda and log chains."""
    every = curves(measured)

    def draw(ax: Axes) -> None:
        for chain in measured.select("harmonic_velocities", "harmonic")[:1]:
            eta, label = chain.restitution, "harmonic"
            ax.axhline(eta, color=GREY, linestyle="--", linewidth=1.0, label=label)
        draw_curves(
            ax, {_BONDS[name]: Curve.of(p, "speed", "restitution") for name, p in every.items()}
        )
        ax.set(xscale="log", xlabel=IMPACT_SPEED, ylabel=r"restitution $\eta = K_r/K_i$")
        ax.legend(loc="lower left")

    return Figure(
        key=_KEY,
        title="Restitution against speed for lj, toda and log chains",
        caption=(
            f"The paper's figure 4, n = {measured.plan.curve_particles}. Filled: LAMMPS; open: "
            f"the reference engine.{describe_open(every['lj'])}{_not_given(every['log'])} η is the "
            "paper's ratio of energies. Dashed: the harmonic chain, which all three approach at "
            f"low speed. Error bars are smaller than the symbols"
            f"{describe_bars(measured.points['curves'])}."
        ),
        alt=(
            "η of three bonds against speed: 0.97 when slow, a minimum of about 0.7 near 0.8 v*, 1 "
            "when fast; log rises earlier than the other two, which are one curve."
        ),
        draw=draw,
        records=[point_record(p) for p in measured.points["curves"]],
        size=(6.4, 4.2),
    )


def describe_open(points: Sequence[MeasuredPoint]) -> str:
    """Name the points of a curve that show the reference engine's result instead of LAMMPS's."""
    missed = [p for p in points if p.source == "reference" and len(p.answers) == 2]
    if not missed:
        return ""
    speeds = ", ".join(f"{p.speed:.3g}" for p in missed)
    return (
        f" At the open {missed[0].scene.label} points ({speeds} v*), LAMMPS "
        "misses the target error."
    )


def _not_given(points: Sequence[MeasuredPoint]) -> str:
    """Describe the fast chains that LAMMPS does not run, and the results shown instead."""
    ours = [p for p in points if p.lammps is not None and not p.lammps.result]
    integrated = [p.speed for p in points if p.source is not None and not p.is_limit]
    if not ours or not integrated:
        return ""
    last = max(p.speed for p in points if p.source == "lammps")
    text = (
        f" Above {last:.3g} v* LAMMPS does not run log chains, whose bonds "
        "would be compressed to nearly zero length. The reference engine "
        f"integrates them to {max(integrated):.2g} v*"
    )
    if any(p.is_limit for p in ours):
        text += (
            "; at higher speeds (crosses) they are set equal to hard spheres, with "
            "the bound on the error as error bar"
        )
    return text + "."


def describe_bars(points: Sequence[MeasuredPoint]) -> str:
    """Name the points with visible error bars; a symbol hides bars below about 0.005."""
    seen = [p for p in points if p.error > 0.0025]
    if not seen:
        return ""
    names = ", ".join(f"{p.scene.label} at {p.speed:.3g} v*{_left_open(p)}" for p in seen)
    return (
        ", except where a later contact could still come (dotted bars show its "
        f"possible effect; {names})"
        if all(p.is_open for p in seen)
        else f", except where roundings decide whether a late contact comes ({names})"
    )


def _left_open(point: MeasuredPoint) -> str:
    """Describe eta after the last computed contact, and how much later contacts could change it."""
    if not point.is_open:
        return ""
    eta, bar = point.restitution, point.error
    text = f", η = {eta:.4f} at the last contact seen"
    if len(point.answers) < 2:
        return text
    return (
        f"{text}, where the engines are {abs(point.difference):.1g} apart, between {eta - bar:.3f} "
        f"and {eta + bar:.3f} in the limit of all time"
    )
