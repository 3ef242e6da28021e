"""Beyond the paper: in which modes the lost energy sits, across the range of speeds."""

from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.figures.style import new_figure
from chaincor.workflows.reproduce.figures.figure import Figure
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.tables import table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

_DECADES = 6.0
# Speeds of the panel of curves, of those that are there the nearest.
_SHOWN = (0.01, 0.1, 0.4, 0.78, 2.0, 5.0)


def mode_spectra(measured: Measurements) -> Figure:
    """Return the energy of each mode after the collision, against speed."""
    points = [p for p in measured.select("curves", "lj") if len(_energies(p))]
    rows = [
        {"speed": p.speed, "mode": j, "share": float(share)}
        for p in points
        for j, share in enumerate(_shares(p))
    ]
    half = ", ".join(f"{half_of_vibration(p)} at {p.speed:.3g} v*" for p in _nearest(points))
    return Figure(
        key="mode_spectra",
        title="Beyond the paper: where the lost energy sits",
        caption=(
            "Harmonic energy of the free chain's modes after the last contact, as a share of the "
            f"energy at impact; lj, n = {measured.plan.curve_particles}. Half of the vibrational "
            f"energy is in the lowest modes up to j = {half}. A broken chain has no modes: "
            "where chains break, the shares say only on what length scale the pieces move."
        ),
        table=table_of(rows),
        draw=lambda: _draw(points),
    )


def _energies(point: Point) -> np.ndarray:
    return np.asarray(point.answer.arrays.get("mode_energies", ())) if point.answer else np.empty(0)


def _shares(point: Point) -> np.ndarray:
    energy = 0.5 * point.particles * point.scene.impact_velocity**2
    return _energies(point) / energy


def half_of_vibration(point: Point) -> int:
    """Return the mode j >= 1 up to which half of the vibrational energy lies."""
    vibration = np.cumsum(_shares(point)[1:])
    return int(np.searchsorted(vibration, 0.5 * vibration[-1])) + 1


def _nearest(points: list[Point]) -> list[Point]:
    chosen = {}
    for speed in _SHOWN:
        if points:
            nearest = min(points, key=lambda p: abs(np.log(p.speed / speed)))
            chosen[nearest.speed] = nearest
    return list(chosen.values())


def _draw(points: list[Point]) -> "Canvas":
    import matplotlib as mpl
    from matplotlib.colors import LogNorm

    figure, (above, below) = new_figure(2, 1, figsize=(6.4, 7.4))
    if not points:
        return figure
    speeds = np.array([p.speed for p in points])
    shares = np.array([_shares(p)[1:] for p in points])
    j = np.arange(1, shares.shape[1] + 1)
    top = float(np.max(shares))
    mesh = above.pcolormesh(
        j,
        speeds,
        np.maximum(shares, top * 10.0**-_DECADES),
        norm=LogNorm(top * 10.0**-_DECADES, top),
        cmap="viridis",
        shading="nearest",
        rasterized=True,
    )
    above.set_xscale("log")
    above.set_yscale("log")
    above.set_xlabel(r"mode $j$")
    above.set_ylabel(r"impact speed $v_0/v^*$")
    above.grid(False)
    figure.colorbar(mesh, ax=above, label=r"$E_j/E$", pad=0.02)
    shown = _nearest(points)
    colours = mpl.colormaps["plasma"](np.linspace(0.0, 0.85, len(shown)))
    for point, colour in zip(shown, colours, strict=True):
        below.plot(
            j, _shares(point)[1:], color=colour, linewidth=0.9, label=rf"${point.speed:.3g}\,v^*$"
        )
    below.set_xscale("log")
    below.set_yscale("log")
    below.set_ylim(top * 10.0**-_DECADES, 3.0 * top)
    below.set_xlabel(r"mode $j$")
    below.set_ylabel(r"share of the energy $E_j/E$")
    below.legend(loc="lower left", ncols=2, fontsize=8)
    return figure
