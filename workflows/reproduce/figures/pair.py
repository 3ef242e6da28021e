"""
Draw how the intervals between contacts of two lj particles shorten (NH eq. 15).

Two claims are judged: the coefficient alpha of this law, and the frequency at which the paper's
harmonic chain hits the wall.
"""

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, GREY, VERMILION
from chaincor.analysis.pair_theory import pair_interval, pair_interval_slope
from chaincor.analysis.theory import PAIR_INTERVAL
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.claims import ClaimFinding, claim, digits, words
from chaincor.workflows.reproduce.curve import Curve, limit_at_zero
from chaincor.workflows.reproduce.drawing import IMPACT_SPEED, Axes, Figure, draw_points
from chaincor.workflows.reproduce.figures.harmonic_contacts import number_of_paper_chain
from chaincor.workflows.reproduce.measurements import MeasuredPoint, Measurements, NoNumber, column
from chaincor.workflows.reproduce.plan import ReproductionPlan, Study, chains

# The tolerance of eta is small, because eta is always nearly 1 for a chain of two. The chain is
# judged by the interval between its contacts.
_TOLERANCE = 1e-10
_BOND = LennardJones()


@claim(
    "section III",
    words(2.0 * 2.0**0.5),
    "the wall's frequency",
    text="wall's frequency 2π/Δt ≃ 2√2 ω, above all modes",
)
@number_of_paper_chain
def _external_frequency(
    point: MeasuredPoint, intervals: Array, _speeds: Array
) -> tuple[float, str]:
    highest = 2.0 * np.sin(0.5 * np.pi * (point.particles - 1) / point.particles)
    return float(2.0 * np.pi / np.mean(intervals)), (
        f"2π over the mean interval, {point.origin}; ± difference between the engines. The highest "
        f"mode has {highest:.3f}, so the wall's frequency is above all modes on average, and in "
        f"all but {np.sum(intervals > np.pi)} of the intervals. The [slips](#slips) discuss the "
        "paper's conclusion"
    )


def study(plan: ReproductionPlan) -> Study:
    """Return the scenes of lj chains with two particles."""
    scenes = chains("lj", (2,), plan.pair_speeds, _TOLERANCE)
    return Study("pair", "chain of two, for α", scenes)


def _alphas(points: list[MeasuredPoint]) -> Array:
    """
    Return (1 - sqrt(2) dt/pi)/(v0/v*) for chains of two, which tends to alpha at low speed.

    The value is nan unless there are exactly two contacts.
    """
    times = [point.answer.arrays.get("contact_times", np.empty(0)) for point in points]
    intervals = np.array([t[1] - t[0] if len(t) == 2 else np.nan for t in times])
    return (1.0 - intervals / PAIR_INTERVAL) / column(points, "speed")


def _exact(velocity: float, speed: float) -> float:
    """Return (1 - sqrt(2) dt/pi)/(v0/v*) by quadrature."""
    return float((1.0 - pair_interval(_BOND, velocity) / PAIR_INTERVAL) / speed)


@claim(
    "eq. (15)",
    digits("0.808"),
    "α = 0.808",
    text="n = 2, lj: α = 0.808",
    correction="α = {value:.4f}",
    figure="pair",
)
def _alpha(measured: Measurements) -> ClaimFinding:
    slow = [p for p in measured.select("pair", "lj") if p.speed <= 0.1]
    if len(slow) < 4:
        raise NoNumber("fewer than four speeds")
    values = _alphas(slow)
    ours = sum(p.source == "lammps" for p in slow)
    limit, change = limit_at_zero(column(slow, "speed"), values, 2)
    deviation = max(
        abs(pair_interval(_BOND, p.scene.impact_velocity) / PAIR_INTERVAL - 1.0 + a * p.speed)
        for p, a in zip(slow, values, strict=True)
    )
    return ClaimFinding(
        limit,
        change + 1e-5,
        f"limit v₀ → 0 of a parabola through {len(slow)} speeds up to 0.1 v*, {ours} by LAMMPS and "
        f"{len(slow) - ours} by the reference engine; ± change if one speed is left out; "
        f"first-order theory gives {pair_interval_slope(_BOND):.5f}; intervals agree with the "
        f"exact quadrature to {deviation:.0e}",
        slow,
    )


def figure(measured: Measurements) -> Figure:
    """Return the figure of the shortened interval for two particles, with results of quadrature."""
    points = measured.select("pair", "lj")
    values = _alphas(points)

    def draw(ax: Axes) -> None:
        scale = Scene(potential="lj", particles=2, speed=1.0).impact_velocity
        u = np.geomspace(8e-4, 0.35, 40)
        ax.plot(u, [_exact(x * scale, x) for x in u], color=GREY, label="exact quadrature")
        curve = Curve(points, column(points, "speed"), values, np.zeros_like(values))
        draw_points(ax, curve, color=BLUE, label="computed")
        limit = pair_interval_slope(_BOND)
        ax.axhline(limit, color=VERMILION, linewidth=0.9, label=r"limit $0.8098$")
        label = r"paper: $\alpha=0.808$"
        ax.axhline(0.808, color=BLACK, linewidth=0.9, linestyle="--", label=label)
        ax.set(xscale="log", xlabel=IMPACT_SPEED)
        ax.set_ylabel(r"$(1-\sqrt{2}\,\Delta t/\pi)\,/\,(v_0/v^*)$")
        ax.legend(loc="lower left")

    return Figure(
        key="pair",
        title="The chain of two: how the interval between contacts shortens",
        caption=(
            "(1 − √2 Δt/π)/(v₀/v*) of two lj particles, which tends to α of eq. (15) at low speed. "
            "Filled: LAMMPS; open: reference engine, at speeds where LAMMPS misses the target "
            f"error; line: exact quadrature, with the limit {pair_interval_slope(_BOND):.4f} "
            "(paper: 0.808)."
        ),
        alt="The shortening over v₀ falls from 0.81 to 0.7; all dots are on the exact curve.",
        draw=draw,
        records=[
            {
                "speed": p.speed,
                "alpha": float(a),
                "alpha_exact": _exact(p.scene.impact_velocity, p.speed),
                "source": p.source,
            }
            for p, a in zip(points, values, strict=True)
        ],
        size=(6.4, 3.4),
    )
