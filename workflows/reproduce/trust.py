"""How far the points themselves can be trusted: agreement, error bars, failures."""

import math
from dataclasses import dataclass

import numpy as np

from chaincor.workflows.reproduce.findings.low_speed import increases
from chaincor.workflows.reproduce.measurements import Measurements


@dataclass(frozen=True)
class Health:
    """
    How far the data themselves can be trusted.

    Attributes
    ----------
    points, by_lammps : int
        Different points, and those with a value from LAMMPS.
    compared, disagreements : int
        Points both engines computed; those outside the sum of the bars.
    worst_excess : float
        Largest |difference|/(sum of bars).
    largest_error : float
        Largest error bar of a plotted point.
    asked : float
        What it was to be at most.
    missed : list of str
        Points whose error bar is larger than that.
    largest_relative_error : float
        Largest error bar of a plotted or fitted increase, as a share of it.
    failures : list of str
        What had no result, and why.
    """

    points: int
    by_lammps: int
    compared: int
    disagreements: int
    worst_excess: float
    largest_error: float
    asked: float
    missed: list[str]
    largest_relative_error: float
    failures: list[str]


def examine_points(measured: Measurements) -> Health:
    """Count points, disagreements and failures."""
    points = list(measured.all_points())
    compared = [p for p in points if p.agrees is not None]
    excess = [abs(p.difference or 0.0) / (p.allowed_difference or 1.0) for p in compared]
    failures = [
        f"{p.scene.label}, n = {p.particles}, v0 = {p.scene.impact_velocity:.4g}, {engine}: "
        f"{answer.failure}"
        for p in points
        for engine, answer in (("LAMMPS", p.lammps), ("in-house", p.in_house))
        if answer is not None and answer.result is None
    ]
    relative = [float(np.max(np.abs(i.errors / i.values))) for i in increases(measured).values()]
    return Health(
        points=len(points),
        by_lammps=sum(p.source == "lammps" for p in points),
        compared=len(compared),
        disagreements=sum(p.agrees is False for p in compared),
        worst_excess=max(excess, default=math.nan),
        largest_error=max((p.error for p in points if p.source is not None), default=math.nan),
        asked=measured.plan.tolerance,
        missed=[
            f"{p.scene.label}, n = {p.particles}, {p.speed:.3g} v*"
            for p in points
            if p.answer is not None and p.answer.result["tolerance_met"] is False  # type: ignore[index]
        ],
        largest_relative_error=max(relative, default=math.nan),
        failures=failures,
    )
