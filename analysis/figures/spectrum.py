"""Energy of each mode after the collision."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import BLUE, VERMILION, choose_axes, legend_above

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DECADES = 8.0


def plot_spectrum(
    mode_energies: ArrayLike,
    total_energy: float,
    *,
    theory: ArrayLike | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw E_j/E against j, on logarithmic scales.

    Harmonic energies of a chain that broke mean nothing: for such, give those of
    ``chaincor.analysis.modes.kinetic_mode_energies``.

    Parameters
    ----------
    mode_energies : array_like of shape (n,)
        E_j, of which j = 0 (translation) is not drawn.
    total_energy : float
        E, the kinetic energy at impact.
    theory : array_like of shape (n - 1,), optional
        E_j for j >= 1 after Basile and Dumont.
    ax : matplotlib.axes.Axes, optional
        Axes to draw into.

    Returns
    -------
    matplotlib.axes.Axes
        The axes.
    """
    from matplotlib.ticker import StrMethodFormatter

    ax = choose_axes(ax)
    share = np.asarray(mode_energies, dtype=float)[1:] / total_energy
    j = np.arange(1, share.size + 1)
    if theory is not None:
        predicted = np.asarray(theory, dtype=float) / total_energy
        ax.plot(
            j,
            predicted,
            color=VERMILION,
            linewidth=0.9,
            alpha=0.8,
            label="Basile-Dumont, equal contacts",
        )
    ax.plot(
        j,
        share,
        color=BLUE,
        marker="o",
        markersize=2.6,
        linestyle="none",
        label="after the contacts",
    )
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(0.85, 1.2 * max(j[-1], 2))
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    if np.max(share) > 0.0:
        largest = np.max(share) if theory is None else max(np.max(share), np.max(predicted))
        top = 3.0 * float(largest)
        low = max(0.3 * float(np.min(share[share > 0.0])), top * 10.0**-_DECADES)
        ax.set_ylim(low, top)
    ax.set_xlabel(r"mode $j$")
    ax.set_ylabel(r"share of the energy $E_j/E$")
    legend_above(ax, columns=2)
    return ax
