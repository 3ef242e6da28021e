"""Beyond the paper: chains that break, and the two coefficients of restitution."""

from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.figures.style import BLUE, CYCLE, GREEN, MARKERS, new_figure
from chaincor.workflows.reproduce.figures.figure import Figure
from chaincor.workflows.reproduce.findings.free_flight import LAST, MOMENTS, FreeFlight
from chaincor.workflows.reproduce.tables import table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# Speeds at which they are drawn against time, of those that are there the nearest.
_SHOWN = (0.65, 0.75, 1.0, 1.33, 2.0, 7.5)


def breaking_and_two_restitutions(flights: tuple[FreeFlight, ...]) -> Figure:
    """Return pieces against speed and time, and e beside eta, of the lj chain."""
    return Figure(
        key="breaking_and_two_restitutions",
        title="Beyond the paper: breaking chains, and the two coefficients of restitution",
        caption=(
            f"{describe_breaking(flights)} Top: pieces of lj chains so many crossings of sound, "
            "n − 1, after the last contact; middle: against that time. Pieces are the parts into "
            "which the chain can be cut at stretched bonds such that each two neighbours move "
            "apart with more energy than the bond between them still takes; a third piece can hold "
            "them back later. Bands reach from the "
            "state that LAMMPS ended in to that of the in-house engine: both are right within the "
            "error bar of η, and hot chains make such differences grow, so that within a band "
            "nobody knows. Bottom: η, the ratio of energies that the paper calls COR, and "
            "e = √η, the ratio of speeds that others call so."
        ),
        table=table_of(_rows(flights)),
        draw=lambda: _draw(flights),
    )


def describe_breaking(flights: tuple[FreeFlight, ...]) -> str:
    """Say in words which chains are in pieces, and when."""
    parts = []
    for moment in MOMENTS:
        some = [f.point.speed for f in flights if f.pieces_at(moment)[1] > 1]
        every = [f.point.speed for f in flights if f.pieces_at(moment)[0] > 1]
        if not some:
            parts.append(f"none {_when(moment)}")
        elif every and min(every) > min(some):
            parts.append(
                f"{_when(moment)}, from {min(every):.2g} v* on ({min(some):.2g} v* in one of two "
                "motions)"
            )
        else:
            parts.append(f"{_when(moment)}, from {min(some):.2g} v* on")
    return f"When a chain is in pieces depends on when one looks: {'; '.join(parts)}."


def _when(moment: float) -> str:
    if moment == 0.0:
        return "at the last contact"
    return f"after {moment:g} crossing{'s' if moment != 1.0 else ''}"


def _rows(flights: tuple[FreeFlight, ...]) -> list[dict[str, float]]:
    return [
        {
            "speed": f.point.speed,
            "crossings": float(time),
            "fewest_pieces": f.pieces_at(time)[0],
            "most_pieces": f.pieces_at(time)[1],
            "restitution": f.point.restitution,
            "kinematic_restitution": f.point.restitution**0.5,
        }
        for f in flights
        for time in f.times
    ]


def _draw(flights: tuple[FreeFlight, ...]) -> "Canvas":
    figure, (above, middle, below) = new_figure(3, 1, figsize=(6.4, 8.4))
    if not flights:
        return figure
    speeds = [f.point.speed for f in flights]
    for moment, colour, marker in zip(MOMENTS, CYCLE, MARKERS, strict=False):
        pieces = np.array([f.pieces_at(moment) for f in flights])
        above.fill_between(speeds, *pieces.T, color=colour, alpha=0.25, linewidth=0)
        above.plot(
            speeds,
            pieces[:, 1],
            color=colour,
            marker=marker,
            markersize=3,
            linewidth=0.9,
            label=_when(moment),
        )
    above.legend(loc="upper left", fontsize=8)
    above.set_xscale("log")
    above.set_xlabel(r"impact speed $v_0/v^*$")
    chosen = {
        min(flights, key=lambda f: abs(np.log(f.point.speed / u))).point.speed: None for u in _SHOWN
    }
    for flight, colour in zip((f for f in flights if f.point.speed in chosen), CYCLE, strict=False):
        pieces = np.array([flight.pieces_at(time) for time in flight.times])
        middle.fill_between(flight.times, *pieces.T, color=colour, alpha=0.25, linewidth=0)
        middle.plot(
            flight.times,
            pieces[:, 1],
            color=colour,
            linewidth=0.9,
            label=rf"${flight.point.speed:.3g}\,v^*$",
        )
    middle.set_xscale("symlog", linthresh=0.1)
    middle.set_xlim(0.0, LAST)
    middle.set_xlabel(r"time after the last contact / crossing $(n-1)$")
    middle.legend(loc="upper left", fontsize=8, ncols=2)
    for ax in (above, middle):
        ax.set_ylim(bottom=0.0)
        ax.yaxis.get_major_locator().set_params(integer=True)
        ax.set_ylabel("pieces")
    _draw_restitutions(below, flights)
    return figure


def _draw_restitutions(ax: "Axes", flights: tuple[FreeFlight, ...]) -> None:
    for name, colour, power, marker in (
        (r"$e$ (speeds)", GREEN, 0.5, "s"),
        (r"$\eta$ (energies)", BLUE, 1.0, "o"),
    ):
        ax.plot(
            [f.point.speed for f in flights],
            [f.point.restitution**power for f in flights],
            color=colour,
            marker=marker,
            markersize=4,
            linewidth=0.9,
            label=name,
        )
    ax.set_xscale("log")
    ax.set_xlabel(r"impact speed $v_0/v^*$")
    ax.set_ylabel("restitution")
    ax.legend(loc="lower left")
