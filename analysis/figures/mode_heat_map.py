"""Mode energies over time: which modes the contacts feed, and when."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import BLACK, choose_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DECADES = 5.0


def plot_mode_heat_map(
    times: ArrayLike,
    mode_energies: ArrayLike,
    total_energy: float,
    *,
    last_contact: float | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw E_j/E as colour over time and j, on a logarithmic scale.

    Parameters
    ----------
    times : array_like of shape (frames,)
        Time since the first contact; need not be regular.
    mode_energies : array_like of shape (frames, n)
        E_j of each frame, of which j = 0 (translation) is not drawn.
    total_energy : float
        E, the kinetic energy at impact.
    last_contact : float, optional
        Time of the last contact, marked by a line.
    ax : matplotlib.axes.Axes, optional
        Axes to draw into.

    Returns
    -------
    matplotlib.axes.Axes
        The axes.
    """
    from matplotlib.colors import LogNorm

    ax = choose_axes(ax)
    time, first = np.unique(np.asarray(times, dtype=float), return_index=True)
    share = np.asarray(mode_energies, dtype=float)[first, 1:] / total_energy
    top = float(np.max(share))
    norm = LogNorm(vmin=top * 10.0**-_DECADES, vmax=top)
    mesh = ax.pcolormesh(
        time,
        np.arange(1, share.shape[1] + 1),
        np.clip(share.T, norm.vmin, None),
        norm=norm,
        # What holds nothing has the colour of the paper, in the dark as well.
        cmap="magma_r",
        shading="nearest",
        rasterized=True,
    )
    if last_contact is not None:
        ax.axvline(last_contact, color=BLACK, linewidth=1.2, linestyle=":")
        ax.annotate(
            "last contact",
            (last_contact, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 2),
            textcoords="offset points",
            fontsize=8,
            ha="right",
        )
    ax.grid(visible=False)
    ax.set_xlabel(r"time since first contact ($\sqrt{m/k}$)")
    ax.set_ylabel(r"mode $j$")
    bar = ax.figure.colorbar(mesh, ax=ax, extend="min", pad=0.02)
    bar.set_label(r"share of the energy $E_j/E$")
    return ax
