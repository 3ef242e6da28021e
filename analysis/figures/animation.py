"""Animate a collision: positions and velocities of the particles."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.atomic_write import written_aside
from chaincor.analysis.figures.style import BLACK, GREY, new_figure, rest_positions
from chaincor.analysis.output_paths import judge_output
from chaincor.analysis.showing.notebook import in_notebook, session_bar
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import whole_number_given

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

_FRAMES_PER_SECOND = 25
# Largest number of frames: one hour of animation.
_MOST_FRAMES = 90_000
# If a chain has more particles than this, its springs are drawn as straight lines. Bonds longer
# than the second number are not drawn, because they have broken or are about to break.
_MOST_COILED, _LONGEST_DRAWN = 60, 3.0


def judge_animation(path: Path) -> Path:
    """
    Return the path of an animation, after checking that it can be written.

    Raises InputError if the ending is unknown, if ffmpeg is missing for MP4, or if the path is a
    folder or another kind of file.
    """
    from matplotlib.animation import FFMpegWriter

    if path.suffix not in (".gif", ".mp4"):
        raise InputError(
            f"cannot write the animation {path}. Give a name that ends in .gif or .mp4"
        )
    if path.suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise InputError(f"{path} needs ffmpeg, which is not installed; write a .gif instead")
    judge_output(path, path.suffix)
    return path


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
    Write an animation as GIF, or as MP4 if ffmpeg is installed.

    The upper panel shows the velocity of each particle, and the lower panel the chain, coloured by
    velocity. `frames` is the number of pictures, which are evenly spaced in simulated time. 25
    pictures are shown per second. States between the given times are interpolated. The first
    `targets` particles are those of a free target, from its far end to the contact; without a
    target a wall is drawn. In a notebook, the progress is displayed.

    Raises InputError if the ending of the file is unknown, if ffmpeg is missing for MP4, or if
    `frames` is not a valid number of pictures.
    """
    from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter

    frames = whole_number_given("the number of pictures", frames, most=_MOST_FRAMES)
    path = judge_animation(Path(path))

    time = np.asarray(times, dtype=float)
    moments = np.linspace(time[0], time[-1], frames)
    x = _interpolate(time, np.asarray(displacements, dtype=float), moments)
    x += rest_positions(x.shape[1], targets)
    v = _interpolate(time, np.asarray(velocities, dtype=float), moments) / impact_velocity

    figure, draw = _stage(x, v, moments, title, targets)
    # The layout is computed once, because computing it for every frame would take most of the time.
    draw(0)
    figure.canvas.draw()
    figure.set_layout_engine("none")
    animation = FuncAnimation(figure, draw, frames=frames, blit=False)
    writer = PillowWriter if path.suffix == ".gif" else FFMpegWriter
    with written_aside(path) as aside:
        animation.save(
            str(aside),
            writer=writer(fps=_FRAMES_PER_SECOND),
            dpi=100,
            progress_callback=_progress(frames) if in_notebook() else None,
        )
    return path


def _progress(frames: int) -> Callable[[int, int], object]:
    bar = session_bar(frames)
    return lambda drawn, _: bar(drawn + 1, f"{drawn + 1} of {frames} pictures")


def _stage(
    x: Array, v: Array, moments: Array, title: str, targets: int
) -> tuple["Figure", Callable[[int], tuple["Artist", ...]]]:
    """Return a figure and a function that draws frame k; x and v have the shape (times, n)."""
    from matplotlib.lines import Line2D

    n = x.shape[1]
    figure, (upper, lower) = new_figure(
        2, 1, figsize=(7.0, 3.9), sharex=True, height_ratios=(3.0, 1.0)
    )
    size = float(np.clip(3000.0 / n, 3.0, 60.0))
    limit = max(1.2, float(np.max(np.abs(v))))
    # The colour scale ends at 1.2 v0. The few faster particles have the last colour.
    style = {"cmap": "cividis", "vmin": -1.2, "vmax": 1.2, "s": size, "linewidths": 0.0}
    (line,) = upper.plot(x[0], v[0], color=GREY, linewidth=0.7)
    points = upper.scatter(x[0], v[0], c=v[0], **style)
    (springs,) = lower.plot(*_springs(x[0], targets), color=GREY, linewidth=0.7, zorder=1)
    beads = lower.scatter(x[0], np.zeros(n), c=v[0], zorder=2, **style)
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
    upper.set(ylim=(-1.1 * limit, 1.1 * limit), ylabel=r"velocity $v_i/v_0$")
    lower.set(yticks=[], ylim=(-1.0, 1.0))
    lower.grid(visible=False)
    other = "target" if targets else "wall"
    shades = ((-1.2, f"moving to the {other}"), (0.0, "at rest"), (1.2, "moving away"))
    figure.legend(
        handles=[
            Line2D([], [], color=points.to_rgba(speed), marker="o", linestyle="", label=text)
            for speed, text in shades
        ],
        loc="outside lower center",
        ncols=3,
    )
    caption = upper.set_title(title, loc="left", fontsize=10)

    def draw(k: int) -> tuple["Artist", ...]:
        line.set_data(x[k], v[k])
        points.set_offsets(np.column_stack((x[k], v[k])))
        points.set_array(v[k])
        springs.set_data(*_springs(x[k], targets))
        beads.set_offsets(np.column_stack((x[k], np.zeros(n))))
        beads.set_array(v[k])
        caption.set_text(f"{title}   t = {moments[k]:.1f}".strip())
        return line, points, springs, beads, caption

    return figure, draw


def _springs(x: Array, targets: int) -> tuple[Array, Array]:
    """Return a zigzag line for each bond, except very long bonds."""
    coils = 8 if x.size <= _MOST_COILED else 1
    share = np.linspace(0.0, 1.0, coils + 1)
    along = x[:-1, None] + np.diff(x)[:, None] * share
    across = np.broadcast_to(0.3 * np.r_[0.0, (-1.0) ** np.arange(coils - 1), 0.0], along.shape)
    along = np.where(np.diff(x)[:, None] < _LONGEST_DRAWN, along, np.nan)
    if targets:
        along[targets - 1] = np.nan  # no spring connects the bodies
    return along.ravel(), across.ravel()


def _interpolate(times: Array, values: Array, moments: Array) -> Array:
    return np.column_stack([np.interp(moments, times, column) for column in values.T])
