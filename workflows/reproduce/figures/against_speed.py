"""Restitution and contacts against speed (NH figures 4 and 7), and what lies beyond them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from chaincor.analysis.figures.style import (
    BLACK,
    BLUE,
    CYCLE,
    GREY,
    MARKERS,
    VERMILION,
    new_figure,
)
from chaincor.workflows.reproduce.figures.figure import Figure
from chaincor.workflows.reproduce.figures.measured_points import draw_points
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.studies import CURVE_POTENTIALS
from chaincor.workflows.reproduce.tables import point_record, table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas


def _speed_axis(ax: "Axes") -> None:
    ax.set_xscale("log")
    ax.set_xlabel(r"impact speed $v_0/v^*$")


def restitution_curves(measured: Measurements) -> Figure:
    """Return eta against v0/v* for lj, toda and log chains."""
    curves = {name: measured.select("curves", name) for name in CURVE_POTENTIALS}
    harmonic = measured.select("harmonic_velocities", "harmonic")
    return Figure(
        key="restitution_curves",
        title="Restitution against speed for lj, toda and log chains",
        caption=(
            f"The paper's figure 4, n = {measured.plan.curve_particles}. Filled: LAMMPS; open: "
            f"in-house.{describe_open(curves['lj'])}{_not_given(curves['log'])} η is the paper's "
            "ratio of energies. Dashed: the harmonic chain, which all three approach at low speed. "
            f"Error bars are smaller than the symbols{describe_bars(measured.points['curves'])}."
        ),
        table=table_of([point_record(p) for p in measured.points["curves"]]),
        draw=lambda: _draw_curves(curves, harmonic),
        alt=(
            "η of three bonds against speed: 0.97 when slow, a minimum of about 0.7 near 0.8 v*, 1 "
            "when fast; log rises earlier than the other two, which are one curve."
        ),
    )


def describe_open(points: Sequence[Point]) -> str:
    """Name the points of a curve where LAMMPS has a number that is not the one shown."""
    missed = [p for p in points if p.source == "in-house" and p.difference is not None]
    if not missed:
        return ""
    speeds = ", ".join(f"{p.speed:.3g}" for p in missed)
    return (
        f" At the open {missed[0].scene.label} points ({speeds} v*) LAMMPS misses the error asked."
    )


def _not_given(points: Sequence[Point]) -> str:
    """Say which fast chains LAMMPS is not given, and what is shown in its place."""
    ours = [p for p in points if p.lammps is not None and p.lammps.result is None]
    integrated = [p.speed for p in points if p.source is not None and not p.is_limit]
    if not ours or not integrated:
        return ""
    last = max(p.speed for p in points if p.source == "lammps")
    text = (
        f" Above {last:.3g} v* log chains, whose bonds would be compressed to nearly nothing, are "
        f"not given to LAMMPS: they are in-house, integrated to {max(integrated):.2g} v*"
    )
    if any(p.is_limit for p in ours):
        text += (
            "; above that (crosses) set equal to hard spheres, with the bound on the error as bar"
        )
    return text + "."


def describe_bars(points: Sequence[Point]) -> str:
    """Name the points whose bars are seen: a symbol covers about 0.005 of the axis."""
    seen = [p for p in points if p.error > 0.0025]
    if not seen:
        return ""
    names = ", ".join(f"{p.scene.label} at {p.speed:.3g} v*" for p in seen)
    return f", but where roundings decide whether a late contact comes ({names})"


def _draw_curves(curves: dict[str, list[Point]], harmonic: list[Point]) -> "Canvas":
    figure, ax = new_figure(figsize=(6.4, 4.2))
    if harmonic:
        ax.axhline(
            harmonic[0].restitution, color=GREY, linestyle="--", linewidth=1.0, label="harmonic"
        )
    labels = {"lj": "Lennard-Jones", "toda": r"Toda ($b=10$)", "log": "logarithmic"}
    for (name, points), colour, marker in zip(curves.items(), CYCLE, MARKERS, strict=False):
        u, eta = [p.speed for p in points], [p.restitution for p in points]
        draw_points(ax, points, u, eta, colour=colour, marker=marker, label=labels[name])
    _speed_axis(ax)
    ax.set_ylabel(r"restitution $\eta = K_r/K_i$")
    ax.legend(loc="lower left")
    return figure


def contacts_and_restitution(measured: Measurements) -> Figure:
    """Return f(n)/n and eta of the lj chain against speed, on the paper's one axis."""
    points = measured.select("curves", "lj")
    full = min((p.speed for p in points if p.contacts == p.particles), default=float("nan"))
    return Figure(
        key="contacts_and_restitution",
        title="Contacts per particle and restitution against speed",
        caption=(
            "The paper's figure 7, lj, n = "
            f"{measured.plan.curve_particles}. Filled: LAMMPS; open: in-house."
            f"{describe_open(points)} f/n reaches 1, the value of hard spheres, at "
            f"{full:.3g} v*; η rises with it, and goes on rising. Error bars of η are smaller than "
            f"the symbols{describe_bars(points)}; f is a whole number."
        ),
        table=table_of([point_record(p) for p in points]),
        draw=lambda: _draw_contacts(points),
        alt=(
            "f/n falls from 0.87 to 0.84 and rises from 0.7 v* on to 1 at 1.8 v*; η has its "
            "minimum at 0.82 v*, rises steeply from 1.1 to 3 v*, and ends near 1."
        ),
    )


def _draw_contacts(points: list[Point]) -> "Canvas":
    figure, ax = new_figure(figsize=(6.4, 3.9))
    speeds, eta = [p.speed for p in points], [p.restitution for p in points]
    draw_points(ax, points, speeds, eta, colour=BLUE, marker="o", label=r"restitution $\eta$")
    share = [p.contacts / p.particles for p in points]
    label = r"contacts per particle $f(n)/n$"
    none = [0.0] * len(points)
    draw_points(ax, points, speeds, share, colour=VERMILION, marker="s", label=label, errors=none)
    ax.axhline(1.0, color=BLACK, linewidth=0.6)
    _speed_axis(ax)
    ax.set_ylabel(r"$\eta$ and $f(n)/n$")
    ax.legend(loc="lower left")
    return figure
