"""Draw the dissipation of slow long chains on one curve in kappa v0 n^(2/3); not in the paper."""

from dataclasses import dataclass
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
from chaincor.workflows.reproduce.measurements import MeasuredPoint, Measurements, NoNumber, column
from chaincor.workflows.reproduce.plan import ReproductionPlan, Study

_KEY = "slow_chains"
_BONDS: dict[str, dict[str, Any]] = {
    "lj": {"potential": "lj"},
    **{f"toda, b = {b:g}": {"potential": "toda", "toda_b": b} for b in (3.0, 10.0, 30.0)},
    "log": {"potential": "log"},
}
_SHORTEST = 28
# Chains with a larger kappa v0 n^(2/3) are not slow at any computed length.
_LAST = 30.0
# Eta scatters with the phase of the last contacts. Results are therefore averaged over lengths
# within 6 % of each size. Toda chains with other b are similar, so one length is enough for them.
_PARTS = {name: np.linspace(0.94, 1.06, 5) for name in ("lj", "toda, b = 10", "log")}
_NEAR, _LONGEST_MEAN = 0.07, 1000
# The panel with the distances from the curve ends at this value of kappa v0 n^(2/3).
_SLOW = 5.0
# Chains with a larger kappa v0 have steep fronts and are not slow.
_FASTEST = 0.6
# Values of C that the paper gives for lj, from simulation and from its theory.
_PAPER_SLOPES = {"lj": (0.66, 2.61)}


def study(plan: ReproductionPlan) -> Study:
    """Return the scenes of chains with five bonds at equal kappa v0 n^(2/3)."""
    scenes = []
    for name, size, variable in product(_BONDS, plan.slow_sizes, plan.slow_variables):
        if variable > _FASTEST * size ** (2.0 / 3.0):
            continue
        # Only few chains are longer than a thousand particles, because the cost grows as the square
        # of the length.
        parts = _PARTS.get(name, (1.0,)) if size <= _LONGEST_MEAN else (1.0,)
        for n in sorted({round(size * part) for part in parts}):
            scene = Scene(**_BONDS[name], particles=n, velocity=1e-3, tolerance=plan.tolerance)
            velocity = float(f"{variable / slow_chain_variable(scene.bond, n, 1.0):.6g}")
            scenes.append(scene.replace(velocity=velocity))
    return Study(_KEY, "slow chains of five bonds", (), tuple(scenes))


def variable_of(point: MeasuredPoint) -> float:
    """Return kappa v0 n^(2/3) for a point."""
    scene = point.scene
    return slow_chain_variable(scene.bond, scene.particles, scene.impact_velocity)


def slow_long_chains(measured: Measurements) -> dict[str, list[MeasuredPoint]]:
    """Return, for each bond, all slow chains within the range of the curve."""
    points = {
        point.scene: point
        for key in (_KEY, "slopes", "sizes", "curves")
        for name in ("lj", "toda", "log")
        for point in measured.select(key, name)
    }
    found: dict[str, list[MeasuredPoint]] = {name: [] for name in _BONDS}
    for scene, point in points.items():
        variable, n = variable_of(point), point.particles
        if n >= _SHORTEST and variable <= min(_LAST, _FASTEST * n ** (2.0 / 3.0)):
            b = scene.toda_b or 10.0
            found[f"toda, b = {b:g}" if scene.label == "toda" else scene.label].append(point)
    return found


@dataclass(frozen=True)
class Mean:
    """Mean of n^(2/3) (1 - eta) over chains with equal bond, similar length and equal variable."""

    bond: str
    size: int
    variable: float
    chains: int
    scaled_loss: float
    error: float  #: Standard error of the mean, or the error bar of a single chain.
    #: Mean difference from the limiting curve, times n^(1/3).
    distance: float
    distance_error: float


def means(measured: Measurements) -> list[Mean]:
    """Return means over chains of nearly equal length, for each length in the plan."""
    found = []
    plan, groups = measured.plan, slow_long_chains(measured)
    for name, size, variable in product(_BONDS, plan.slow_sizes, plan.slow_variables):
        chosen = [
            p
            for p in groups[name]
            if abs(p.particles / size - 1.0) < _NEAR
            and abs(variable_of(p) / variable - 1.0) < 1e-4
            and np.isfinite(p.scaled_dissipation)
        ]
        if not chosen:
            continue
        n, losses = column(chosen, "particles"), column(chosen, "scaled_dissipation")
        distances = n ** (1.0 / 3.0) * (losses - float(limiting_loss(variable)))
        single = chosen[0].error * size ** (2.0 / 3.0)
        bars = [
            float(values.std(ddof=1) / len(values) ** 0.5) if len(values) > 1 else alone
            for values, alone in ((losses, single), (distances, single * size ** (1.0 / 3.0)))
        ]
        ends = float(losses.mean()), bars[0], float(distances.mean()), bars[1]
        found.append(Mean(name, size, variable, len(chosen), *ends))
    return found


def slopes_by_bond(measured: Measurements) -> list[dict[str, Any]]:
    """Return C for long chains with each bond: from theory, our longest chain, and the paper."""
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
    # Toda chains have the same C for every b.
    slopes = {row["bond"].partition(",")[0]: f"{row['slope']:.3f}" for row in rows}
    return (
        "In an infinite chain the harmonic part is gone and C is the limit of (1 − η)/(v₀/v*) as "
        f"v₀ → 0, taken after n → ∞. It is {STEEP_LIMIT} ± {STEEP_LIMIT_ERROR:g} times κ v* with "
        f"κ = −U‴(1), if h/y changes by less than {STEEP_LIMIT_ERROR:g} beyond y = 320, which is "
        + ", ".join(f"{slope} for {kind}" for kind, slope in slopes.items())
        + " (docs/explanation/slow_chains.md). Chains of finite length have n^(2/3) (1 − η) larger "
        f"by 2β n^(−1/3), β = {FRONT_LEAD:.4f}, less a term that falls faster; in the table "
        "is the longest chain of each bond beside theory with the first of these. The paper has "
        "0.66 and 2.61 for lj, and says that the two disagree. Its 0.66 is C of lj at no length "
        "and speed in particular: C is a function of y = κ v₀ n^(2/3)."
    )


def figure(measured: Measurements) -> Figure:
    """Return the figure of n^(2/3) (1 - eta) against kappa v0 n^(2/3), and of its limit."""
    rows = means(measured)
    sizes = sorted({row.size for row in rows})
    colors = dict(zip(_BONDS, CYCLE, strict=False))
    markers = dict(zip(sizes, MARKERS, strict=False))
    # Points of different bonds are drawn side by side, because they would hide each other.
    aside = {name: 1.0 + 0.05 * (place - 2) for place, name in enumerate(_BONDS)}

    def draw(above: Axes, below: Axes) -> None:
        y = np.geomspace(0.2, 1.5 * max(row.variable for row in rows), 120)
        theory = r"theory, $n\to\infty$: $h(y)$"
        above.plot(y, limiting_loss(y), color=BLACK, linewidth=1.0, label=theory)
        below.axhline(2.0 * FRONT_LEAD, color=BLACK, linewidth=1.0, label=r"theory: $2\beta$")
        below.axhline(0.0, color=GREY, linewidth=0.6)
        for row in rows:
            looks: dict[str, Any] = {
                "fmt": markers[row.size],
                "color": colors[row.bond],
                "markerfacecolor": "none",
                "markersize": 4.5,
                "linewidth": 0.9,
            }
            x = row.variable * aside[row.bond]
            above.errorbar(x, row.scaled_loss, row.error, **looks)
            if row.variable <= _SLOW:
                x = row.size * aside[row.bond]
                below.errorbar(x, row.distance, row.distance_error, **looks)
        for name, color in colors.items():
            above.plot([], [], "-", color=color, linewidth=3.0, label=name)
        for size, marker in markers.items():
            looks = {"color": GREY, "markerfacecolor": "none", "label": f"$n={size}$"}
            above.plot([], [], marker, **looks)
        above.set(xscale="log", yscale="log")
        above.set(xlabel=r"$y=\kappa v_0\,n^{2/3}$", ylabel=r"$n^{2/3}(1-\eta)$")
        below.set(xscale="log", xlabel=r"number of particles $n$")
        below.set_ylabel(r"$n^{1/3}\,[n^{2/3}(1-\eta)-h(y)]$")
        above.legend(loc="upper left", fontsize=8, ncols=2)
        below.legend(loc="lower right", fontsize=8)

    return Figure(
        key=_KEY,
        title="Beyond the paper: slow chains of all bonds on one curve",
        caption=(
            "A front that the wall sends into the chain steepens, because compressed bonds carry "
            "sound faster, and spreads, because short waves are slower. The ratio of both is "
            "y = κ v₀ n^(2/3), κ = −U‴(1). Above, n^(2/3)(1 − η) against y: colours are bonds, "
            "symbols are lengths. Each symbol is the mean over five lengths within 6 %, because η "
            "scatters with the phase of the last contacts; bars are standard errors of these "
            "means. Toda chains of b = 3 and 30 have one length each. Black: the limit of long "
            "chains, derived without a fit. Slow chains are harmonic there (h = 0.5626), fast ones "
            f"lose {STEEP_LIMIT} κ v₀. Below, the distance from the curve times n^(1/3), for y up "
            f"to {_SLOW:g}: theory has 2β = 1.99 for long chains (line), less a term that vanishes "
            "as n grows. Bonds are drawn side by side. The reference engine computed these chains."
        ),
        alt=(
            "Above, chains of five bonds lie along one curve, constant at first and then a "
            "straight line, with shorter chains above it when slow and below it when fast. Below, "
            "the distance times the cube root of n rises with the length towards the line at 1.99."
        ),
        draw=draw,
        records=[
            {
                "bond": row.bond,
                "particles": row.size,
                "chains": row.chains,
                "variable": row.variable,
                "scaled_loss": row.scaled_loss,
                "error": row.error,
                "limit": float(limiting_loss(row.variable)),
                "distance": row.distance,
                "distance_error": row.distance_error,
            }
            for row in rows
        ],
        size=(6.4, 7.4),
        panels=(1.5, 1.0),
    )
