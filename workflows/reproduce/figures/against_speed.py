"""Restitution and contacts against speed (NH figures 4 and 7), and what lies beyond them."""

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
    fastest = max((p.speed for p in curves["log"] if p.source == "lammps"), default=0.0)
    refusal = (
        f" Above {fastest:.3g} v* LAMMPS refuses log chains, whose bonds would be compressed to "
        "almost nothing; there the in-house stiff engine gives the open symbols."
        if any(p.speed > fastest for p in curves["log"])
        else ""
    )
    harmonic = measured.select("harmonic_velocities", "harmonic")
    return Figure(
        key="restitution_curves",
        title="Restitution against speed for lj, toda and log chains",
        caption=(
            f"The paper's figure 4, n = {measured.plan.curve_particles}. Filled: LAMMPS; open: "
            f"in-house.{refusal} η is the paper's ratio of energies. Dashed: the harmonic "
            "chain, which all three approach at low speed. Error bars are smaller than the symbols"
            f"{_large_bars(measured)}."
        ),
        table=table_of([point_record(p) for p in measured.points["curves"]]),
        draw=lambda: _draw_curves(curves, harmonic),
    )


def _large_bars(measured: Measurements) -> str:
    """Name the points whose bars are seen: a symbol covers about 0.005 of the axis."""
    seen = [p for p in measured.points["curves"] if p.error > 0.003]
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
            f"{measured.plan.curve_particles}. f/n reaches 1, the value of hard spheres, at "
            f"{full:.3g} v*; η rises with it, and goes on rising."
        ),
        table=table_of([point_record(p) for p in points]),
        draw=lambda: _draw_contacts(points),
    )


def _draw_contacts(points: list[Point]) -> "Canvas":
    figure, ax = new_figure(figsize=(6.4, 3.9))
    speeds, eta = [p.speed for p in points], [p.restitution for p in points]
    draw_points(ax, points, speeds, eta, colour=BLUE, marker="o", label=r"restitution $\eta$")
    ax.plot(
        speeds,
        [p.contacts / p.particles for p in points],
        color=VERMILION,
        marker="s",
        markersize=4,
        linewidth=0.9,
        label=r"contacts per particle $f(n)/n$",
    )
    ax.axhline(1.0, color=BLACK, linewidth=0.6)
    _speed_axis(ax)
    ax.set_ylabel(r"$\eta$ and $f(n)/n$")
    ax.legend(loc="lower left")
    return figure
