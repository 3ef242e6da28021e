"""Low speed: the increase of dissipation (NH figure 6), the slope C, and alpha of the pair."""

from typing import TYPE_CHECKING

import numpy as np

from analysis.figures.style import BLACK, BLUE, CYCLE, GREY, MARKERS, VERMILION, new_figure
from analysis.pair_theory import pair_interval, pair_interval_slope
from analysis.theory import PAIR_INTERVAL
from lammps_inputs.potentials import LennardJones
from workflows.reproduce.figures.figure import Figure
from workflows.reproduce.findings.low_speed import (
    PAPER_SLOPES,
    Increase,
    increases,
    lj_increases,
    pair_alphas,
)
from workflows.reproduce.measurements import Measurements, Point
from workflows.reproduce.tables import Table, table_of

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


def _draw_increase(ax: "Axes", increase: Increase, values, errors, colour, marker, label) -> None:
    for source, face in (("lammps", colour), ("in-house", "white")):
        chosen = np.array([p.source == source for p in increase.points])
        if np.any(chosen):
            ax.errorbar(
                increase.speeds[chosen],
                values[chosen],
                yerr=errors[chosen],
                color=colour,
                marker=marker,
                markersize=4.5,
                markerfacecolor=face,
                linestyle="none",
                capsize=1.5,
                label=label,
            )
            label = None


def increase_figure(measured: Measurements) -> Figure:
    """
    Return the increase of dissipation for r = 3, 4, 5, with fitted and printed slopes.

    Parameters
    ----------
    measured : Measurements
        All points.

    Returns
    -------
    Figure
        The increase, and its local power below.
    """
    found = increases(measured)
    worst = max(
        (float(np.max(np.abs(i.errors / i.values))) for i in found.values()), default=float("nan")
    )
    return Figure(
        key="increase",
        title="Increase of dissipation for potentials of order 3, 4 and 5",
        caption=(
            f"The paper's figure 6, n = {measured.plan.curve_particles}: 1 − η of chains with "
            "U = s²/2 + c s^r less that of the harmonic chain. Lines: power laws with the paper's "
            "slopes through our value near 0.02 v*. Below, the local power, from neighbouring "
            "points: it tends to r − 2 at low speed and rises before the regime ends, so that a "
            "fitted slope depends on its range. η(v/v*) is the same for every c. The largest error "
            f"bar is {100 * worst:.2g} % of the increase it belongs to."
        ),
        table=_table(found, "power_order"),
        draw=lambda: _draw_orders(found),
    )


def _draw_orders(found: dict[int, Increase]) -> "Canvas":
    figure, (ax, below) = new_figure(
        2, 1, figsize=(6.4, 6.0), sharex=True, height_ratios=(1.6, 1.0)
    )
    for (order, increase), colour, marker in zip(found.items(), CYCLE, MARKERS, strict=False):
        label = rf"$r={order}$"
        _draw_increase(ax, increase, increase.values, increase.errors, colour, marker, label)
        middle = int(np.argmin(np.abs(np.log(increase.speeds / 0.02))))
        u = increase.speeds[increase.speeds >= 0.0099]
        slope = PAPER_SLOPES[order]
        line = increase.values[middle] * (u / increase.speeds[middle]) ** slope
        ax.plot(u, line, color=colour, linewidth=0.9, label=f"paper's slope {slope}")
        local = np.diff(np.log(increase.values)) / np.diff(np.log(increase.speeds))
        places = np.sqrt(increase.speeds[1:] * increase.speeds[:-1])
        below.plot(places, local, color=colour, marker=marker, markersize=3.5, linewidth=0.8)
        below.axhline(order - 2, color=colour, linewidth=0.7, linestyle=":")
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_ylabel(r"$\eta_{\rm harmonic}-\eta$")
    ax.legend(loc="lower right", ncols=1)
    below.set_ylim(0.0, 5.0)
    below.set_ylabel("local power")
    below.set_xlabel(r"impact speed $v_0/v^*$")
    return figure


def slope_figure(measured: Measurements) -> Figure:
    """
    Return the increase divided by the speed, for lj chains of several lengths.

    Parameters
    ----------
    measured : Measurements
        All points.

    Returns
    -------
    Figure
        Constant where 1 - eta grows as C v.
    """
    found = lj_increases(measured)
    return Figure(
        key="slope",
        title="The constant C of the low-speed law, against speed and length",
        caption=(
            "(η_harmonic − η)/(v₀/v*) of lj chains: a law 1 − η = C v would be a horizontal line. "
            "The paper prints 0.66 from its simulation and 2.61 from its theory; the theory with "
            "its dropped factor put back gives 3.24. C depends on the speed and on n. Longer "
            "chains come nearer to a common curve that rises towards about 1 at low speed."
        ),
        table=_table(found, "length"),
        draw=lambda: _draw_slopes(found),
    )


def _draw_slopes(found: dict[int, Increase]) -> "Canvas":
    figure, ax = new_figure(figsize=(6.4, 4.0))
    for (n, increase), colour, marker in zip(found.items(), CYCLE, MARKERS, strict=False):
        u = increase.speeds
        ax.plot(u, increase.values / u, color=colour, linewidth=0.8, alpha=0.6)
        _draw_increase(
            ax, increase, increase.values / u, increase.errors / u, colour, marker, f"$n={n}$"
        )
    ax.axhline(0.66, color=BLACK, linewidth=1.0, linestyle="--", label="paper, simulation: 0.66")
    ax.set_xscale("log")
    ax.set_ylim(0.0, 1.1)
    ax.set_xlabel(r"impact speed $v_0/v^*$")
    ax.set_ylabel(r"$(\eta_{\rm harmonic}-\eta)\,/\,(v_0/v^*)$")
    ax.legend(loc="lower right", ncols=2)
    return figure


def pair_figure(measured: Measurements) -> Figure:
    """
    Return the shortening of the interval of the chain of two.

    Parameters
    ----------
    measured : Measurements
        All points.

    Returns
    -------
    Figure
        LAMMPS against the exact quadrature.
    """
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
            f"Dots: LAMMPS; line: exact quadrature; its limit is {pair_interval_slope(bond):.4f}, "
            "where the paper has 0.808."
        ),
        table=table_of(
            [
                {"speed": p.speed, "alpha": float(a), "alpha_exact": float(e), "source": p.source}
                for p, a, e in zip(points, values, exact, strict=True)
            ]
        ),
        draw=lambda: _draw_pair(points, values),
    )


def _draw_pair(points: list[Point], values: np.ndarray) -> "Canvas":
    figure, ax = new_figure(figsize=(6.4, 3.4))
    bond = LennardJones()
    speed = bond.natural_speed
    assert speed is not None
    u = np.geomspace(8e-4, 0.35, 40)
    exact = [(1.0 - pair_interval(bond, x * speed) / PAIR_INTERVAL) / x for x in u]
    ax.plot(u, exact, color=GREY, label="exact quadrature")
    ax.plot([p.speed for p in points], values, "o", color=BLUE, label="LAMMPS")
    ax.axhline(pair_interval_slope(bond), color=VERMILION, linewidth=0.9, label=r"limit $0.8098$")
    ax.axhline(0.808, color=BLACK, linewidth=0.9, linestyle="--", label=r"paper: $\alpha=0.808$")
    ax.set_xscale("log")
    ax.set_xlabel(r"impact speed $v_0/v^*$")
    ax.set_ylabel(r"$(1-\sqrt{2}\,\Delta t/\pi)\,/\,(v_0/v^*)$")
    ax.legend(loc="lower left")
    return figure
