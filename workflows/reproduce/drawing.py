"""Define the figures of the report, with caption and data, and draw points."""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import CYCLE, MARKERS, SETTINGS, new_figure
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.reproduce.curve import Curve
from chaincor.workflows.reproduce.measurements import MeasuredPoint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
else:  # Importing Matplotlib is slow. It is therefore imported only to draw.
    Axes = Any

IMPACT_SPEED = r"impact speed $v_0/v^*$"
# This seed fixes the ids of elements in SVG files, so that equal data give equal files.
_SALT = "chaincor"
# Error bars are drawn only if they are larger than half the height of a symbol, in units of the
# vertical axis.
_SEEN = 0.008


@dataclass(frozen=True)
class Figure:
    """Figure of the report."""

    key: str  #: Name of the files of the figure.
    title: str  #: Title in a few words.
    caption: str  #: Caption: what the figure shows, where the data come from, and what to look for.
    alt: str  #: Alternative text for readers who cannot see the figure.
    draw: Callable[..., None]  #: Function that draws the figure into its panels.
    #: Data of the figure, one record for each row, with equal keys; empty for a drawing.
    records: Sequence[Mapping[str, Any]] = ()
    #: Power laws that were fitted to the data, as rows for the report's table.
    fits: Sequence[Mapping[str, Any]] = ()
    size: tuple[float, float] = (6.4, 3.9)  #: Width and height in inches.
    panels: tuple[float, ...] = (1.0,)  #: Relative heights of the panels, from the top.
    sharex: bool = False  #: Whether the panels share one x axis.

    def to_csv(self) -> str:
        """Return the data as CSV, with all digits of each number."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.records[0] if self.records else ())
        for record in self.records:
            writer.writerow(["" if v is None or v != v else v for v in record.values()])
        return text.getvalue()

    def render(self) -> dict[str, bytes]:
        """Draw the figure; return the contents of its files under the keys ``png`` and ``svg``."""
        import matplotlib as mpl

        layout: dict[str, Any] = {"height_ratios": self.panels, "sharex": self.sharex}
        with mpl.rc_context(SETTINGS | {"svg.hashsalt": _SALT}):
            canvas, axes = new_figure(len(self.panels), figsize=self.size, squeeze=False, **layout)
            self.draw(*axes[:, 0])
            rendered = {}
            for kind, metadata in (("png", {}), ("svg", {"Date": None})):
                buffer = io.BytesIO()
                canvas.savefig(buffer, format=kind, metadata=metadata)
                rendered[kind] = buffer.getvalue()
        return rendered


def point_record(point: MeasuredPoint) -> dict[str, Any]:
    """Return a point as a row of data: scene, plotted value, error bar, results of both engines."""
    record: dict[str, Any] = {
        "potential": point.scene.label,
        "power_order": point.scene.power_order,
        "particles": point.particles,
        "speed": point.speed,
        "velocity": point.scene.impact_velocity,
        "restitution": point.restitution,
        "restitution_error": point.error,
        "kinematic_restitution": point.restitution**0.5,
        "contacts": point.contacts,
        "contacts_per_particle": point.contacts_per_particle,
        "source": point.source,
        "agrees": point.agrees,
    }
    for engine, answer in (("lammps", point.lammps), ("reference", point.reference)):
        result = {} if answer is None else answer.result
        record |= {
            f"{engine}_{name}": result.get(name)
            for name in ("restitution", "restitution_error", "scheme", "timestep")
        }
        record[f"{engine}_failure"] = None if answer is None else answer.failure
    return record


def draw_curves(ax: Axes, curves: Mapping[str, Curve]) -> None:
    """Draw each labelled curve in its own colour, with its points joined."""
    for (label, curve), color, marker in zip(curves.items(), CYCLE, MARKERS, strict=False):
        draw_points(ax, curve, label=label, color=color, marker=marker, line=True)


def draw_map(ax: Axes, x: ArrayLike, y: ArrayLike, values: Array, norm: Any) -> Any:
    """Draw values, of shape (y, x), as colours, and return the mesh for a colour bar."""
    looks: Any = {"cmap": "viridis", "shading": "nearest", "rasterized": True}
    ax.grid(False)
    return ax.pcolormesh(x, y, values, norm=norm, **looks)


def draw_points(
    ax: Axes,
    curve: Curve,
    *,
    label: str | None,
    color: str,
    marker: str = "o",
    line: bool = False,
    size: float = 4.5,
) -> None:
    """
    Draw the points of a curve, with one style for each engine.

    Filled symbols are results of LAMMPS, open symbols those of the reference engine, and crosses
    are limits. Error bars are drawn if they are larger than a symbol. An error bar is dotted if it
    mostly covers the effect of a possible later contact. If `line` is true, lines join the points.
    """
    points, x, y, bars = curve.points, curve.x, curve.y, np.nan_to_num(curve.errors)
    if line:
        ax.plot(x, y, color=color, linewidth=0.9, alpha=0.6)
    kinds = np.array(["limit" if point.is_limit else point.source for point in points])
    looks: dict[str, Any] = {"color": color, "markersize": size, "markeredgewidth": 0.9}
    for kind, marks, face in (
        ("lammps", marker, color),
        ("reference", marker, "white"),
        ("limit", "x", color),
    ):
        chosen = kinds == kind
        if np.any(chosen):
            ax.plot(x[chosen], y[chosen], marks, markerfacecolor=face, label=label, **looks)
            label = None  # Each set of points gets only one entry in the legend.
    seen = bars > _SEEN * np.ptp(y) if y.size else np.zeros(0, dtype=bool)
    is_open = np.array([point.is_open for point in points], dtype=bool)
    for chosen, style in ((seen & ~is_open, "solid"), (seen & is_open, "dotted")):
        ends = (y - bars)[chosen], (y + bars)[chosen]
        ax.vlines(x[chosen], *ends, color=color, linestyle=style, linewidth=1.0)
