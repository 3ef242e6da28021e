"""The simulated time of one step, for dumps that count steps only."""

import re
from collections.abc import Iterable

import numpy as np

from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.run_commands import RunCommands

_NUMBER = re.compile(r"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?")

# Two printed velocities of the default six digits may differ by this and mean the same.
_SAME_SPEED = 1e-5


def read_timestep(commands: RunCommands) -> float | None:
    """
    Return the timestep that a log or, where there is none, an input script sets.

    None where no ``timestep`` command is found, where a script computes it, or where it changes, so
    that steps do not tell the time.
    """
    words, expanded = commands.timesteps()
    computed = [word for word in words if "$" in word]
    values = {float(word) for word in words if _NUMBER.fullmatch(word)}
    if len(values) != 1 or (computed and not expanded):
        return None
    timestep = values.pop()
    return timestep if timestep > 0.0 else None


def read_first_timestep(commands: RunCommands) -> float | None:
    """
    Return the step that a run was set up with.

    Runs that stop at contacts set other steps on the way; the first one is that of the motion.

    None where there is none.
    """
    words, expanded = commands.timesteps()
    values = [float(word) for word in words if _NUMBER.fullmatch(word)]
    if not values or (not expanded and "$" in words[0]):
        return None
    return values[0] if values[0] > 0.0 else None


def infer_timestep(frames: Iterable[DumpFrame], layout: ChainLayout) -> float | None:
    """
    Return the timestep as seen in the flight of the last particle.

    Until sound has crossed the chain the particle farthest from the wall flies freely, so its
    distance, its speed and the steps between frames give the time of a step.

    Frames are read only as far as the flight goes; None if no two of them show it.
    """
    start: tuple[int, float, float] | None = None
    timestep = None
    for frame in frames:
        x = layout.displacements(frame)[-1]
        velocity = layout.velocities(frame)[-1]
        if start is None:
            if velocity == 0.0:
                return None
            start = frame.step, x, velocity
            continue
        if not np.isclose(velocity, start[2], rtol=_SAME_SPEED, atol=0.0):
            break
        if frame.step > start[0]:
            timestep = float((x - start[1]) / (start[2] * (frame.step - start[0])))
    return timestep if timestep is not None and timestep > 0.0 else None
