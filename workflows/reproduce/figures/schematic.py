"""Draw a chain and a rigid wall (NH figure 1), with the directions of velocities."""

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, GREY, SKY, VERMILION
from chaincor.workflows.reproduce.drawing import Axes, Figure
from chaincor.workflows.reproduce.measurements import Measurements

_PARTICLES = 6


def figure(_measured: Measurements) -> Figure:
    """Return the schematic drawing, which has no data."""
    return Figure(
        key="schematic",
        title="A one-dimensional chain and a rigid wall",
        caption=(
            "The paper's figure 1. Equal particles, numbered from the wall, joined by bonds of "
            "natural length 1, fly with velocity −v₀ at a hard wall at x = 0; particle 1 alone "
            "touches it, and reverses its velocity. The paper prints the order of the particles "
            "both ways round; this is the one of its initial conditions."
        ),
        alt="A row of particles 1 to n, joined by springs, flies to the left at a wall at x = 0.",
        draw=_draw,
        size=(6.4, 1.9),
    )


def _draw(ax: Axes) -> None:
    from matplotlib.patches import Rectangle

    ax.add_patch(Rectangle((-0.5, -0.7), 0.5, 1.4, facecolor="#D9D9D9", hatch="///", linewidth=0))
    ax.plot([0, 0], [-0.7, 0.7], color=BLACK, linewidth=1.6)
    places = 1.0 + np.arange(_PARTICLES)
    zigzag = np.where(np.arange(14) % 2 == 0, 0.09, -0.09)
    zigzag[[0, 1, -2, -1]] = 0.0
    for left in places[:-1]:
        ax.plot(left + 0.2 + 0.6 * np.linspace(0.0, 1.0, 14), zigzag, color=GREY, linewidth=1.1)
    ax.plot(places, 0 * places, "o", markersize=15, color=SKY, markeredgecolor=BLUE)
    names = ["1", "2", "3", *([""] * (_PARTICLES - 4)), "n"]
    for place, name in zip(places, names, strict=True):
        ax.text(place, 0.0, name, ha="center", va="center", fontsize=9)
        ax.annotate(
            "",
            (place - 0.42, 0.42),
            (place + 0.05, 0.42),
            arrowprops={"arrowstyle": "->", "color": VERMILION, "linewidth": 1.2},
        )
    ax.text(places[-1] + 0.15, 0.42, r"$-v_0$", color=VERMILION, va="center")
    ax.annotate("", (2.0, -0.42), (1.0, -0.42), arrowprops={"arrowstyle": "<->", "linewidth": 0.8})
    ax.text(1.5, -0.5, r"$\ell = 1$", ha="center", va="top")
    ax.text(3.5, -0.5, r"bond $U(x)$,  $U''(1) = k = 1$", ha="left", va="top", color="#444444")
    ax.annotate("", (7.2, -0.85), (0.0, -0.85), arrowprops={"arrowstyle": "->", "linewidth": 0.8})
    ax.text(7.3, -0.85, r"$x$", va="center")
    ax.text(0.0, -0.98, r"$0$", ha="center", va="top")
    ax.set_xlim(-0.6, 7.5)
    ax.set_ylim(-1.3, 0.8)
    ax.set_axis_off()
