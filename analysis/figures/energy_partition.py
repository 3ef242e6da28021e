"""Where the energy is, in time."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import BLACK, BLUE, ORANGE, choose_axes, legend_above

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_energy_partition(
    times: ArrayLike,
    translation: ArrayLike,
    vibration: ArrayLike,
    total_energy: float,
    *,
    last_contact: float | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw translation and vibration as stacked shares of the energy at impact.

    Energies are of shape (frames,); after `last_contact` nothing changes any more.
    """
    ax = choose_axes(ax)
    ax.stackplot(
        times,
        np.asarray(translation, dtype=float) / total_energy,
        np.asarray(vibration, dtype=float) / total_energy,
        colors=[BLUE, ORANGE],
        labels=["translation", "vibration"],
        linewidth=0.0,
        alpha=0.85,
    )
    if last_contact is not None:
        ax.axvline(last_contact, color=BLACK, linewidth=1.0, linestyle=":", label="last contact")
    end = float(np.max(times))
    if last_contact:
        end = min(end, 1.25 * last_contact)
    if end > float(np.min(times)):  # a single particle is gone after its contact
        ax.set_xlim(float(np.min(times)), end)
    ax.set_ylim(0.0, 1.05)
    ax.set_xlabel(r"time since first contact ($\sqrt{m/k}$)")
    ax.set_ylabel("share of the energy at impact")
    legend_above(ax)
    return ax
