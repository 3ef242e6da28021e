"""Low speed: the increase of dissipation (NH figure 6), the slope C, and alpha of the pair."""

from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import BLACK, BLUE, CYCLE, GREY, MARKERS, VERMILION, new_figure
from chaincor.analysis.pair_theory import pair_interval, pair_interval_slope
from chaincor.analysis.theory import HARMONIC_DISSIPATION_COEFFICIENT, PAIR_INTERVAL
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.workflows.reproduce.figures.figure import Figure
from chaincor.workflows.reproduce.figures.measured_points import draw_points
from chaincor.workflows.reproduce.findings.long_limit import (
    FASTEST,
    SlopeLimit,
    middle,
    scaled_speed,
    slope_limits,
    slow_long_chains,
)
from chaincor.workflows.reproduce.findings.low_speed import (
    FIT_RANGE,
    PAPER_SLOPES,
    Increase,
    increases,
    lj_increases,
    pair_alphas,
)
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.plan import PAPER_ORDERS
from chaincor.workflows.reproduce.tables import Table, table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas


def _table(found: dict[int, Increase], name: str) -> Table:
    return table_of(
        [
            {
                name: key,
                "particles": point.particles,
                "speed": float(u),
                "increase": float(y),
                "increase_error": float(e),
                "source": point.source,
                "agrees": point.agrees,
            }
            for key, increase in found.items()
            for point, u, y, e in zip(
                increase.points, increase.speeds, increase.values, increase.errors, strict=True
            )
        ]
    )


def _draw_increase(ax: "Axes", increase: Increase, scale: ArrayLike, **looks: Any) -> None:
    values, errors = increase.values / np.asarray(scale), increase.errors / np.asarray(scale)
    draw_points(ax, increase.points, increase.speeds, values, errors=errors, line=False, **looks)


def increase_figure(measured: Measurements) -> Figure:
    """Return the increase of dissipation for r = 3, 4, 5, with fitted and printed slopes."""
    found = increases(measured)
    worst = max(
        (float(np.max(np.abs(i.errors / i.values))) for i in found.values()), default=float("nan")
    )
    fastest = max((float(i.speeds[-1]) for i in found.values()), default=float("nan"))
    return Figure(
        key="increase",
        title="Increase of dissipation for potentials of order 3, 4 and 5",
        caption=(
            f"The paper's figure 6, n = {measured.plan.curve_particles}: 1 − η of chains with "
            "U = s²/2 + c s^r less that of the harmonic chain. Full lines: power laws fitted from "
            f"{FIT_RANGE[0]} to {FIT_RANGE[1]} v*; dashed: the paper's slopes, whose range it does "
            f"not say, through the same middle. Data go on to {fastest:g} v*. Below, the local "
            "power d ln(η_harmonic − η)/d ln v₀, from neighbouring points: it tends to r − 2 "
            "(dotted) at low speed, rises, and jumps where the number of contacts changes, so that "
            "a fitted slope depends on its range. "
            f"c is {_constants()}; its sign is the paper's, which stiffens compression, and its "
            "size does not matter: with strains in units of |c|^(−1/(r−2)), as v* is, c is ±1. "
            "The largest error "
            f"bar is {100 * worst:.2g} % of the increase it belongs to."
        ),
        table=_table(found, "power_order"),
        draw=lambda: _draw_orders(found),
        alt=(
            "Three nearly straight lines of slopes near 1, 2 and 3; below, their local powers "
            "begin at 1, 2 and 3 and leave them above 0.02 to 0.1 v*."
        ),
    )


def _constants() -> str:
    return ", ".join(f"{c:g} (r = {order})" for order, c in PAPER_ORDERS.items())


def _draw_orders(found: dict[int, Increase]) -> "Canvas":
    figure, (ax, below) = new_figure(
        2, 1, figsize=(6.4, 6.0), sharex=True, height_ratios=(1.6, 1.0)
    )
    for (order, increase), colour, marker in zip(found.items(), CYCLE, MARKERS, strict=False):
        fit, slope = increase.fit(*FIT_RANGE), PAPER_SLOPES[order]
        label = rf"$r={order}$: fitted {fit.exponent:.2f}, paper {slope}"
        _draw_increase(ax, increase, 1.0, colour=colour, marker=marker, label=label)
        u = np.array(FIT_RANGE)
        ax.plot(u, fit.at(u), color=colour, linewidth=0.9)
        centre = float(np.sqrt(u[0] * u[1]))
        line = fit.at(centre) * (u / centre) ** slope
        ax.plot(u, line, "--", color=colour, linewidth=0.9)
        places, local = increase.local_powers()
        below.plot(places, local, color=colour, marker=marker, markersize=3.5, linewidth=0.8)
        below.axhline(order - 2, color=colour, linewidth=0.7, linestyle=":")
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_ylabel(r"$\eta_{\rm harmonic}-\eta$")
    ax.legend(loc="upper left")
    below.set_ylim(bottom=0.0)
    below.set_ylabel(r"local power")
    below.set_xlabel(r"impact speed $v_0/v^*$")
    return figure


def slope_figure(measured: Measurements) -> Figure:
    """
    Return the increase divided by the speed for lj chains, and the scaling of long chains.

    Above, constant where 1 - eta grows as C v; below, all lengths on one curve.
    """
    found = lj_increases(measured)
    return Figure(
        key="slope",
        title="The constant C of the low-speed law, against speed and length",
        caption=(
            "Above, (η_harmonic − η)/(v₀/v*) of lj chains (filled: LAMMPS; open: in-house): a law "
            "1 − η = C v₀/v* would be a horizontal line. The paper prints 0.66 from its simulation "
            "and 2.61 from its theory, and says that they disagree: the theory with its dropped "
            "factor put back gives 3.24, further still from every value here. C depends on the "
            f"speed and on n. In this part chains beyond {_longest_compared(found)} are by the "
            "in-house engine alone. Below, chains of all lengths from 100 on, up to "
            f"{FASTEST[-1]:g} v*, fall nearly on one curve of x = (v₀/v*) n^(2/3), the fastest "
            "below it. A front that the wall sends into the chain steepens, because compressed "
            "bonds carry sound faster, and spreads, because short waves are slower: x is the ratio "
            "of the two. Slow or short chains are harmonic (a constant), long ones follow y = C x, "
            "however slow, while v₀ ≪ v*. For C of an "
            "infinite chain see [beyond the paper](#beyond)."
        ),
        table=_table(found, "length"),
        draw=lambda: _draw_slopes(found, slow_long_chains(measured), slope_limits(measured)),
        alt=(
            "Above, curves rise with speed, the higher the longer the chain, and fall again. "
            "Below, all lengths lie nearly on one curve, constant at 0.65 and then a straight line."
        ),
    )


def _longest_compared(found: dict[int, Increase]) -> int:
    """Return the length of the longest chain of the upper part that both engines computed."""
    return max((n for n, i in found.items() if i.points[0].agrees is not None), default=0)


def _draw_slopes(
    found: dict[int, Increase], long: list[Point], limits: list[SlopeLimit]
) -> "Canvas":
    figure, (ax, below) = new_figure(2, 1, figsize=(6.4, 7.0))
    for (n, increase), colour, marker in zip(found.items(), CYCLE, MARKERS, strict=False):
        u = increase.speeds
        ax.plot(u, increase.values / u, color=colour, linewidth=0.8, alpha=0.6)
        _draw_increase(ax, increase, u, colour=colour, marker=marker, label=f"$n={n}$")
    ax.axhline(0.66, color=BLACK, linewidth=1.0, linestyle="--", label="paper, simulation: 0.66")
    ax.set_xscale("log")
    ax.set_ylim(0.0, 1.1)
    ax.set_xlabel(r"impact speed $v_0/v^*$")
    ax.set_ylabel(r"$(\eta_{\rm harmonic}-\eta)\,/\,(v_0/v^*)$")
    ax.legend(loc="lower right", ncols=2)
    _draw_scaling(below, long, limits)
    return figure


def _draw_scaling(ax: "Axes", points: list[Point], limits: list[SlopeLimit]) -> None:
    import matplotlib as mpl

    lengths = sorted({p.particles for p in points})
    shades = mpl.colormaps["viridis"](np.linspace(0.0, 0.92, len(lengths)))
    for n, colour, marker in zip(lengths, shades, cycle(MARKERS), strict=False):
        group = [p for p in points if p.particles == n]
        ax.plot(
            [scaled_speed(p) for p in group],
            [(1.0 - p.restitution) * n ** (2.0 / 3.0) for p in group],
            marker,
            color=colour,
            markersize=4.5,
            markerfacecolor="none",
            label=f"$n={n}$",
        )
    reach = np.geomspace(0.1, 30.0, 30)
    ax.axhline(
        HARMONIC_DISSIPATION_COEFFICIENT, color=BLACK, linewidth=0.9, label="harmonic: 0.652"
    )
    if limits:
        value = middle(limits)
        label = rf"$y=C\,x$, $C={value:.2f}$"
        ax.plot(reach, value * reach, "--", color=VERMILION, linewidth=1.0, label=label)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_ylim(0.3, 40.0)
    ax.set_xlabel(r"$x=(v_0/v^*)\,n^{2/3}$")
    ax.set_ylabel(r"$y=(1-\eta)\,n^{2/3}$")
    ax.legend(loc="upper left", ncols=2, fontsize=8)


def pair_figure(measured: Measurements) -> Figure:
    """Return the shortening of the interval of the chain of two, beside the exact quadrature."""
    points = measured.select("pair", "lj")
    values = pair_alphas(points)
    bond = LennardJones()
    exact = [
        (1.0 - pair_interval(bond, p.scene.impact_velocity) / PAIR_INTERVAL) / p.speed
        for p in points
    ]
    return Figure(
        key="pair",
        title="The chain of two: how the interval between contacts shortens",
        caption=(
            "(1 − √2 Δt/π)/(v₀/v*) of two lj particles, which tends to α of eq. (15) at low speed. "
            "Filled: LAMMPS; open: in-house, at speeds where LAMMPS misses the error asked; line: "
            f"exact quadrature; its limit is {pair_interval_slope(bond):.4f}, where the paper has "
            "0.808."
        ),
        table=table_of(
            [
                {"speed": p.speed, "alpha": float(a), "alpha_exact": float(e), "source": p.source}
                for p, a, e in zip(points, values, exact, strict=True)
            ]
        ),
        draw=lambda: _draw_pair(points, values),
        alt="The shortening over v₀ falls from 0.81 to 0.7; all dots are on the exact curve.",
    )


def _draw_pair(points: list[Point], values: np.ndarray) -> "Canvas":
    figure, ax = new_figure(figsize=(6.4, 3.4))
    bond = LennardJones()
    speed = bond.natural_speed
    assert speed is not None
    u = np.geomspace(8e-4, 0.35, 40)
    exact = [(1.0 - pair_interval(bond, x * speed) / PAIR_INTERVAL) / x for x in u]
    ax.plot(u, exact, color=GREY, label="exact quadrature")
    speeds, none = [p.speed for p in points], [0.0] * len(points)
    draw_points(
        ax,
        points,
        speeds,
        values,
        colour=BLUE,
        marker="o",
        label="computed",
        errors=none,
        line=False,
    )
    ax.axhline(pair_interval_slope(bond), color=VERMILION, linewidth=0.9, label=r"limit $0.8098$")
    ax.axhline(0.808, color=BLACK, linewidth=0.9, linestyle="--", label=r"paper: $\alpha=0.808$")
    ax.set_xscale("log")
    ax.set_xlabel(r"impact speed $v_0/v^*$")
    ax.set_ylabel(r"$(1-\sqrt{2}\,\Delta t/\pi)\,/\,(v_0/v^*)$")
    ax.legend(loc="lower left")
    return figure
