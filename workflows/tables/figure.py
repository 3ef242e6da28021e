"""Draw the forces of a table: its rows, LAMMPS's force and -dE/dr."""

from typing import TYPE_CHECKING

import numpy as np

from chaincor.lammps_inputs.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from chaincor.workflows.tables.report import TableReport

_PLACES = 1000


def draw_forces(report: "TableReport", ax: "Axes | None" = None) -> "Axes":
    """
    Draw forces against the length or angle, within the range of a report; return the axes.

    Raise InputError if the rows form no valid table.
    """
    from matplotlib.figure import Figure

    judge = report.curves
    if judge is None or report.range is None:
        raise InputError(
            f"{report.path!r} has no valid table to draw. Correct the faults of the file"
        )
    ax = Figure(layout="constrained").subplots() if ax is None else ax
    low, high = report.range
    at = np.linspace(low, high, _PLACES)
    x, energies, forces, _ = judge.rows.padded
    middle = 0.5 * (x[1:] + x[:-1])
    for places, values, look, label in (
        (middle, -np.diff(energies) / np.diff(x), "s", "-dE/dr between rows"),
        (x, forces, "o", "force column"),
    ):
        inside = (places >= low) & (places <= high)
        ax.plot(places[inside], values[inside], look, markersize=3, fillstyle="none", label=label)
    force = judge.curve(report.style, report.style_rows).force(at)
    ax.plot(at, force, "-", linewidth=1, label=f"LAMMPS, {report.style} {report.style_rows}")
    ax.set_xlabel("angle" if report.kind in ("angle", "dihedral") else "distance")
    ax.set_ylabel("force")
    ax.set_title(report.keyword)
    ax.legend()
    return ax
