"""Draw chains that break, and both coefficients of restitution. The paper has no such figure."""

from itertools import groupby
from typing import Any

import numpy as np

from chaincor.analysis.figures.style import CYCLE, GREEN, GREY, MARKERS
from chaincor.workflows.reproduce.drawing import IMPACT_SPEED, Axes, Figure, draw_map
from chaincor.workflows.reproduce.free_flight import LAST, MOMENTS, SAMPLED, FreeFlight


def figure(flights: tuple[FreeFlight, ...]) -> Figure:
    """Return the figure of e and eta, and of an lj chain's fragments against speed and time."""

    def draw(above: Axes, middle: Axes, below: Axes) -> None:
        speeds = [f.speed for f in flights]
        for moment, color, marker in zip(MOMENTS, CYCLE, MARKERS, strict=False):
            fewest, most = np.array([f.pieces_at(moment) for f in flights]).T
            above.plot(speeds, most, marker, color=color, markersize=3.5, label=_when(moment))
            above.vlines(speeds, fewest, most, color, linewidth=0.8)
        above.legend(loc="upper left", fontsize=8)
        above.set(xscale="log", ylabel="pieces")
        above.set_ylim(bottom=0.0)
        above.locator_params("y", integer=True)
        _draw_times(middle, flights)
        eta = [f.point.restitution for f in flights]
        below.plot(speeds, [x**0.5 for x in eta], "s-", color=GREEN, linewidth=0.9, label="$e$")
        below.plot(speeds, eta, color=GREY, linewidth=0.9, label=r"$\eta$")
        below.legend(loc="lower right", fontsize=8)
        below.set(xscale="log", xlabel=IMPACT_SPEED, ylabel=r"restitution")

    return Figure(
        key="breaking_and_two_restitutions",
        title="Beyond the paper: breaking chains, and the two coefficients of restitution",
        caption=(
            "Top: number of pieces of lj chains at several times after the last "
            "contact, in crossings of sound (n − 1). Middle: the larger count at "
            "all speeds and times. The section [beyond the paper](#beyond) says "
            "when chains are in pieces. A bond counts as broken when the kinetic "
            "energy of its two sides moving apart exceeds its remaining binding "
            "energy. Pieces are the parts between broken bonds. They can join "
            "again through a third piece or through their own "
            f"vibration{_rejoined(flights)}. The final states of LAMMPS and of the "
            "reference engine are both right within the error bar of η, but their "
            "difference grows in chains with much internal energy. If the two "
            "counts differ, a line joins them in the top panel, a white dot marks "
            "them in the middle panel, and the count is undetermined. Bottom: e = "
            "√η, the ratio of speeds, which others call the coefficient of "
            "restitution, beside the paper's η."
        ),
        alt=(
            "Chains between 0.75 and 7.5 v* are in pieces after 40 crossings, in "
            "up to 8 pieces at 1.5 v*. The number of pieces grows with time and is "
            "least certain near 1.5 v*."
        ),
        draw=draw,
        records=[
            {
                "speed": f.speed,
                "crossings": time,
                "fewest_pieces": f.pieces_at(time)[0],
                "most_pieces": f.pieces_at(time)[1],
                "restitution": f.point.restitution,
                "kinematic_restitution": f.point.restitution**0.5,
            }
            for f in flights
            for time in SAMPLED
        ],
        size=(6.4, 8.4),
        panels=(1.0, 1.0, 1.0),
        sharex=True,
    )


def breaking(flights: tuple[FreeFlight, ...]) -> str:
    """Describe which lj chains break, when they break, and into how many fragments."""
    if all(f.is_whole for f in flights):
        return "No chain was in pieces."
    parts = []
    for moment in MOMENTS:
        counts = [f.pieces_at(moment) for f in flights]
        surely = _spans(flights, [fewest > 1 for fewest, _ in counts])
        unsure = _spans(flights, [fewest <= 1 < most for fewest, most in counts])
        text = f"{_when(moment)}, {surely}" if surely else f"none {_when(moment)}"
        parts.append(text + (f" (undetermined {unsure})" if unsure else ""))
    most = max(flights, key=lambda f: f.pieces_at(LAST)[1])
    fewest, largest = most.pieces_at(LAST)
    count = f"{largest}" if fewest == largest else f"{fewest} or {largest}"
    return (
        "The speeds at which a chain is in pieces depend on the time: "
        f"{'; '.join(parts)}. Most, {count}, there are at {most.speed:.3g} v* "
        f"after {LAST:g} crossings (n = {most.point.particles}; [the "
        "figure](#breaking_and_two_restitutions)). A chain whose internal "
        "energy exceeds the energy of a bond goes on losing pieces, so there "
        "is no final count."
    )


def _spans(flights: tuple[FreeFlight, ...], wanted: list[bool]) -> str:
    """
    Write the chosen speeds.

    Neighbouring speeds are joined to ranges, such as ``between 0.75 and 5.6 v*``.
    """
    spans = []
    runs = groupby(zip(flights, wanted, strict=True), key=lambda pair: pair[1])
    for speeds in ([f.speed for f, _ in run] for is_wanted, run in runs if is_wanted):
        if speeds[-1] == flights[-1].speed:
            spans.append(f"from {speeds[0]:.2g} v* on")
        elif len(speeds) == 1:
            spans.append(f"at {speeds[0]:.2g} v*")
        else:
            spans.append(f"between {speeds[0]:.2g} and {speeds[-1]:.2g} v*")
    return " and ".join(spans)


def _rejoined(flights: tuple[FreeFlight, ...]) -> str:
    """Describe a fast chain whose end falls behind and later catches up with the chain."""
    for flight in flights:
        first = flight.pieces_at(0.0)[0]
        if first > 1 and flight.pieces_at(1.0)[1] == 1:
            whole = next(t for t in SAMPLED if flight.pieces_at(t)[1] == 1)
            return (
                f", as at {flight.speed:.2g} v*, where the end at the wall lags behind at the last "
                f"contact, {first} pieces, and has caught up {whole:.2g} crossings later"
            )
    return ""


def _when(moment: float) -> str:
    if moment == 0.0:
        return "at the last contact"
    return f"after {moment:g} crossing{'s' if moment != 1.0 else ''}"


def _draw_times(ax: Axes, flights: tuple[FreeFlight, ...]) -> None:
    """
    Draw the largest number of fragments as a colour over speed and time.

    Dots mark places where the motions differ in this number.
    """
    from matplotlib.colors import BoundaryNorm

    times = SAMPLED[1:]
    counts = np.array([[f.pieces_at(time) for f in flights] for time in times])
    fewest, most = counts[..., 0], counts[..., 1]
    speeds = np.array([f.speed for f in flights])
    levels = np.arange(0.5, max(int(most.max()), 2) + 1.0)
    mesh = draw_map(ax, speeds, times, most, BoundaryNorm(levels, 256))
    rows, columns = np.nonzero(fewest < most)
    dots: dict[str, Any] = {"color": "white", "markersize": 2.5, "label": "count undetermined"}
    ax.plot(speeds[columns], np.array(times)[rows], ".", **dots)
    ax.legend(loc="lower left", fontsize=8, facecolor=GREY)
    ax.set(xscale="log", yscale="log")
    ax.set_ylabel("time after the last\ncontact / crossing")
    # The colour bar lies outside the axes, so that all panels have the same width.
    beside = ax.inset_axes((1.02, 0.0, 0.03, 1.0))
    bar = ax.figure.colorbar(mesh, cax=beside, label="pieces")
    bar.set_ticks((0.5 * (levels[1:] + levels[:-1])).astype(int).tolist())
