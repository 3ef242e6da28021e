"""Restitution against impact speed or chain length."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import BLACK, CYCLE, MARKERS, choose_axes, legend_above
from chaincor.analysis.theory import harmonic_dissipation_law

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_restitution(
    curves: Mapping[str, tuple[ArrayLike, ArrayLike]],
    *,
    errors: Mapping[str, ArrayLike] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw eta against the impact speed, one curve a potential.

    Parameters
    ----------
    curves : mapping of str to (speeds, restitutions)
        Speeds in units of v*, and eta, the ratio of energies.
    errors : mapping of str to array_like, optional
        Error bars of eta.
    ax : matplotlib.axes.Axes, optional
        Axes to draw into.

    Returns
    -------
    matplotlib.axes.Axes
        The axes.
    """
    ax = choose_axes(ax)
    for (label, (speeds, values)), colour, marker in zip(
        curves.items(), CYCLE, MARKERS, strict=False
    ):
        order = np.argsort(speeds)
        bars = None if errors is None or label not in errors else np.asarray(errors[label])[order]
        ax.errorbar(
            np.asarray(speeds, dtype=float)[order],
            np.asarray(values, dtype=float)[order],
            yerr=bars,
            color=colour,
            marker=marker,
            markersize=4.0,
            linewidth=1.1,
            capsize=2.0,
            label=label,
        )
    ax.set_xscale("log")
    ax.set_xlabel(r"impact speed $v_0/v^*$")
    ax.set_ylabel(r"restitution $\eta = K_r/K_i$")
    legend_above(ax, columns=max(3, len(curves)))
    return ax


def plot_dissipation(
    particles: ArrayLike,
    restitutions: ArrayLike,
    *,
    label: str = "harmonic chain",
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw 1 - eta against the length of the chain, with the n^(-2/3) law.

    Parameters
    ----------
    particles : array_like
        Numbers of particles.
    restitutions : array_like
        eta of each.
    label : str
        Name of the points.
    ax : matplotlib.axes.Axes, optional
        Axes to draw into.

    Returns
    -------
    matplotlib.axes.Axes
        The axes.
    """
    ax = choose_axes(ax)
    n = np.sort(np.asarray(particles, dtype=float))
    ax.plot(
        particles,
        1.0 - np.asarray(restitutions, dtype=float),
        color=CYCLE[0],
        marker="o",
        markersize=4.0,
        linestyle="none",
        label=label,
    )
    ax.plot(n, harmonic_dissipation_law(n), color=BLACK, linewidth=1.1, label=r"$0.652\,n^{-2/3}$")
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel(r"number of particles $n$")
    ax.set_ylabel(r"dissipation $1 - \eta$")
    legend_above(ax)
    return ax
