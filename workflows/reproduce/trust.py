"""How far the points themselves can be trusted: agreement, error bars, failures."""

import math
from dataclasses import dataclass

import numpy as np

from chaincor.workflows.accuracy.by_lammps import SHARPEST_LAMMPS
from chaincor.workflows.reproduce.findings.low_speed import increases
from chaincor.workflows.reproduce.measurements import Measurements, Point


@dataclass(frozen=True)
class Health:
    """
    How far the data themselves can be trusted.

    Attributes
    ----------
    points, by_lammps : int
        Different points, and those where LAMMPS's value is shown.
    compared, disagreements : int
        Points both engines computed; those outside the sum of the bars.
    worst_excess : float
        Largest |difference|/(sum of bars).
    sharp : float
        Sum of bars up to which a comparison tells much: ten times the error asked.
    blunt : list of str
        Points compared with larger ones.
    blunt_bars : list of float
        The least and the largest of these.
    apart : list of str
        Points where the engines differ by more than the error asked.
    largest_error : float
        Largest error bar of a plotted point.
    asked : float
        What it was to be at most.
    missed : list of str
        Points whose error bar is larger than that.
    largest_relative_error : float
        Largest error bar of a plotted or fitted increase, as a share of it.
    alone : int
        Points that the in-house engine alone has.
    longest_compared : int
        Length of the longest chain that both engines computed.
    not_given : list of str
        What was planned for LAMMPS and has an in-house result only, and why.
    largest_ratio : float
        Our limit for LAMMPS: how many times faster than at rest a bond may swing.
    failures : list of str
        What has no result at all, and why.
    """

    points: int
    by_lammps: int
    compared: int
    disagreements: int
    worst_excess: float
    sharp: float
    blunt: list[str]
    blunt_bars: list[float]
    apart: list[str]
    largest_error: float
    asked: float
    missed: list[str]
    largest_relative_error: float
    alone: int
    longest_compared: int
    not_given: list[str]
    largest_ratio: float
    failures: list[str]


def _name(point: Point) -> str:
    if point.speed != point.speed:
        speed = f"{point.scene.impact_velocity:.4g} speeds of sound"
    else:
        speed = f"{point.speed:.3g} v*"
    return f"{point.scene.label}, n = {point.particles}, {speed}"


def examine_points(measured: Measurements) -> Health:
    """Count points, disagreements and failures."""
    points = list(measured.all_points())
    compared = [p for p in points if p.agrees is not None]
    excess = [abs(p.difference or 0.0) / (p.allowed_difference or 1.0) for p in compared]
    asked, sharp = measured.plan.tolerance, measured.sharp
    blunt = [p for p in compared if (p.allowed_difference or 0.0) > sharp]
    bars = [p.allowed_difference or 0.0 for p in blunt]
    failed = [
        (p.source is not None and engine == "LAMMPS", f"{_name(p)}, {engine}: {answer.failure}")
        for p in points
        for engine, answer in (("LAMMPS", p.lammps), ("in-house engine", p.in_house))
        if answer is not None and answer.result is None
    ]
    relative = [float(np.max(np.abs(i.errors / i.values))) for i in increases(measured).values()]
    return Health(
        points=len(points),
        by_lammps=sum(p.source == "lammps" for p in points),
        compared=len(compared),
        disagreements=sum(p.agrees is False for p in compared),
        worst_excess=max(excess, default=math.nan),
        sharp=sharp,
        blunt=[_name(p) for p in blunt],
        blunt_bars=[min(bars), max(bars)] if bars else [],
        apart=[
            f"{_name(p)} by {abs(p.difference or 0.0):.2g}"
            for p in compared
            if abs(p.difference or 0.0) > asked
        ],
        largest_error=max((p.error for p in points if p.source is not None), default=math.nan),
        asked=asked,
        missed=[_name(p) for p in points if p.error > (p.scene.tolerance or asked)],
        largest_relative_error=max(relative, default=math.nan),
        alone=sum(p.source == "in-house" and p.agrees is None for p in points),
        longest_compared=max((p.particles for p in compared), default=0),
        not_given=[text for by_other, text in failed if by_other],
        largest_ratio=SHARPEST_LAMMPS,
        failures=[text for by_other, text in failed if not by_other],
    )
