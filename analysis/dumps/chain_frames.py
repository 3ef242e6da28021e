"""Frames of a dump as states of a chain: time, displacements and velocities."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError

TIME_COLUMN = "v_time"
DISPLACEMENT_COLUMN = "v_displacement"
# Molecule 1 is the chain, and molecule 2 a free target.
BODY_COLUMN = "mol"
# Larger positions and velocities are refused, because energies would overflow.
_LARGEST = 1e150
# Unwrapped positions are preferred, because wrapped positions jump in a periodic box.
_POSITION_COLUMNS = ("xu", "x", "xsu", "xs")
SCALED_COLUMNS = ("xs", "xsu")
_WRAPPED = ("x", "xs")
IMAGE_COLUMN = "ix"
# Largest difference, beyond rounding, between x - (i - 1) and a column of displacements. If the
# difference is larger, the column contains another quantity.
_SAME_DISPLACEMENT = 1e-6


@dataclass(frozen=True)
class ChainLayout:
    """Rules from the first frame that turn the columns of a dump into states of a chain."""

    displacement_column: str  #: Column of the displacements.
    #: Rows (sorted by id) of the chain and of a free target, each from the contact outward.
    rows: tuple[NDArray[np.int64], ...]
    time_known: bool  #: Whether the frames carry the simulated time.

    @classmethod
    def from_frame(cls, frame: DumpFrame, targets: int = 0) -> "ChainLayout":
        """
        Return the layout for the first frame, with particles numbered from the wall outward.

        The column ``mol`` marks the rows of a free target of `targets` particles. Without this
        column, the target consists of the particles at the lowest x. Raises InputError if positions
        or velocities are missing, or if the bodies cannot be distinguished.
        """
        wanted = (DISPLACEMENT_COLUMN, *_POSITION_COLUMNS)
        position = next((name for name in _POSITION_COLUMNS if name in frame.columns), None)
        found = DISPLACEMENT_COLUMN if DISPLACEMENT_COLUMN in frame.columns else position
        if found is None or "vx" not in frame.columns:
            missing = "velocities (vx)" if found else f"positions (one of {', '.join(wanted)})"
            raise InputError(
                f"the dump has columns {' '.join(frame.columns)} and no {missing}. Dump at least "
                "'id x vx'"
            )
        _refuse_other_units(frame)
        x = None if position is None else _positions(frame, position)
        time_known = TIME_COLUMN in frame.columns or frame.time is not None
        if targets:
            if x is None:
                raise InputError(
                    f"the dump has columns {' '.join(frame.columns)}. Dump a column of positions, "
                    "such as x, because positions distinguish the two bodies"
                )
            return cls(found, _rows_of_bodies(frame, x, targets), time_known)
        order = np.arange(frame.column(found).size)
        if x is not None and position is not None:
            if found == DISPLACEMENT_COLUMN:
                _refuse_other_displacements(frame, x, position)
            else:
                order = np.argsort(x, kind="stable")
        return cls(found, (order,), time_known)

    @property
    def particles(self) -> int:
        """Number of particles n of the chain."""
        return self.rows[0].size

    @property
    def all_particles(self) -> int:
        """Number of particles of both bodies."""
        return sum(rows.size for rows in self.rows)

    @property
    def targets(self) -> int:
        """Number of particles M of a free target; 0 for a wall."""
        return self.all_particles - self.particles

    def by_body(self, values: Array) -> list[Array]:
        """Reorder values from ids to the order of each body, from the contact outward."""
        return [values[rows] for rows in self.rows]

    def displacements(self, frame: DumpFrame) -> list[Array]:
        """
        Return u_i = x_i - (i - 1) of the chain, and 1 - k + u_k = x_k of a free target.

        Displacements in the dump are returned exactly. Otherwise they are computed from positions.
        """
        name = self.displacement_column
        if name == DISPLACEMENT_COLUMN:
            return self.by_body(frame.column(name))
        found = self.by_body(_positions(frame, name))
        for x in found:
            _refuse_wrapped(frame, name, x)
        # From the contact outward, the particles of a target follow each other along -x.
        sides = zip(found, (1.0, -1.0), strict=False)
        return [x - along * np.arange(x.size) for x, along in sides]

    def state(self, frame: DumpFrame, timestep: float | None) -> ChainState:
        """
        Return the state of the chain in a frame.

        `timestep` is the simulated time per step, for dumps that do not carry the time. Raises
        InputError if the number of particles has changed.
        """
        velocities, expected = frame.column("vx"), self.all_particles
        if velocities.size != expected:
            raise InputError(
                f"the frame of step {frame.step} has {velocities.size} particles, but the first "
                f"frame has {expected}: LAMMPS lost particles. Give a dump without lost "
                "particles"
            )
        if TIME_COLUMN in frame.columns:
            time = float(frame.column(TIME_COLUMN)[0])
        elif frame.time is not None:
            time = frame.time
        elif timestep is not None:
            time = frame.step * timestep
        else:
            raise InputError(
                f"the frame of step {frame.step} has no time, unlike the first frame. Give the "
                "frames of one run"
            )
        motion = zip(self.displacements(frame), self.by_body(velocities), strict=True)
        arrays = [array for body in motion for array in body]
        # NumPy finds the maximum, because Python's max ignores a nan that does not come first.
        largest = np.max(np.abs(np.concatenate((*arrays, [time]))))
        if not largest < _LARGEST:
            raise InputError(
                f"the frame of step {frame.step} holds a value that is too large or not a number, "
                "because the run blew up. Use a smaller timestep"
            )
        return ChainState(frame.step, time, *arrays)

    def states(
        self, frames: Iterable[DumpFrame], timestep: float | None = None
    ) -> Iterator[ChainState]:
        """Yield the state in each frame; see :meth:`state`."""
        for frame in frames:
            yield self.state(frame, timestep)


def _rows_of_bodies(
    frame: DumpFrame, x: Array, targets: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows of the chain and of the target, each from the contact outward."""
    if not 0 < targets < x.size:
        raise InputError(
            f"the free target has {targets} particles, but the dump has {x.size}. Give at "
            "least one particle to the target, and leave at least one to the chain"
        )
    order = np.argsort(x, kind="stable")
    is_target = np.isin(np.arange(x.size), order[:targets])
    if BODY_COLUMN in frame.columns:
        is_target = frame.column(BODY_COLUMN) == 2.0
    elif x[order[targets - 1]] == x[order[targets]]:
        raise InputError(
            f"particles of both bodies are at x = {x[order[targets]]:g} in the first frame. "
            f"Dump a column '{BODY_COLUMN}' that is 2 in the target, or begin the dump "
            "while the bodies are apart"
        )
    chain, target = np.flatnonzero(~is_target), np.flatnonzero(is_target)
    return chain[np.argsort(x[chain])], target[np.argsort(-x[target])]


def _positions(frame: DumpFrame, name: str) -> Array:
    """Return x in units of length, from the images and box bounds of the same frame."""
    values = frame.column(name)
    low, high = frame.bounds[0]
    if name in SCALED_COLUMNS:
        if not np.all(np.isfinite((low, high))):
            raise InputError(
                f"the frame of step {frame.step} has scaled positions ({name}), but no bounds of "
                "the box. Dump 'x' or 'xu'"
            )
        if frame.tilted:
            raise InputError(
                f"the dump has scaled positions ({name}) in a tilted box. Dump 'x' or 'xu'"
            )
        values = low + values * (high - low)
    if name in _WRAPPED and IMAGE_COLUMN in frame.columns and frame.periodic_x:
        values = values + frame.column(IMAGE_COLUMN) * (high - low)
    return values


def _refuse_wrapped(frame: DumpFrame, name: str, x: Array) -> None:
    """Refuse a chain that leaves a periodic box at one end and re-enters at the other end."""
    if name not in _WRAPPED or not frame.periodic_x or IMAGE_COLUMN in frame.columns:
        return
    length = float(frame.bounds[0, 1] - frame.bounds[0, 0])
    if x.size > 1 and np.max(np.abs(np.diff(x))) > 0.5 * length:
        raise InputError(
            f"column {name} wraps round the periodic box in the frame of step {frame.step}. "
            "Dump the unwrapped position 'xu', or 'ix' beside it"
        )


@np.errstate(invalid="ignore")  # `state` refuses positions that are not finite
def _refuse_other_displacements(frame: DumpFrame, x: Array, name: str) -> None:
    u = frame.column(DISPLACEMENT_COLUMN)
    digits = frame.significant_digits()
    slack = _SAME_DISPLACEMENT + frame.resolution(DISPLACEMENT_COLUMN, digits)
    scale = float(frame.bounds[0, 1] - frame.bounds[0, 0]) if name in SCALED_COLUMNS else 1.0
    slack = slack + scale * frame.resolution(name, digits)
    off = np.abs(x - np.arange(x.size) - u)
    if np.any(off > slack):
        i = int(np.argmax(off - slack))
        raise InputError(
            f"particle {i + 1} has {DISPLACEMENT_COLUMN} = {u[i]:.9g} at x = {x[i]:.9g}. "
            "Dump the variable x - (id - 1) with ids that count from the wall at x = 0, or "
            "leave the column out"
        )


def _refuse_other_units(frame: DumpFrame) -> None:
    if frame.units not in (None, "lj"):
        raise InputError(
            f"the dump is in units {frame.units}. Use units lj, with a natural bond length "
            "and a stiffness of 1"
        )
