"""Figure beyond the paper: dissipation of slow long chains on one curve of kappa v0 n^(2/3)."""

from itertools import product
from typing import Any

import numpy as np

from chaincor.analysis.figures.style import BLACK, CYCLE, GREY, MARKERS
from chaincor.analysis.pair_theory import pair_interval_slope
from chaincor.analysis.slow_chains.curve import (
    FRONT_LEAD,
    STEEP_LIMIT,
    STEEP_LIMIT_ERROR,
    limiting_loss,
    long_chain_slope,
    slow_chain_dissipation,
    slow_chain_variable,
)
from chaincor.analysis.theory import low_speed_dissipation_slope
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.drawing import Axes, Figure
from chaincor.workflows.reproduce.measurements import Measurements, NoNumber, Point, column
from chaincor.workflows.reproduce.plan import Plan, Study

_KEY = "slow_chains"
_BONDS: dict[str, dict[str, Any]] = {
    "lj": {"potential": "lj"},
    **{f"toda, b = {b:g}": {"potential": "toda", "toda_b": b} for b in (3.0, 10.0, 30.0)},
    "log": {"potential": "log"},
}
_SHORTEST = 30
# Chains beyond this value are not slow at any computed length.
_LAST = 30.0
# Sizes of symbols, by the smallest length of their chains.
_SYMBOLS = {30: 2.0, 96: 3.2, 307: 4.6, 983: 6.2, 3146: 8.0}
# Largest kappa v0 of a slow chain. Faster chains have steep fronts.
_FASTEST = 0.6
# Values of C in the paper, for lj alone: from simulation, and from its theory.
_PAPER_SLOPES = {"lj": (0.66, 2.61)}


def study(plan: Plan) -> Study:
    """Return chains of five bonds at equal kappa v0 n^(2/3), for the reference engine."""
    scenes = []
    for bond, n, variable in product(_BONDS.values(), plan.slow_sizes, plan.slow_variables):
        scene = Scene(**bond, particles=n, velocity=1e-3, tolerance=plan.tolerance)
        velocity = float(f"{variable / slow_chain_variable(scene.bond, n, 1.0):.6g}")
        if variable <= _FASTEST * n ** (2.0 / 3.0):
            scenes.append(scene.replace(velocity=velocity))
    return Study(_KEY, "slow chains of five bonds", (), tuple(scenes))


def variable_of(point: Point) -> float:
    """Return kappa v0 n^(2/3) of a point."""
    scene = point.scene
    return slow_chain_variable(scene.bond, scene.particles, scene.impact_velocity)


def slow_long_chains(measured: Measurements) -> dict[str, list[Point]]:
    """Return all slow chains within the range of the curve, by bond."""
    points = {
        point.scene: point
        for key in (_KEY, "slopes", "sizes", "curves")
        for name in ("lj", "toda", "log")
        for point in measured.select(key, name)
    }
    found: dict[str, list[Point]] = {name: [] for name in _BONDS}
    for scene, point in points.items():
        variable, n = variable_of(point), point.particles
        if n >= _SHORTEST and variable <= min(_LAST, _FASTEST * n ** (2.0 / 3.0)):
            b = scene.toda_b or 10.0
            found[f"toda, b = {b:g}" if scene.label == "toda" else scene.label].append(point)
    return found


def slopes_by_bond(measured: Measurements) -> list[dict[str, Any]]:
    """Return C of long chains by bond: derived, from our longest chain, and from the paper."""
    rows = []
    for name, group in slow_long_chains(measured).items():
        steep = [p for p in group if variable_of(p) >= 8.0]
        if not steep:
            continue
        longest = max(steep, key=lambda p: (p.particles, variable_of(p)))
        scene, bond = longest.scene, longest.scene.bond
        derived = long_chain_slope(bond)
        simulated, theory = _PAPER_SLOPES.get(name, (None, None))
        loss = slow_chain_dissipation(bond, scene.particles, scene.impact_velocity)
        rows.append(
            {
                "bond": name,
                "steepness": derived / STEEP_LIMIT,
                "slope": derived,
                "error": derived * STEEP_LIMIT_ERROR / STEEP_LIMIT,
                "measured": longest.dissipation / longest.speed,
                "particles": scene.particles,
                "variable": variable_of(longest),
                "expected": loss / longest.speed,
                "paper_simulation": simulated,
                "paper_theory": theory,
                "corrected_theory": low_speed_dissipation_slope(pair_interval_slope(bond)),
            }
        )
    return rows


def infinite_chain(measured: Measurements) -> str:
    """Describe the limit of C as n goes to infinity."""
    rows = slopes_by_bond(measured)
    if not rows:
        raise NoNumber("Too few long chains to say.")
    # The C of Toda chains does not depend on b.
    slopes = {row["bond"].partition(",")[0]: f"{row['slope']:.3f}" for row in rows}
    return (
        "In an infinite chain the harmonic part is gone and C is the limit of (1 − η)/(v₀/v*) as "
        f"v₀ → 0, taken after n → ∞. It follows without a fit: {STEEP_LIMIT}(8) κ v* with "
        "κ = −U‴(1), which is "
        + ", ".join(f"{slope} for {kind}" for kind, slope in slopes.items())
        + " (docs/explanation/slow_chains.md). Chains of finite length have n^(2/3) (1 − η) larger "
        f"by 2β n^(−1/3), β = {FRONT_LEAD:.4f}, less a term that falls faster; in the table "
        "is the longest chain of each bond beside theory with the first of these. The paper has "
        "0.66 and 2.61 for lj, and says that the two disagree. Its 0.66 is C of lj at no length "
        "and speed in particular: C is a function of κ v₀ n^(2/3), 1.012 in the limit."
    )


def figure(measured: Measurements) -> Figure:
    """Return the figure of n^(2/3) (1 - eta) against kappa v0 n^(2/3), and of its approach."""
    groups = slow_long_chains(measured)
    every = [p for group in groups.values() for p in group]
    longest = max((p.particles for p in every), default=0)
    checked = [p for p in every if p.agrees is not None]

    def draw(above: Axes, below: Axes) -> None:
        y = np.geomspace(0.1, _LAST, 120)
        above.plot(y, limiting_loss(y), color=BLACK, linewidth=1.0, label=r"theory, $n\to\infty$")
        below.axhline(2.0 * FRONT_LEAD, color=BLACK, linewidth=1.0, label=r"$2\beta$")
        for (name, group), color, marker in zip(groups.items(), CYCLE, MARKERS, strict=False):
            n, scaled = column(group, "particles"), column(group, "scaled_dissipation")
            y = np.array([variable_of(p) for p in group])
            looks: dict[str, Any] = {"color": color, "markerfacecolor": "none"}
            above.plot([], [], marker, label=name, markersize=4.0, **looks)
            # Longer chains have larger symbols.
            for lower, size in _SYMBOLS.items():
                chosen = (n >= lower) & (n < 3.2 * lower)
                above.plot(y[chosen], scaled[chosen], marker, markersize=size, **looks)
            looks["markersize"] = 4.0
            slow = y <= 5.0
            distance = n ** (1.0 / 3.0) * (scaled - limiting_loss(y) if y.size else scaled)
            below.plot(n[slow], distance[slow], marker, **looks)
        above.set(xscale="log", yscale="log", xlim=(0.1, 40.0))
        above.set(xlabel=r"$y=\kappa v_0\,n^{2/3}$", ylabel=r"$n^{2/3}(1-\eta)$")
        below.axhline(0.0, color=GREY, linewidth=0.6)
        below.set(xscale="log", xlabel=r"number of particles $n$")
        below.set_ylabel(r"$n^{1/3}\,[n^{2/3}(1-\eta)-h(y)]$")
        for ax in (above, below):
            ax.legend(loc="best", fontsize=8)

    return Figure(
        key=_KEY,
        title="Beyond the paper: slow chains of all bonds on one curve",
        caption=(
            "A front that the wall sends into the chain steepens, because compressed bonds carry "
            "sound faster, and spreads, because short waves are slower: y = κ v₀ n^(2/3), "
            "κ = −U‴(1), is the ratio of the two. Above, n^(2/3)(1 − η) of "
            f"{len(every)} chains, n = {_SHORTEST} to {longest}, against y, with larger symbols "
            "for longer chains (from 30, 96, 307, 983 and 3146 on); black, the limit of "
            "long chains h(y), derived without a fit. Slow or short chains are harmonic "
            "(h = 0.5626), long ones lose 0.3751 κ v₀. Toda chains of three b are one. Below, the "
            "distance from the curve times n^(1/3), for y up to 5: theory has 2β = 1.99 of it for "
            "long chains (line), less what falls faster; dots at one length differ by the phase of "
            f"the last contacts. {len(checked)} of the chains are by LAMMPS as well."
        ),
        alt=(
            "Above, chains of five bonds lie along one curve, constant at first and then a "
            "straight line, short ones above it when slow and below it when fast. Below, the "
            "distance times the cube root of n rises from about 0 at 30 particles to between 1.1 "
            "and 1.9 at 1000 to 3000, below the line at 1.99."
        ),
        draw=draw,
        records=[
            {
                "bond": name,
                "particles": p.particles,
                "velocity": p.scene.impact_velocity,
                "variable": variable_of(p),
                "scaled_loss": p.scaled_dissipation,
                "error": p.error * p.particles ** (2.0 / 3.0),
                "limit": float(limiting_loss(variable_of(p))),
            }
            for name, group in groups.items()
            for p in group
        ],
        size=(6.4, 7.4),
        panels=(1.5, 1.0),
    )
