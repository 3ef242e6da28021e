"""
Draw the difference between the two engines at all measured points.

The report counts disagreements, failures and missed tolerances of these points.
"""

import math
from typing import Any

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, VERMILION
from chaincor.workflows.accuracy.solvers import LAMMPS
from chaincor.workflows.reproduce.drawing import Axes, Figure, point_record
from chaincor.workflows.reproduce.figures.increase import increases
from chaincor.workflows.reproduce.measurements import MeasuredPoint, Measurements, column

# A comparison is meaningful if the sum of both engines' error bars is at most this multiple of the
# target error.
_SHARP = 10.0
_FLOOR = 1e-14


def _name(point: MeasuredPoint) -> str:
    absolute = f"{point.scene.impact_velocity:.4g} speeds of sound"
    speed = absolute if np.isnan(point.speed) else f"{point.speed:.3g} v*"
    return f"{point.scene.label}, n = {point.particles}, {speed}"


def examine_points(measured: Measurements) -> dict[str, Any]:
    """Count points, disagreements and failures, and name points with large error bars."""
    points = list(measured.all_points())
    compared = [p for p in points if p.agrees is not None]
    excess = [abs(p.difference) / (p.allowed_difference or 1.0) for p in compared]
    asked = measured.plan.tolerance
    sharp = _SHARP * asked
    blunt = [p for p in compared if p.summed_bars > sharp]
    bars = [p.summed_bars for p in blunt]
    failed = [
        (p.source is not None and engine == "LAMMPS", f"{_name(p)}, {engine}: {answer.failure}")
        for p in points
        for engine, answer in (("LAMMPS", p.lammps), ("reference engine", p.reference))
        if answer is not None and not answer.result
    ]
    relative = [increase.largest_relative_error for increase in increases(measured).values()]
    return {
        # Number of all points, of points that show LAMMPS's result, and of points that only the
        # reference engine computed.
        "points": len(points),
        "by_lammps": sum(p.source == "lammps" for p in points),
        "alone": sum(p.source == "reference" and p.agrees is None for p in points),
        # Number of points that both engines computed, and of points where the engines differ by
        # more than is allowed.
        "compared": len(compared),
        "longest_compared": max((p.particles for p in compared), default=0),
        "disagreements": sum(p.agrees is False for p in compared),
        # Largest ratio of the engines' difference to the allowed difference.
        "worst_excess": max(excess, default=math.nan),
        # The comparison is meaningful if the sum of both error bars is at most "sharp". The points
        # with larger sums are listed, with the smallest and the largest of these sums.
        "sharp": sharp,
        "blunt": [_name(p) for p in blunt],
        "blunt_bars": [min(bars), max(bars)] if bars else [],
        # Points at which the engines differ by more than the target error.
        "apart": [
            f"{_name(p)} by {abs(p.difference):.2g}" for p in compared if abs(p.difference) > asked
        ],
        # Largest error bar of a plotted point, the target error, and points that miss their target
        # error.
        "largest_error": max((p.error for p in points if p.source is not None), default=math.nan),
        "asked": asked,
        "missed": [_name(p) for p in points if p.error > (p.scene.tolerance or asked)],
        # Largest relative error bar of a plotted or fitted increase.
        "largest_relative_error": max(relative, default=math.nan),
        # Runs that gave no result, with reasons. "not_given" lists LAMMPS's failures at points that
        # the reference engine computed, and "failures" lists all others. "largest_ratio" is the
        # largest frequency ratio of a bond that LAMMPS accepts.
        "not_given": [text for by_other, text in failed if by_other],
        "largest_ratio": LAMMPS.sharpest,
        "failures": [text for by_other, text in failed if not by_other],
    }


def figure(measured: Measurements) -> Figure:
    """Return the figure of the difference between the engines against the impact speed."""
    points = [p for p in measured.all_points() if p.agrees is not None]
    found = np.abs(column(points, "difference"))
    allowed = column(points, "allowed_difference")
    worst = max(found / allowed, default=float("nan"))
    asked = measured.plan.tolerance
    median = float(np.median(found)) if points else float("nan")

    def draw(ax: Axes) -> None:
        speeds = np.array([p.scene.impact_velocity for p in points])
        agree = found <= allowed
        for chosen, color, label in ((agree, BLUE, "agree"), (~agree, VERMILION, "disagree")):
            if np.any(chosen):
                y = np.maximum(found[chosen], _FLOOR)
                ax.plot(speeds[chosen], y, "o", color=color, label=label, markersize=3.2, alpha=0.8)
        ax.axhline(asked, color=BLACK, linewidth=0.9, label=f"error asked: {asked:g}")
        ax.set(xscale="log", yscale="log", ylabel=r"$|\eta_{\rm LAMMPS}-\eta_{\rm reference}|$")
        ax.set_xlabel(r"impact speed $v_0$ / speed of sound")
        ax.legend(loc="upper left")

    return Figure(
        key="agreement",
        title="LAMMPS against the reference engine",
        caption=(
            f"The figure shows the differences at all {len(points)} points that "
            f"both engines computed. Half of them are below {median:.1g}, and "
            f"{np.count_nonzero(found > asked)} are above the target error (line). "
            "A point disagrees if the engines differ by more than the sum of the "
            "difference between LAMMPS's runs at one and two steps, the errors "
            "from table and rounding, and the error bar of the reference engine. "
            f"This is so at {np.count_nonzero(found > allowed)} points, and the "
            f"largest ratio to that sum is {worst:.2g}. The sum is wide, so this "
            "test could hardly fail. LAMMPS's error bar is shorter, but is not "
            "used here, because it contains the distance to a reference run ([how "
            "far to trust this](#trust))."
        ),
        alt=(
            "Nearly all differences lie far below the target error. Differences "
            "for chains that break, near the speed of sound, reach 1e-2."
        ),
        draw=draw,
        records=[point_record(p) for p in measured.all_points()],
        size=(6.4, 4.0),
    )
