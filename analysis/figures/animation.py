"""A collision as a moving picture: particles on their line, and how fast each one goes."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chaincor.analysis.atomic_write import written_aside
from chaincor.analysis.figures.places import rest_positions
from chaincor.analysis.figures.style import BLACK, GREY, new_figure
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import whole_number_given

if TYPE_CHECKING:
    from matplotlib.artist import Artist

_FRAMES_PER_SECOND = 25
# An hour; each is drawn.
_MOST_FRAMES = 90_000


def animate_collision(
    times: ArrayLike,
    displacements: ArrayLike,
    velocities: ArrayLike,
    path: Path | str,
    *,
    impact_velocity: float,
    frames: int = 120,
    title: str = "",
    targets: int = 0,
) -> Path:
    """
    Write a collision as GIF, or as MP4 where ffmpeg is installed.

    Above, the velocity of each particle; below, the chain itself, coloured by velocity.

    Parameters
    ----------
    times : array_like of shape (frames,)
        Time since the first contact.
    displacements, velocities : array_like of shape (frames, n)
        States; those between are interpolated.
    path : pathlib.Path or str
        ``.gif`` or ``.mp4``.
    impact_velocity : float
        Impact speed v0.
    frames : int
        Frames of the picture, 25 a second, evenly spaced in time.
    title : str
        Settings, drawn above.
    targets : int
        How many of the particles, the first ones, are a free target's, from its far end to the
        contact; 0 for a wall, which is drawn.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    InputError
        If the ending of the file is unknown, or MP4 is asked for without ffmpeg, or `frames` is no
        number of pictures.
    """
    from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter

    frames = whole_number_given("the number of pictures", frames, most=_MOST_FRAMES)
    path = Path(path)
    if path.suffix not in (".gif", ".mp4"):
        raise InputError(f"cannot write the animation {path}; expected a name in .gif or .mp4")
    if path.suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise InputError(f"{path} needs ffmpeg, which is not installed; write a .gif instead")

    time = np.asarray(times, dtype=float)
    n = np.shape(displacements)[1]
    moments = np.linspace(time[0], time[-1], frames)
    x = _interpolate(time, np.asarray(displacements, dtype=float), moments) + rest_positions(
        n, targets
    )
    v = _interpolate(time, np.asarray(velocities, dtype=float), moments) / impact_velocity

    figure, (upper, lower) = new_figure(
        2, 1, figsize=(7.0, 3.6), sharex=True, height_ratios=(3.0, 1.0)
    )
    size = float(np.clip(3000.0 / n, 3.0, 60.0))
    limit = max(1.2, float(np.max(np.abs(v))))
    # Colours span the speeds of most particles; the few faster ones take the last colour.
    style = {"cmap": "cividis", "vmin": -1.2, "vmax": 1.2, "s": size, "linewidths": 0.0}
    (line,) = upper.plot(x[0], v[0], color=GREY, linewidth=0.7)
    points = upper.scatter(x[0], v[0], c=v[0], **style)
    beads = lower.scatter(x[0], np.zeros(n), c=v[0], **style)
    upper.axhline(0.0, color=BLACK, linewidth=0.6)
    lowest = 0.0
    if targets:
        lowest = float(np.min(x))
        lower.set_xlabel("position (bond lengths)")
    else:
        for ax in (upper, lower):
            ax.axvline(0.0, color=BLACK, linewidth=3.0)
        lower.set_xlabel("distance from the wall (bond lengths)")
    width = max(1.0, float(np.max(x)) - lowest)
    upper.set_xlim(lowest - 0.02 * width, lowest + 1.02 * width)
    upper.set_ylim(-1.1 * limit, 1.1 * limit)
    upper.set_ylabel(r"velocity $v_i/v_0$")
    lower.set_yticks([])
    lower.grid(visible=False)
    caption = upper.set_title(title, loc="left", fontsize=10)

    def draw(k: int) -> tuple["Artist", ...]:
        line.set_data(x[k], v[k])
        points.set_offsets(np.column_stack((x[k], v[k])))
        points.set_array(v[k])
        beads.set_offsets(np.column_stack((x[k], np.zeros(n))))
        beads.set_array(v[k])
        caption.set_text(f"{title}   t = {moments[k]:.1f}".strip())
        return line, points, beads, caption

    # The layout is found once: finding it for every frame would take most of the time.
    draw(0)
    figure.canvas.draw()
    figure.set_layout_engine("none")
    animation = FuncAnimation(figure, draw, frames=frames, blit=False)
    writer = PillowWriter if path.suffix == ".gif" else FFMpegWriter
    with written_aside(path) as aside:
        animation.save(str(aside), writer=writer(fps=_FRAMES_PER_SECOND), dpi=100)
    return path


def _interpolate(
    times: NDArray[np.float64], values: NDArray[np.float64], moments: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.column_stack([np.interp(moments, times, column) for column in values.T])
