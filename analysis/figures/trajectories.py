"""Plot world lines of a collision, and the path of the sound from the first contact."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.figures.style import (
    BLUE,
    GREY,
    ORANGE,
    TIME,
    VERMILION,
    choose_axes,
    legend_above,
    rest_positions,
)
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.given_numbers import positive_number_given

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_LINES = 40


def plot_trajectories(
    times: ArrayLike,
    displacements: ArrayLike,
    *,
    contact_times: ArrayLike = (),
    sound_speed: float = 1.0,
    end_time: float | None = None,
    magnification: float | None = None,
    targets: int = 0,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw positions against time, with the path of the sound from the first contact.

    `displacements`, u_i = x_i - (i - 1), have the shape (frames, n), and times are relative to the
    first contact. The first `targets` particles are those of a free target, from its far end to the
    contact. `sound_speed` is the speed of small waves, sqrt(U''(1)). By default `end_time` is
    slightly after the last contact. Displacements are magnified by the factor in the axis label. By
    default the factor is as large as possible without crossing lines. Raises InputError if
    `magnification` is not a positive finite number.
    """
    if magnification is not None:
        magnification = positive_number_given("magnification", magnification)
    ax = choose_axes(ax)
    time = np.asarray(times, dtype=float)
    u = np.asarray(displacements, dtype=float)
    n = u.shape[1]
    contacts = np.asarray(contact_times, dtype=float)
    if end_time is None:
        last = contacts[-1] if contacts.size else time[-1]
        end_time = float(min(time[-1], 1.15 * last if last > 0.0 else time[-1]))
    shown = time <= end_time
    factor = _choose_magnification(u[shown]) if magnification is None else magnification
    x = factor * u[shown] + rest_positions(n, targets)
    stride = max(1, int(np.ceil(n / _MOST_LINES)))
    picked = np.unique(np.append(np.arange(0, n, stride), n - 1))
    lines = ax.plot(time[shown], x[:, picked], color=GREY, linewidth=0.7)
    lines[0].set_label("particles" if stride == 1 else f"one particle in {stride}")
    ax.plot(time[shown], x[:, targets], color=BLUE, linewidth=1.2, label="particle 1")
    if n - targets > 1:
        signal, place = _sound_path(time[shown], x[:, targets:], sound_speed)
        label = "sound, small waves"
        ax.plot(signal, place, color=ORANGE, linewidth=1.6, linestyle="--", label=label)
    if contacts.size:
        within = contacts[contacts <= end_time]
        ax.plot(
            within,
            np.interp(within, time[shown], x[:, targets]) if targets else np.zeros_like(within),
            color=VERMILION,
            marker="o",
            markersize=3.0 if contacts.size < 60 else 1.8,
            linestyle="none",
            label="contacts",
            zorder=3,
            clip_on=False,
        )
    if end_time > min(0.0, time[0]):  # the motion of a single particle ends with its contact
        ax.set_xlim(min(0.0, time[0]), end_time)
    if targets == 0:
        ax.set_ylim(bottom=-0.02 * n)
    magnified = "" if factor == 1.0 else f",\ndisplacements magnified {factor:g} times"
    place_name = "position" if targets else "distance from the wall"
    ax.set(xlabel=TIME, ylabel=f"{place_name} (bond lengths){magnified}")
    legend_above(ax, columns=4)
    return ax


def _choose_magnification(displacements: Array) -> float:
    """Return a round factor by which displacements reach at most a fifth of the chain's length."""
    n = displacements.shape[1]
    squeeze = -float(np.min(np.diff(displacements, axis=1), initial=0.0))
    largest = float(np.max(np.abs(displacements)))
    limit = min(0.2 * n / largest if largest > 0.0 else 1.0, 0.9 / squeeze if squeeze else np.inf)
    if limit < 2.0:
        return 1.0
    decade = 10.0 ** np.floor(np.log10(limit))
    return float(decade * max(step for step in (1.0, 2.0, 5.0) if step * decade <= limit))


def _sound_path(times: Array, x: Array, sound_speed: float) -> tuple[Array, Array]:
    """Return times and positions of a sound signal that travels to the free end and back."""
    n = x.shape[1]
    fine = np.linspace(0.0, min(2.0 * (n - 1) / sound_speed, times[-1]), 20 * n)
    material = sound_speed * fine
    material = np.where(material > n - 1, 2.0 * (n - 1) - material, material)
    lower = np.clip(material.astype(int), 0, n - 2)
    part = material - lower
    place = np.empty_like(fine)
    for k, (time, i, p) in enumerate(zip(fine, lower, part, strict=True)):
        near = np.interp(time, times, x[:, i])
        place[k] = (1.0 - p) * near + p * np.interp(time, times, x[:, i + 1])
    return fine, place
