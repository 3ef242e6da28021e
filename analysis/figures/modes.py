"""Figures of a chain's mode energies, during and after the collision."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import (
    BLACK,
    BLUE,
    TIME,
    VERMILION,
    choose_axes,
    legend_above,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SHARE = r"share of the energy $E_j/E$"
_DECADES, _DECADES_OF_COLOUR = 8.0, 5.0


def plot_spectrum(
    mode_energies: ArrayLike,
    total_energy: float,
    *,
    theory: ArrayLike | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw E_j/E for modes j >= 1 on logarithmic scales; E is the kinetic energy at impact.

    `mode_energies` are E_j for j >= 0; `theory` are those of Basile and Dumont for j >= 1. Harmonic
    energies of a broken chain have no meaning; for such a chain, give the energies from
    ``chaincor.analysis.modes.kinetic_mode_energies``.
    """
    from matplotlib.ticker import StrMethodFormatter

    ax = choose_axes(ax)
    share = np.asarray(mode_energies, dtype=float)[1:] / total_energy
    j = np.arange(1, share.size + 1)
    largest = float(np.max(share))
    if theory is not None:
        predicted = np.asarray(theory, dtype=float) / total_energy
        label = "Basile-Dumont, equal contacts"
        ax.plot(j, predicted, color=VERMILION, linewidth=0.9, alpha=0.8, label=label)
    ax.plot(
        j, share, color=BLUE, marker="o", markersize=2.6, linestyle="none",
        label="after the contacts",
    )  # fmt: skip
    ax.set(xscale="log", yscale="log", xlim=(0.85, 1.2 * max(j[-1], 2)))
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    if largest > 0.0:
        top = 3.0 * (largest if theory is None else max(largest, float(np.max(predicted))))
        low = max(0.3 * float(np.min(share[share > 0.0])), top * 10.0**-_DECADES)
        ax.set_ylim(low, top)
    ax.set(xlabel=r"mode $j$", ylabel=_SHARE)
    legend_above(ax, columns=2)
    return ax


def plot_mode_heat_map(
    times: ArrayLike,
    mode_energies: ArrayLike,
    total_energy: float,
    *,
    last_contact: float | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw E_j/E as a colour against time and j >= 1, on a logarithmic scale.

    Times need not be evenly spaced. `mode_energies`, of shape (frames, n), are E_j for j >= 0, and
    E is the kinetic energy at impact. A line marks the last contact.
    """
    from matplotlib.colors import LogNorm

    ax = choose_axes(ax)
    time, first = np.unique(np.asarray(times, dtype=float), return_index=True)
    share = np.asarray(mode_energies, dtype=float)[first, 1:] / total_energy
    top = float(np.max(share))
    norm = LogNorm(vmin=top * 10.0**-_DECADES_OF_COLOUR, vmax=top)
    mesh = ax.pcolormesh(
        time,
        np.arange(1, share.shape[1] + 1),
        np.clip(share.T, norm.vmin, None),
        norm=norm,
        # Modes without energy have the background colour of the light or dark design.
        cmap="magma_r",
        shading="nearest",
        rasterized=True,
    )
    if last_contact is not None:
        ax.axvline(last_contact, color=BLACK, linewidth=1.2, linestyle=":")
        ax.annotate(
            "last contact", (last_contact, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2),
            textcoords="offset points", fontsize=8, ha="right",
        )  # fmt: skip
    ax.grid(visible=False)
    ax.set(xlabel=TIME, ylabel=r"mode $j$")
    ax.figure.colorbar(mesh, ax=ax, extend="min", pad=0.02).set_label(_SHARE)
    return ax
