"""Dissipation against the length of the chain: harmonic (NH figure 3) and lj (NH figure 5)."""

from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, CYCLE, GREY, MARKERS, VERMILION, new_figure
from chaincor.analysis.theory import (
    HARMONIC_DISSIPATION_COEFFICIENT,
    harmonic_dissipation_law,
    harmonic_dissipation_limit,
)
from chaincor.workflows.pages.typesetting import format_fitted
from chaincor.workflows.reproduce.figures.figure import Figure
from chaincor.workflows.reproduce.figures.measured_points import draw_points
from chaincor.workflows.reproduce.findings.harmonic import (
    HarmonicLaw,
)
from chaincor.workflows.reproduce.findings.lengths import last_exponents
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.plan import PAPER_SIZE_SPEEDS
from chaincor.workflows.reproduce.tables import point_record, table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas


def _dissipation(point: Point) -> float:
    return 1.0 - point.restitution


def _scaled(point: Point) -> float:
    return _dissipation(point) * point.particles ** (2.0 / 3.0)


def harmonic_lengths(measured: Measurements, law: HarmonicLaw) -> Figure:
    """Return 1 - eta against n for harmonic chains, and what is left without the law."""
    points = measured.select("harmonic_sizes", "harmonic")
    fit = law.both
    return Figure(
        key="harmonic_lengths",
        title="Dissipation of harmonic chains against their length",
        caption=(
            "The paper's figure 3. Filled: LAMMPS; open: in-house engine, for more lengths; n = 2, "
            f"which loses nothing, has no place. 1 − η ∝ n^p, n = {fit.first:.0f} to "
            f"{fit.last:.0f}: p = {fit.exponent:.3f} ± {fit.exponent_error:.3f}; over other ranges "
            "see [the fits](#fits). Below, n^(2/3)(1 − η): its scatter is no noise (error bars are "
            "smaller than the dots), but comes from the last contacts, whose times change with n. "
            f"Its mean falls with the length, towards {harmonic_dissipation_limit():.4f} (dotted), "
            "the limit of a front that disperses as Airy's function; solid: 0.652, that of the "
            "paper's approximate formula."
        ),
        table=table_of([point_record(point) for point in points]),
        draw=lambda: _draw_harmonic([p for p in points if p.particles >= 3], law),
        alt=(
            "1 − η falls along a straight line of slope −2/3 from n = 30 on; below, multiplied by "
            "n^(2/3), it scatters between 0.6 and 0.85 for long chains, around 0.68."
        ),
    )


def _draw_harmonic(points: list[Point], law: HarmonicLaw) -> "Canvas":
    figure, (ax, below) = new_figure(
        2, 1, figsize=(6.4, 5.6), sharex=True, height_ratios=(1.5, 1.0)
    )
    n = np.geomspace(3, max(p.particles for p in points), 60)
    fitted = n[n >= 0.98 * law.mean_prefactor.first]
    for panel, y in ((ax, _dissipation), (below, _scaled)):
        for source, size in (("in-house", 2.8), ("lammps", 4.5)):
            chosen = [p for p in points if p.source == source]
            draw_points(
                panel,
                chosen,
                [p.particles for p in chosen],
                [y(p) for p in chosen],
                colour=BLUE,
                marker="o",
                label={"lammps": "LAMMPS", "in-house": "in-house"}[source],
                line=False,
                size=size,
            )
    ax.plot(n, harmonic_dissipation_law(n), color=BLACK, label=r"paper: $0.652\,n^{-2/3}$")
    ax.plot(
        fitted,
        law.mean_prefactor.at(fitted),
        color=VERMILION,
        linestyle="--",
        linewidth=1.0,
        label=rf"${law.mean_prefactor.prefactor:.2f}\,n^{{-2/3}}$ (fit, all points from "
        rf"$n={law.mean_prefactor.first:.0f}$)",
    )
    ax.set_yscale("log")
    ax.set_ylabel(r"dissipation $1-\eta$")
    ax.legend(loc="lower left")
    below.axhline(HARMONIC_DISSIPATION_COEFFICIENT, color=BLACK)
    below.axhline(harmonic_dissipation_limit(), color=BLACK, linestyle=":")
    flat = np.full_like(fitted, law.mean_prefactor.prefactor)
    below.plot(fitted, flat, color=VERMILION, linestyle="--", linewidth=1.0)
    below.set_xscale("log")
    below.set_ylim(0.25, 1.5)
    below.set_ylabel(r"$n^{2/3}(1-\eta)$")
    below.set_xlabel(r"number of particles $n$")
    return figure


def lj_lengths(measured: Measurements) -> Figure:
    """Return 1 - eta against n for lj chains at the paper's speeds, and the harmonic chain's."""
    points = {speed: measured.select("sizes", "lj", speed=speed) for speed in PAPER_SIZE_SPEEDS}
    harmonic = measured.select("harmonic_sizes", "harmonic")
    return Figure(
        key="lj_lengths",
        title="Dissipation of Lennard-Jones chains against their length, at five speeds",
        caption=(
            "The paper's figure 5, carried on to longer chains. Filled: LAMMPS; open: in-house. "
            "Grey: the harmonic chain, whose dissipation vanishes as n^(−2/3). A curve that levels "
            "off stays finite in the limit of long chains; there is no sign here that "
            "one does not. Exponent of 1 − η from a fifth of the longest chain on: "
            + ", ".join(
                f"{format_fitted(law.exponent, law.exponent_error)} at {speed:.3f} v* "
                f"({law.points} points to n = {last[-1].particles})"
                for speed, (law, last) in last_exponents(measured).items()
                if last
            )
            + ". Bars of fits to three or four points are formal: their scatter alone."
        ),
        table=table_of([point_record(p) for ps in points.values() for p in ps]),
        draw=lambda: _draw_lj(points, harmonic),
        alt=(
            "1 − η against n at five speeds: flat at 0.78, 0.39 and 0.16 v*; falling and then flat "
            "at 0.078 and 0.008 v*, while the harmonic chain goes on falling."
        ),
    )


def _draw_lj(points: dict[float, list[Point]], harmonic: list[Point]) -> "Canvas":
    figure, ax = new_figure(figsize=(6.4, 4.4))
    known = [p for p in harmonic if p.particles >= 10]
    ax.plot(
        [p.particles for p in known],
        [_dissipation(p) for p in known],
        color=GREY,
        linewidth=0.8,
        label="harmonic",
    )
    for (speed, group), colour, marker in zip(points.items(), CYCLE, MARKERS, strict=False):
        draw_points(
            ax,
            group,
            [p.particles for p in group],
            [_dissipation(p) for p in group],
            colour=colour,
            marker=marker,
            label=rf"$v_0 = {speed:.3f}\,v^*$",
        )
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel(r"number of particles $n$")
    ax.set_ylabel(r"dissipation $1-\eta$")
    ax.legend(loc="lower left", ncols=2)
    return figure
