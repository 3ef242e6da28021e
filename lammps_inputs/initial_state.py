"""Initial state of a chain from a CSV file: positions or strains, velocities, masses."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import SceneError, one_line
from chaincor.lammps_inputs.small_file import read_small_file

# Larger numbers are refused, because their squares overflow.
_LARGEST = 1e100
_PLACES = ("position", "strain")
COLUMNS = (*_PLACES, "velocity", "mass")


@dataclass(frozen=True, eq=False)
class InitialState:
    """Initial state of a chain, from the contact outward."""

    gap: float  #: Distance of particle 1 from the target.
    strains: Array  #: Bond lengths minus 1; of shape (n - 1,).
    #: Velocities, positive away from the target, of shape (n,); None if all particles have the
    #: speed of the scene.
    velocities: Array | None
    masses: Array | None  #: Masses, of shape (n,); None if the scene gives them.


def read_initial_state(path: Path) -> InitialState:
    """
    Read the state of a chain from CSV with one row per particle, from the target outward.

    The first column is ``position`` or ``strain``. A position is the distance from the target (the
    wall at x = 0). A strain is the distance from the previous particle minus the natural length.
    The strain of particle 1 is its distance from the target. The columns ``velocity``, positive
    away from the target, and ``mass`` are optional. Raises SceneError with one line that names the
    file, the row and the mistake.
    """
    columns = _read_columns(path)
    if "position" in columns:
        positions = columns["position"]
        places = np.concatenate((positions[:1], np.diff(positions) - 1.0))
    else:
        places = columns["strain"]
    if places[0] < 0.0:
        raise SceneError(
            f"initial {str(path)!r} has particle 1 at {places[0]:g}, inside the target. "
            "Give particle 1 a position of 0 or more"
        )
    if np.any(places[1:] <= -1.0):
        shortest = int(np.argmin(places[1:]))
        raise SceneError(
            f"initial {str(path)!r} has no room between particles {shortest + 1} and "
            f"{shortest + 2}. Give positions that increase from the target outward"
        )
    masses = columns.get("mass")
    if masses is not None and np.min(masses) <= 0.0:
        raise SceneError(
            f"initial {str(path)!r} has a mass of {np.min(masses):g}. Give masses above 0"
        )
    return InitialState(float(places[0]), places[1:], columns.get("velocity"), masses)


def _read_columns(path: Path) -> dict[str, Array]:
    try:
        lines = read_small_file(path).splitlines()
        rows = [row for row in csv.reader(lines) if any(cell.strip() for cell in row)]
    except (OSError, ValueError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or one_line(error)
        raise SceneError(f"cannot read initial {str(path)!r}: {reason}") from None
    names = [cell.strip() for cell in rows[0]] if rows else []
    unknown = [name for name in names if name not in COLUMNS]
    if unknown or len(set(names)) < len(names) or sum(name in _PLACES for name in names) != 1:
        raise SceneError(
            f"initial {str(path)!r} has the columns {', '.join(names)[:80]!r}. Write a "
            "header with position or strain, and with velocity and mass if they are known"
        )
    if len(rows) < 2:
        raise SceneError(f"initial {str(path)!r} has no particles. Give one row for each particle")
    values = []
    for number, row in enumerate(rows[1:], 1):
        try:
            if len(row) != len(names):
                raise ValueError
            values.append([float(cell) for cell in row])
            if not np.all(np.abs(values[-1]) <= _LARGEST):
                raise ValueError
        except ValueError:
            raise SceneError(
                f"initial {str(path)!r} has {','.join(row)[:60]!r} for particle {number}. Give "
                f"{len(names)} numbers of at most {_LARGEST:g}: {', '.join(names)}"
            ) from None
    return dict(zip(names, np.array(values).T, strict=True))
