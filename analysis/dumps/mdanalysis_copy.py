"""Copy trajectories into arrays, by MDAnalysis in a separate process that may crash."""

import tempfile
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.ase_copy import no_velocities
from chaincor.lammps_inputs.isolated import Isolated

# A compressed file has at least about this many bytes for each particle of each frame.
_LEAST_BYTES = 1.0
_NAMES = ("x", "vx", "steps", "times", "boxes")


class CopiedTrajectory(NamedTuple):
    """Frames of a trajectory in MDAnalysis's float32, memory-mapped from disk."""

    x: NDArray[np.float32]  #: Positions along x; of shape (frames, n).
    vx: NDArray[np.float32]  #: Velocities along x; of shape (frames, n).
    steps: NDArray[np.int64]  #: Timestep numbers; of shape (frames,).
    times: NDArray[np.float64]  #: Simulated times; of shape (frames,).
    boxes: NDArray[
        np.float64
    ]  #: Lengths of the periodic box, nan without a box; of shape (frames, 3).


def copy_trajectory(path: Path, kind: str, folder: Path) -> CopiedTrajectory:
    """
    Read a trajectory into arrays in a folder.

    Raises InputError if the file contains no velocities. Raises IsolatedError, with the reason, if
    the library cannot read the file or crashes.
    """
    _READ(str(path.absolute()), kind, str(folder))
    arrays = {name: np.load(folder / f"{name}.npy", mmap_mode="r") for name in _NAMES}
    return CopiedTrajectory(**arrays)


def read_here(path: str, kind: str, folder: str) -> None:
    """Read a trajectory in this process; see :func:`copy_trajectory`."""
    from MDAnalysis.coordinates.core import reader

    with tempfile.TemporaryDirectory(dir=folder) as beside:
        # MDAnalysis writes a file of offsets beside the file that it reads. MDAnalysis is therefore
        # given a link in another folder.
        link = Path(beside) / Path(path).name
        link.symlink_to(path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings about units and boxes are irrelevant
            with reader(str(link), format=kind) as source:
                _copy(source, Path(path), Path(folder))


def _copy(source: Any, path: Path, folder: Path) -> None:
    frames, n = int(source.n_frames), int(source.n_atoms)
    if frames * n * _LEAST_BYTES > path.stat().st_size:
        raise ValueError(
            f"its header says {frames} frames of {n} atoms, but the file is too short to hold them"
        )
    x, vx = (_new_array(folder / f"{name}.npy", (frames, n)) for name in ("x", "vx"))
    steps = np.zeros(frames, dtype=np.int64)
    times, boxes = np.zeros(frames), np.full((frames, 3), np.nan)
    for k, ts in enumerate(source):
        if not ts.has_velocities:
            raise no_velocities(path)
        x[k], vx[k] = ts.positions[:, 0], ts.velocities[:, 0]
        steps[k], times[k] = int(ts.data.get("step", ts.frame)), float(ts.time)
        if ts.dimensions is not None:
            boxes[k] = ts.dimensions[:3]
    x.flush()
    vx.flush()
    for name, values in (("steps", steps), ("times", times), ("boxes", boxes)):
        np.save(folder / f"{name}.npy", values)


def _new_array(path: Path, shape: tuple[int, int]) -> "np.memmap[Any, np.dtype[np.float32]]":
    return np.lib.format.open_memmap(path, mode="w+", dtype=np.float32, shape=shape)


_READ = Isolated(read_here, seconds=600, megabytes=8000)
