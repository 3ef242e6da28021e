"""
Readers of trajectories other than LAMMPS dumps of style custom, by ASE and MDAnalysis.

ASE reads extended XYZ (LAMMPS's ``dump extxyz``) and its own formats in float64. MDAnalysis reads
TRR and AMBER NetCDF in float32. Dumps of style custom have their own readers, because MDAnalysis
would lose half their digits.
"""

import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.ase_copy import copy_frames
from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.dumps.frame import DumpFrame, DumpFrames
from chaincor.analysis.dumps.many_files import ManyFileDump, is_pattern
from chaincor.analysis.dumps.mdanalysis_copy import copy_trajectory
from chaincor.analysis.dumps.xyz_digits import printed_digits
from chaincor.lammps_inputs.errors import InputError, one_line

# Endings of files that ASE reads, with ASE's names of the formats.
_ASE_FORMATS = {".extxyz": "extxyz", ".xyz": "extxyz", ".traj": "traj"}
# Endings of files that MDAnalysis reads, with its names of the formats and the first bytes of a
# file. Files that begin with other bytes crash MDAnalysis.
_MDANALYSIS_FORMATS = {
    ".trr": ("TRR", b"\x00\x00\x07\xc9"),
    ".nc": ("NCDF", b"CDF"),
    ".ncdf": ("NCDF", b"CDF"),
    ".dcd": ("DCD", b"T\x00\x00\x00CORD"),
    ".xtc": ("XTC", b"\x00\x00\x07\xcb"),
}
# The 24 bits of float32 are slightly more than seven digits.
_SINGLE_DIGITS = 7


def is_other_trajectory(path: Path) -> bool:
    """Return whether ASE or MDAnalysis reads files with this ending."""
    return path.suffix in _ASE_FORMATS or path.suffix in _MDANALYSIS_FORMATS


def open_trajectory(path: Path | str) -> DumpFrames:
    """
    Open a LAMMPS dump, or a trajectory in another format, by the ending of the file.

    A ``*`` in the name stands for the numbers of many files, as in LAMMPS. Raises InputError if a
    file cannot be read.
    """
    path = Path(path)
    if is_pattern(path):
        return ManyFileDump(path)
    return OtherTrajectory(path) if is_other_trajectory(path) else Dump(path)


class OtherTrajectory(DumpFrames):
    """
    Trajectory that ASE or MDAnalysis reads, frame by frame, without conversion of units.

    Frames have the columns ``x`` and ``vx``. Frames also have ``mass`` if the file has masses, or
    else ``type`` if elements differ. `truncated` is False, because the libraries do not report
    incomplete frames.
    """

    def __init__(self, path: Path):
        self.path = path
        if not path.is_file():
            raise InputError(f"cannot read the trajectory {path}: no such file. Correct the path")

    def frames(self, progress: Callable[[int], None] | None = None) -> Iterator[DumpFrame]:
        """
        Yield the frames in order; at the end `progress` receives the size of the file.

        Raises InputError if the file cannot be read or contains no velocities.
        """
        through_ase = self.path.suffix in _ASE_FORMATS
        found = self._through_ase() if through_ase else self._through_mdanalysis()
        count = 0
        while True:
            try:
                with warnings.catch_warnings():
                    # Warnings about units and boxes are irrelevant.
                    warnings.simplefilter("ignore")
                    frame = next(found, None)
            except InputError:
                raise
            # For damaged files or missing libraries, readers raise exceptions of any type.
            except Exception as error:
                reason = one_line(error) or type(error).__name__
                raise InputError(f"cannot read the trajectory {self.path}: {reason}") from None
            if frame is None:
                break
            count += 1
            yield frame
        if count == 0:
            raise InputError(f"{self.path} holds no frames. Give the trajectory of a finished run")
        if progress is not None:
            progress(self.path.stat().st_size)

    def _through_ase(self) -> Iterator[DumpFrame]:
        kind = _ASE_FORMATS[self.path.suffix]
        digits, decimals = (17, None) if kind == "traj" else printed_digits(self.path)
        with tempfile.TemporaryDirectory(prefix="chaincor-") as folder:
            for columns, step, time, box in copy_frames(self.path, kind, Path(folder) / "frames"):
                yield _frame(
                    columns,
                    step=step,
                    time=time,
                    box=box,
                    resolution=0.0 if decimals is None else 0.5 * 10.0**-decimals,
                    digits=digits,
                )

    def _through_mdanalysis(self) -> Iterator[DumpFrame]:
        name, beginning = _MDANALYSIS_FORMATS[self.path.suffix]
        with self.path.open("rb") as file:
            if not file.read(8).startswith(beginning):
                raise InputError(
                    f"cannot read the trajectory {self.path}: it is no {name} file. Give a file "
                    "with the suffix of its format"
                )
        with tempfile.TemporaryDirectory(prefix="chaincor-") as folder:
            copied = copy_trajectory(self.path, name, Path(folder))
            for x, vx, step, time, box in zip(*copied, strict=True):
                yield _frame(
                    {"x": np.array(x), "vx": np.array(vx)},
                    step=int(step),
                    time=float(time),
                    box=None if np.isnan(box[0]) else box,
                )


def _frame(
    columns: dict[str, NDArray[Any]],
    *,
    step: int,
    time: float | None,
    box: NDArray[Any] | None,
    resolution: float = 0.0,
    digits: int = _SINGLE_DIGITS,
) -> DumpFrame:
    values = [*columns.values()]
    bounds = np.full((3, 2), np.nan)
    if box is not None:
        bounds = np.column_stack((np.zeros(3), np.asarray(box, dtype=float)))
    return DumpFrame(
        step,
        None if time is None else float(time),
        tuple(columns),
        bounds,
        None,
        lambda index: values[index].astype(float),
        None,
        periodic_x=box is not None,
        absolute_resolution=resolution,
        printed_digits=digits,
    )
