"""Show a collision in slow motion in the terminal."""

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.live import Live
from rich.text import Text

from chaincor.analysis.figures.style import rest_positions
from chaincor.analysis.figures.terminal import draw_moment
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.pictures.recording import follow_to_the_end

if TYPE_CHECKING:
    from chaincor.workflows.result import Collision

_SECONDS = 8.0
_PER_SECOND = 15
_WIDEST = 100


def find_terminal() -> Console:
    """Return the terminal of standard error for drawing; raise InputError if there is none."""
    console = Console(stderr=True)
    if not console.is_terminal:
        raise InputError(
            "--watch draws in a terminal, but standard error is not a terminal. Use --animate FILE"
        )
    return console


def watch(result: "Collision", console: Console) -> None:
    """Show a collision in the terminal until shortly after its last contact."""
    outcome = follow_to_the_end(result)
    with Live(console=console, auto_refresh=False) as live:
        for moment in moments(result.scene, outcome, min(console.width, _WIDEST)):
            live.update(moment, refresh=True)
            time.sleep(1.0 / _PER_SECOND)


def moments(scene: Scene, outcome: Outcome, columns: int) -> Iterator[Text]:
    """Yield a drawing for each frame, with the time, the number of contacts, and the chain."""
    frames = outcome.frames
    assert frames is not None
    u, v = frames.along_x()
    x = u + rest_positions(u.shape[1], frames.targets)
    lowest = float(np.min(x)) if frames.targets else 0.0
    longest = max(lowest + 1.0, float(np.max(x)))
    masses = [m for m in (scene.line.chain_masses, scene.line.target_masses) if m.size]
    shown = min(len(frames.times), int(_SECONDS * _PER_SECOND))
    for k in np.linspace(0, len(frames.times) - 1, shown).astype(int):
        velocities = v[k]
        moment = frames.times[k]
        contacts = int(np.searchsorted(outcome.contact_times, moment, side="right"))
        translation = (frames.state(k).separation(masses) / scene.impact_velocity) ** 2
        heading = (
            f"t = {moment:6.1f}   contacts {contacts:3d}   "
            f"translation {100.0 * translation:5.1f} % of the energy\n"
        )
        yield Text(heading) + draw_moment(
            u[k],
            velocities,
            impact_velocity=scene.impact_velocity,
            longest=longest,
            columns=columns,
            lowest=lowest,
            targets=frames.targets,
        )
