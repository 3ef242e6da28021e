"""Plot energies and bond lengths against time, and the times and speeds of contacts."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import (
    BLACK,
    BLUE,
    ORANGE,
    SKY,
    TIME,
    VERMILION,
    choose_axes,
    legend_above,
)
from chaincor.analysis.theory import PAIR_INTERVAL, PAIR_SPEED
from chaincor.lammps_inputs.arrays import Array

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
    Draw translation and vibration, stacked, as fractions of the energy at impact.

    Energies have the shape (frames,). `last_contact` is the time after which they do not change.
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
    if end > float(np.min(times)):  # the motion of a single particle ends with its contact
        ax.set_xlim(float(np.min(times)), end)
    ax.set(ylim=(0.0, 1.05), xlabel=TIME, ylabel="share of the energy at impact")
    legend_above(ax)
    return ax


def plot_bond_lengths(
    times: ArrayLike, shortest: ArrayLike, longest: ArrayLike, *, ax: "Axes | None" = None
) -> "Axes":
    """Draw the shortest and longest bond of the chain, of shape (frames,), against time."""
    ax = choose_axes(ax)
    ax.fill_between(times, shortest, longest, color=SKY, alpha=0.35, linewidth=0.0)
    ax.plot(times, longest, color=VERMILION, linewidth=1.0, label="longest bond")
    ax.plot(times, shortest, color=BLUE, linewidth=1.0, label="shortest bond")
    ax.axhline(1.0, color=BLACK, linewidth=0.8, linestyle="--", label="natural length")
    # On a linear scale, the bonds of a broken chain would hide the range of the other bonds.
    if float(np.nanmax(longest)) > 4.0:
        ax.set_yscale("log")
    ax.set_xlim(np.min(times), np.max(times))
    ax.set(xlabel=TIME, ylabel="bond length (natural lengths)")
    legend_above(ax)
    return ax


def plot_contact_intervals(
    contact_times: ArrayLike, *, stiffness: float | None = 1.0, ax: "Axes | None" = None
) -> "Axes":
    """
    Draw the time between contacts against the number of the contact.

    `stiffness`, U''(1)/m, gives the line of the n = 2 chain at low speed. With None no line is
    drawn.
    """
    intervals = np.diff(np.asarray(contact_times, dtype=float))
    line = None if stiffness is None else PAIR_INTERVAL / stiffness**0.5
    ax = _plot_by_contact(intervals, (BLUE, "o"), line, r"$n = 2$, low speed: $\pi/\sqrt{2}$", ax)
    ax.set_ylabel(r"interval $t_{q+1} - t_q$ ($\sqrt{m/k}$)")
    return ax


def plot_contact_speeds(
    contact_speeds: ArrayLike,
    impact_velocity: float,
    *,
    pair_line: bool = True,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw the incoming speed of particle 1 against the number of the contact.

    `pair_line` draws the estimate from the n = 2 chain of equal masses.
    """
    speeds = np.asarray(contact_speeds, dtype=float) / impact_velocity
    line = PAIR_SPEED if pair_line else None
    label = r"$n = 2$ estimate: $\pi/2\sqrt{2}$"
    ax = _plot_by_contact(speeds, (VERMILION, "s"), line, label, ax)
    ax.set_ylabel(r"incoming speed $v_q/v_0$")
    return ax


def _plot_by_contact(
    values: Array, look: tuple[str, str], line: float | None, label: str, ax: "Axes | None"
) -> "Axes":
    """Draw values against the number of the contact, and a dashed line for the n = 2 chain."""
    ax = choose_axes(ax)
    number = np.arange(1, values.size + 1)
    ax.plot(number, values, color=look[0], marker=look[1], markersize=2.8, linestyle="none")
    if line is not None:
        ax.axhline(line, color=BLACK, linewidth=1.0, linestyle="--", label=label)
    ax.margins(y=0.1)
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel(r"contact $q$")
    if line is not None:
        legend_above(ax)
    return ax
