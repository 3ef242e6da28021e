"""Frames of a dump as states of a chain: time, displacements and velocities."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.lammps_inputs.errors import InputError

TIME_COLUMN = "v_time"
DISPLACEMENT_COLUMN = "v_displacement"
# Beyond this, energies overflow.
_LARGEST = 1e150
# Unwrapped ones first: in a periodic box the others jump.
_POSITION_COLUMNS = ("xu", "x", "xsu", "xs")
_SCALED = ("xs", "xsu")
_WRAPPED = ("x", "xs")
_IMAGE_COLUMN = "ix"
# A displacement that is not x - (i - 1) is off by far more than this and rounding.
_SAME_DISPLACEMENT = 1e-6


@dataclass(frozen=True)
class ChainState:
    """
    The chain at one moment, and the free target that it hits, if there is one.

    Attributes
    ----------
    step : int
        LAMMPS timestep number.
    time : float
        Simulated time; its origin is that of the dump.
    displacements : ndarray of shape (n,)
        u_i = x_i - (i - 1), particle 1 nearest the wall at x = 0.
    velocities : ndarray of shape (n,)
        Positive away from the wall.
    target_displacements, target_velocities : ndarray of shape (M,)
        The same of a free target, from the contact outward: particle k is at 1 - k + u_k. Empty
        for a wall.
    """

    step: int
    time: float
    displacements: NDArray[np.float64]
    velocities: NDArray[np.float64]
    target_displacements: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    target_velocities: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))

    @property
    def all_displacements(self) -> NDArray[np.float64]:
        """Of the chain, then of the target, of shape (n + M,)."""
        return np.concatenate((self.displacements, self.target_displacements))

    @property
    def all_velocities(self) -> NDArray[np.float64]:
        """Of the chain, then of the target, of shape (n + M,)."""
        return np.concatenate((self.velocities, self.target_velocities))

    @property
    def all_positions(self) -> NDArray[np.float64]:
        """Of the chain, then of the target, of shape (n + M,), along x."""
        rest = np.arange(self.displacements.size), -np.arange(self.target_displacements.size)
        return self.all_displacements + np.concatenate(rest)

    @property
    def all_bonds(self) -> list[tuple[int, int]]:
        """Pairs of neighbours, counted from 0; none between the bodies."""
        n, both = self.displacements.size, self.displacements.size + self.target_displacements.size
        return [(i, i + 1) for i in range(both - 1) if i != n - 1]


@dataclass(frozen=True)
class ChainLayout:
    """
    How the columns of a dump become the state of a chain, decided from its first frame.

    Attributes
    ----------
    particles : int
        Number of particles n.
    displacement_column : str
        Column that the displacements come from.
    particle_order : ndarray of shape (n,) or None
        Rows (sorted by id) from the wall outwards; None where that is the order of ids.
    time_known : bool
        Whether the frames carry the simulated time.
    """

    particles: int
    displacement_column: str
    particle_order: NDArray[np.int64] | None
    time_known: bool

    @classmethod
    def from_frame(cls, frame: DumpFrame) -> "ChainLayout":
        """
        Choose columns by the first frame, and number the particles from the wall outwards.

        Raises InputError if positions or velocities are missing.
        """
        wanted = (DISPLACEMENT_COLUMN, *_POSITION_COLUMNS)
        found = next((name for name in wanted if name in frame.columns), None)
        if found is None or "vx" not in frame.columns:
            missing = "velocities (vx)" if found else f"positions (one of {', '.join(wanted)})"
            raise InputError(
                f"the dump has columns {' '.join(frame.columns)} and no {missing}; dump at least "
                "'id x vx'"
            )
        _refuse_other_units(frame)
        position = next((name for name in _POSITION_COLUMNS if name in frame.columns), None)
        x = None if position is None else _positions(frame, position)
        order = None
        if found != DISPLACEMENT_COLUMN:
            assert x is not None
            order = np.argsort(x, kind="stable")
            if np.array_equal(order, np.arange(order.size)):
                order = None
        elif x is not None:
            assert position is not None
            _refuse_other_displacements(frame, x, position)
        time_known = TIME_COLUMN in frame.columns or frame.time is not None
        return cls(frame.column(found).size, found, order, time_known)

    def velocities(self, frame: DumpFrame) -> NDArray[np.float64]:
        """Return the velocities, particle 1 first."""
        return self.from_the_wall(frame.column("vx"))

    def displacements(self, frame: DumpFrame) -> NDArray[np.float64]:
        """Return u_i = x_i - (i - 1), particle 1 first: exact where dumped, else from positions."""
        if self.displacement_column == DISPLACEMENT_COLUMN:
            return frame.column(DISPLACEMENT_COLUMN)
        x = self.from_the_wall(_positions(frame, self.displacement_column))
        _refuse_wrapped(frame, self.displacement_column, x)
        return x - np.arange(self.particles)

    def state(self, frame: DumpFrame, timestep: float | None) -> ChainState:
        """
        Return the state that a frame holds.

        `timestep` is the simulated time per step, for dumps that do not carry the time. Raises
        InputError if the number of particles has changed.
        """
        velocities = self.velocities(frame)
        if velocities.size != self.particles:
            raise InputError(
                f"the frame of step {frame.step} holds {velocities.size} particles, the first "
                f"frame {self.particles}; expected the same number in all: LAMMPS has lost some"
            )
        if TIME_COLUMN in frame.columns:
            time = float(frame.column(TIME_COLUMN)[0])
        elif frame.time is not None:
            time = frame.time
        elif timestep is not None:
            time = frame.step * timestep
        else:
            raise InputError(
                f"the frame of step {frame.step} does not carry the time, unlike the first one; "
                "expected the frames of one run"
            )
        displacements = self.displacements(frame)
        # All at once: Python's max passes over a nan that does not come first.
        largest = np.max(np.abs(np.concatenate((velocities, displacements, [time]))))
        if not largest < _LARGEST:
            raise InputError(
                f"the frame of step {frame.step} holds a value that is not a number, or one too "
                "large; the run had blown up there: use a smaller timestep"
            )
        return ChainState(frame.step, time, displacements, velocities)

    def states(
        self, frames: Iterable[DumpFrame], timestep: float | None = None
    ) -> Iterator[ChainState]:
        """Yield the state of every frame, as :meth:`state` returns it."""
        for frame in frames:
            yield self.state(frame, timestep)

    def from_the_wall(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Bring one value a particle from the order of ids to that from the wall outwards."""
        return values if self.particle_order is None else values[self.particle_order]


def _positions(frame: DumpFrame, name: str) -> NDArray[np.float64]:
    """Return x in units of length, by images and box bounds of this very frame."""
    values = frame.column(name)
    low, high = frame.bounds[0]
    if name in _SCALED:
        if frame.tilted:
            raise InputError(
                f"the dump has scaled positions ({name}) in a tilted box; expected 'x' or 'xu'"
            )
        values = low + values * (high - low)
    if name in _WRAPPED and _IMAGE_COLUMN in frame.columns and frame.periodic_x:
        values = values + frame.column(_IMAGE_COLUMN) * (high - low)
    return values


def _refuse_wrapped(frame: DumpFrame, name: str, x: NDArray[np.float64]) -> None:
    """Refuse a chain that leaves a periodic box at one end and comes in at the other."""
    if name not in _WRAPPED or not frame.periodic_x or _IMAGE_COLUMN in frame.columns:
        return
    length = float(frame.bounds[0, 1] - frame.bounds[0, 0])
    if x.size > 1 and np.max(np.abs(np.diff(x))) > 0.5 * length:
        raise InputError(
            f"column {name} wraps round the periodic box in the frame of step {frame.step}; "
            "expected unwrapped positions: dump 'xu', or 'ix' beside it"
        )


def _refuse_other_displacements(frame: DumpFrame, x: NDArray[np.float64], name: str) -> None:
    u = frame.column(DISPLACEMENT_COLUMN)
    digits = frame.significant_digits()
    slack = _SAME_DISPLACEMENT + frame.resolution(DISPLACEMENT_COLUMN, digits)
    scale = float(frame.bounds[0, 1] - frame.bounds[0, 0]) if name in _SCALED else 1.0
    slack = slack + scale * frame.resolution(name, digits)
    off = np.abs(x - np.arange(x.size) - u)
    if np.any(off > slack):
        i = int(np.argmax(off - slack))
        raise InputError(
            f"particle {i + 1} has {DISPLACEMENT_COLUMN} = {u[i]:.9g} at x = {x[i]:.9g}; expected "
            "x - (id - 1), with ids counting from the wall at x = 0: leave the column out, or dump "
            "that variable"
        )


def _refuse_other_units(frame: DumpFrame) -> None:
    if frame.units not in (None, "lj"):
        raise InputError(
            f"the dump is in units {frame.units}; expected units lj, with the natural bond length "
            "and a stiffness of 1, in which energies and times are understood here"
        )
