"""How far the points themselves can be trusted: agreement, error bars, failures."""

import math
from typing import Any

from chaincor.workflows.accuracy.by_lammps import SHARPEST_LAMMPS
from chaincor.workflows.reproduce.figures.increase import increases
from chaincor.workflows.reproduce.measurements import Measurements, Point


def _name(point: Point) -> str:
    if point.speed != point.speed:
        speed = f"{point.scene.impact_velocity:.4g} speeds of sound"
    else:
        speed = f"{point.speed:.3g} v*"
    return f"{point.scene.label}, n = {point.particles}, {speed}"


def examine_points(measured: Measurements) -> dict[str, Any]:
    """Count points, disagreements and failures, and name those that prove little."""
    points = list(measured.all_points())
    compared = [p for p in points if p.agrees is not None]
    excess = [abs(p.difference or 0.0) / (p.allowed_difference or 1.0) for p in compared]
    asked, sharp = measured.plan.tolerance, measured.sharp
    blunt = [p for p in compared if (p.summed_bars or 0.0) > sharp]
    bars = [p.summed_bars or 0.0 for p in blunt]
    failed = [
        (p.source is not None and engine == "LAMMPS", f"{_name(p)}, {engine}: {answer.failure}")
        for p in points
        for engine, answer in (("LAMMPS", p.lammps), ("in-house engine", p.in_house))
        if answer is not None and not answer.result
    ]
    relative = [increase.largest_relative_error for increase in increases(measured).values()]
    return {
        # Different points, those where LAMMPS's value is shown, and those that in-house alone has.
        "points": len(points),
        "by_lammps": sum(p.source == "lammps" for p in points),
        "alone": sum(p.source == "in-house" and p.agrees is None for p in points),
        # Points that both engines computed; those that differ by more than LAMMPS's own runs do.
        "compared": len(compared),
        "longest_compared": max((p.particles for p in compared), default=0),
        "disagreements": sum(p.agrees is False for p in compared),
        # Largest |difference| over that.
        "worst_excess": max(excess, default=math.nan),
        # Sum of bars up to which a comparison tells much; points with larger ones, and the least
        # and the largest of these.
        "sharp": sharp,
        "blunt": [_name(p) for p in blunt],
        "blunt_bars": [min(bars), max(bars)] if bars else [],
        # Points where the engines differ by more than the error asked.
        "apart": [
            f"{_name(p)} by {abs(p.difference or 0.0):.2g}"
            for p in compared
            if abs(p.difference or 0.0) > asked
        ],
        # Largest error bar of a plotted point, what it was to be at most, and what is larger.
        "largest_error": max((p.error for p in points if p.source is not None), default=math.nan),
        "asked": asked,
        "missed": [_name(p) for p in points if p.error > (p.scene.tolerance or asked)],
        # Largest error bar of a plotted or fitted increase, as a share of it.
        "largest_relative_error": max(relative, default=math.nan),
        # What was planned for LAMMPS and has an in-house result only, and why; how many times
        # faster than at rest a bond may swing for LAMMPS; what has no result at all, and why.
        "not_given": [text for by_other, text in failed if by_other],
        "largest_ratio": SHARPEST_LAMMPS,
        "failures": [text for by_other, text in failed if not by_other],
    }
