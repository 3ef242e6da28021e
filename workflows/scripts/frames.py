"""Read the positions and initial velocities that a run wrote with its samples."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError


@dataclass(frozen=True)
class ScriptFrames:
    """Positions and initial velocities of the particles in a run, in the order of particle ids."""

    times: Array  #: Times of the frames, of shape (S,).
    #: Unwrapped positions, of shape (S, N, 3); nan in frames with fewer than N particles.
    positions: Array
    velocities: Array  #: Velocities in the first frame with particles, of shape (M, 3).
    #: Distance between neighbours on a simple cubic lattice of equal density.
    spacing: float
    #: Edges of the box in the first frame, of shape (3,); inf if a direction is not periodic or the
    #: box is tilted.
    edges: Array


def read_frames(path: Path) -> ScriptFrames:
    """Read the frames of a run; raise InputError if there are none."""
    lines = path.read_text("utf-8").splitlines() if path.is_file() else []
    if not lines:
        raise InputError("the script wrote no positions. Give a script with a 'run' of particles")
    times: list[float] = []
    frames: list[Array] = []
    edges = velocities = np.zeros(0)
    spacing, at = 0.0, 0
    while at < len(lines):
        # Each frame has sections for its time, step, number of particles, box, and particles.
        count, first = int(lines[at + 5]), at + 11
        rows = np.array([line.split() for line in lines[first : first + count]], dtype=float)
        rows = rows.reshape(-1, 7)
        box = [[float(x) for x in line.split()] for line in lines[at + 7 : at + 10]]
        if not len(velocities) and count:
            velocities = rows[:, 4:]
            edges = np.array([edge[1] - edge[0] for edge in box])
            words = lines[at + 6].split()[3:]
            periodic = np.array([word == "pp" for word in words[-3:]])
            edges = np.where(periodic & (len(words) == 3), edges, np.inf)
        # The first frame of each run repeats the last frame of the previous run.
        if not times or float(lines[at + 1]) != times[-1]:
            times.append(float(lines[at + 1]))
            frames.append(rows[:, 1:4])
        spacing = float(np.prod([e[1] - e[0] for e in box]) / max(count, 1)) ** (1.0 / 3.0)
        at = first + count
    most = max(len(frame) for frame in frames)
    padded = [np.pad(f, ((0, most - len(f)), (0, 0)), constant_values=np.nan) for f in frames]
    return ScriptFrames(np.array(times), np.array(padded), velocities, spacing, edges)
