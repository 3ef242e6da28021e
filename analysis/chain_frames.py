"""Frames of a dump as states of a chain: time, displacements and velocities."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.dump_frame import DumpFrame
from lammps_inputs.errors import InputError

TIME_COLUMN = "v_time"
DISPLACEMENT_COLUMN = "v_displacement"
# Beyond this, energies overflow.
_LARGEST = 1e150
_POSITION_COLUMNS = ("x", "xu", "xs", "xsu")


@dataclass(frozen=True)
class ChainState:
    """
    The chain at one moment.

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
    """

    step: int
    time: float
    displacements: NDArray[np.float64]
    velocities: NDArray[np.float64]


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
        Choose columns, and number the particles from the wall outwards.

        Parameters
        ----------
        frame : DumpFrame
            The first frame of a dump.

        Returns
        -------
        ChainLayout
            For all its frames.

        Raises
        ------
        InputError
            If positions or velocities are missing.
        """
        wanted = (DISPLACEMENT_COLUMN, *_POSITION_COLUMNS)
        found = next((name for name in wanted if name in frame.columns), None)
        if found is None or "vx" not in frame.columns:
            missing = "velocities (vx)" if found else f"positions (one of {', '.join(wanted)})"
            raise InputError(
                f"the dump has columns {' '.join(frame.columns)} and no {missing}; dump at least "
                "'id x vx'"
            )
        values = frame.column(found)
        order = None
        if found != DISPLACEMENT_COLUMN:
            order = np.argsort(values, kind="stable")
            if np.array_equal(order, np.arange(order.size)):
                order = None
        time_known = TIME_COLUMN in frame.columns or frame.time is not None
        return cls(values.size, found, order, time_known)

    def velocities(self, frame: DumpFrame) -> NDArray[np.float64]:
        """
        Return the velocities, particle 1 first.

        Parameters
        ----------
        frame : DumpFrame
            Any frame of the dump.

        Returns
        -------
        numpy.ndarray of shape (n,)
            Velocities.
        """
        return self._from_the_wall(frame.column("vx"))

    def displacements(self, frame: DumpFrame) -> NDArray[np.float64]:
        """
        Return the displacements, particle 1 first.

        Parameters
        ----------
        frame : DumpFrame
            Any frame of the dump.

        Returns
        -------
        numpy.ndarray of shape (n,)
            u_i = x_i - (i - 1), exact where the dump carries them, else from positions.
        """
        values = frame.column(self.displacement_column)
        if self.displacement_column == DISPLACEMENT_COLUMN:
            return values
        if self.displacement_column in ("xs", "xsu"):
            low, high = frame.bounds[0]
            values = low + values * (high - low)
        return self._from_the_wall(values) - np.arange(self.particles)

    def state(self, frame: DumpFrame, timestep: float | None) -> ChainState:
        """
        Return the state that a frame holds.

        Parameters
        ----------
        frame : DumpFrame
            Any frame of the dump.
        timestep : float or None
            Simulated time per step, for dumps that do not carry the time.

        Returns
        -------
        ChainState
            The state.

        Raises
        ------
        InputError
            If the number of particles has changed.
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
        """
        Yield the state of every frame.

        Parameters
        ----------
        frames : iterable of DumpFrame
            Frames of the dump.
        timestep : float, optional
            Simulated time per step, for dumps that do not carry the time.

        Yields
        ------
        ChainState
            One state a frame.
        """
        for frame in frames:
            yield self.state(frame, timestep)

    def _from_the_wall(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        return values if self.particle_order is None else values[self.particle_order]
