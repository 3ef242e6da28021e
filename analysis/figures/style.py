"""Define the common style of figures, and the rest positions of drawn particles."""

from typing import TYPE_CHECKING, Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The colours are from Okabe and Ito (2008), "Color universal design".
BLUE = "#0072B2"
ORANGE = "#E69F00"
GREEN = "#009E73"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
SKY = "#56B4E9"
BLACK = "#000000"
GREY = "#8A8A8A"
CYCLE = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK)
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
LINE_STYLES = ("-", "--", "-.", ":")
TIME = r"time since first contact ($\sqrt{m/k}$)"

SETTINGS: Any = {
    "figure.figsize": (6.0, 3.9),
    "figure.dpi": 110,
    "figure.constrained_layout.use": True,
    "savefig.dpi": 200,
    "font.size": 10,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.4,
    "lines.markersize": 4.0,
}


def new_figure(rows: int = 1, columns: int = 1, **options: Any) -> "tuple[Figure, Any]":
    """
    Make a figure and its panels in the common style, without a window or global state.

    `options` are `figsize` and the options of ``Figure.subplots``.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    size = options.pop("figsize", None)
    with mpl.rc_context(SETTINGS):
        figure = Figure(figsize=size)
        FigureCanvasAgg(figure)
        return figure, figure.subplots(rows, columns, **options)


def look(number: int) -> dict[str, str]:
    """
    Return colour, marker and line style of a curve, counted from 0.

    The first 28 curves all differ in colour or line style. The first 196 curves all differ in
    colour, line style or marker.
    """
    turn, place = divmod(number, len(CYCLE))
    return {
        "color": CYCLE[place],
        "marker": MARKERS[(place + turn) % len(MARKERS)],
        "linestyle": LINE_STYLES[turn % len(LINE_STYLES)],
    }


def choose_axes(ax: "Axes | None") -> "Axes":
    """Return the given axes, or the axes of a new figure."""
    return new_figure()[1] if ax is None else ax


def legend_above(ax: "Axes", columns: int = 3) -> None:
    """Put the legend above the panel, without covering data or the common factor of the y axis."""
    from matplotlib.ticker import ScalarFormatter

    from chaincor.analysis.figures.offset_in_label import OffsetInLabel

    if type(ax.yaxis.get_major_formatter()) is ScalarFormatter:
        ax.yaxis.set_major_formatter(OffsetInLabel())
    ax.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.3,
        handlelength=1.6, columnspacing=1.4, frameon=False, fontsize=9,
    )  # fmt: skip


def rest_positions(particles: int, targets: int = 0) -> Array:
    """
    Return the rest positions of particles, in natural bond lengths.

    Particle 1 of the chain is at 0. The first `targets` particles are those of a free target, from
    its far end to the contact. The last of them is also at 0.
    """
    chain = np.arange(float(particles - targets))
    return np.concatenate((np.arange(1.0 - targets, 1.0), chain)) if targets else chain
