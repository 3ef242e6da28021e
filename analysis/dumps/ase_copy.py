"""Copy trajectories into arrays, by ASE in a process with limits on time and memory."""

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.masses import MASS_COLUMN, TYPE_COLUMN
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.isolated import Isolated

# Names of the velocities in files of ASE, LAMMPS and this package. Momenta are converted.
_VELOCITY_ARRAYS = ("velo", "vel", "velocities")
_TIME_KEYS = ("time", "Time")
_STEP_KEYS = ("step", "Step", "Timestep", "timestep")
# The header of an extended XYZ file lists the name, the type and the number of columns for each
# property of the atoms.
_PROPERTIES = re.compile(rb'Properties="?([^\s"]+)', re.IGNORECASE)
_MOST_COLUMNS, _LONGEST_LINE = 10_000, 1_000_000
_COLUMNS = ("x", "vx", MASS_COLUMN, TYPE_COLUMN)


class CopiedFrame(NamedTuple):
    """Frame of a trajectory, in float64."""

    columns: dict[str, Array]  #: Columns, each of shape (n,).
    step: int  #: Timestep number, by default the number of the frame.
    time: float | None  #: Simulated time; None if the file does not contain the time.
    box: NDArray[Any] | None  #: Lengths of the periodic box, of shape (3,); None without a box.


def copy_frames(path: Path, kind: str, copy: Path) -> Iterator[CopiedFrame]:
    """
    Yield the frames of a trajectory, after ASE has copied them into a file.

    Raises InputError if the file contains no velocities. Raises IsolatedError, with the reason, if
    ASE cannot read the file or exceeds a limit.
    """
    count = _READ(str(path.absolute()), kind, str(copy))
    with copy.open("rb") as file:
        for _ in range(count):
            facts, present, values = (np.load(file, allow_pickle=False) for _ in range(3))
            names = [name for name, there in zip(_COLUMNS, present, strict=True) if there]
            step, time, *box = facts.tolist()
            yield CopiedFrame(
                dict(zip(names, values, strict=True)),
                int(step),
                None if np.isnan(time) else time,
                None if np.isnan(box[0]) else np.array(box),
            )


def read_here(path: str, kind: str, copy: str) -> int:
    """Copy a trajectory in this process, and return the number of frames; see `copy_frames`."""
    from ase.io import iread

    if kind == "extxyz":
        _check_counts(Path(path))
    count = 0
    with warnings.catch_warnings(), Path(copy).open("wb") as file:
        warnings.simplefilter("ignore")  # warnings about units and boxes are irrelevant
        for atoms in iread(path, index=":", format=kind):
            for array in _arrays_of(atoms, count, path):
                np.save(file, array, allow_pickle=False)
            count += 1
    return count


def _check_counts(path: Path) -> None:
    """
    Raise ValueError if a header states more atoms or columns than the file contains.

    Without this check, ASE would try to read any number of atoms.
    """
    with path.open("rb") as file:
        while head := file.readline(_LONGEST_LINE):
            if head.startswith(b"VEC") or not head.strip():
                continue
            count, comment = int(head), file.readline(_LONGEST_LINE)
            found = _PROPERTIES.search(comment)
            widths = found[1].split(b":")[2::3] if found else []
            if sum(map(int, widths)) > _MOST_COLUMNS:
                raise ValueError(f"its header names more than {_MOST_COLUMNS} columns")
            for _ in range(count):
                if not file.readline():
                    raise ValueError(
                        f"its header says {count} atoms, but the file is too short to hold them"
                    )


def _arrays_of(atoms: Any, index: int, path: str) -> tuple[Array, NDArray[np.bool_], Array]:
    """Return step, time and box of a frame, which columns it has, and these columns."""
    name = next((name for name in _VELOCITY_ARRAYS if atoms.has(name)), None)
    if name is None and not atoms.has("momenta"):
        raise no_velocities(path)
    velocities = atoms.get_velocities() if name is None else atoms.get_array(name)
    columns: list[Any] = [atoms.positions[:, 0], velocities[:, 0], None, None]
    if atoms.has("masses"):
        columns[2] = atoms.get_masses()
    elif len(set(atoms.numbers)) > 1:
        columns[3] = atoms.numbers
    cell = atoms.cell.lengths()
    box = cell if atoms.pbc[0] and cell[0] > 0.0 else np.full(3, np.nan)
    time = _first_of(atoms.info, _TIME_KEYS, np.nan)
    facts = np.array([int(_first_of(atoms.info, _STEP_KEYS, index)), time, *box], dtype=float)
    present = np.array([column is not None for column in columns])
    return facts, present, np.array([each for each in columns if each is not None], dtype=float)


def no_velocities(path: Path | str) -> InputError:
    """Return the error for a trajectory without velocities."""
    return InputError(
        f"{path} has no velocities, and the restitution needs them. Give a trajectory with "
        "velocities: dump style custom with 'id x vx', or extxyz, TRR, NetCDF with velocities"
    )


def _first_of(info: dict[str, Any], keys: tuple[str, ...], default: Any) -> Any:
    return next((info[key] for key in keys if key in info), default)


_READ = Isolated(read_here, seconds=600, megabytes=8000)
