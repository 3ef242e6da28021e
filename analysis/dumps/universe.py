"""
Dumps and states of a chain as MDAnalysis Universes, and back.

MDAnalysis's own reader needs three coordinates, keeps positions and velocities as float32, shifts
positions by the lower bound of the box, and fails on ``dump_modify time yes`` and on binary files.
The reader here takes every dump that :class:`~chaincor.analysis.dumps.dump.Dump` takes, and puts
every column into ``ts.data`` as the float64 that was written.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import MDAnalysis
import numpy as np
from MDAnalysis.coordinates.base import ReaderBase
from MDAnalysis.coordinates.memory import MemoryReader
from MDAnalysis.coordinates.timestep import Timestep
from numpy.typing import NDArray

from chaincor.analysis.dumps.chain_frames import DISPLACEMENT_COLUMN, TIME_COLUMN, ChainState
from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.masses import MASS_COLUMN
from chaincor.lammps_inputs.errors import InputError

# Keys of ts.data that are no columns.
_FRAME_KEYS = ("step", "time", "carried_time", "dt", "time_offset", "box_bounds")


class ChainDumpReader(ReaderBase):
    """
    MDAnalysis trajectory reader for one-dimensional dumps.

    Use it as ``MDAnalysis.Universe(topology, dump, format=ChainDumpReader)`` or through
    :func:`to_mdanalysis`. Positions are (x, 0, 0), not shifted; ``ts.data`` holds each column.

    Parameters
    ----------
    filename : path-like
        The dump.
    **kwargs
        As for any reader of MDAnalysis.
    """

    format = "CHAINDUMP"
    units = {"time": None, "length": None, "velocity": None}  # noqa: RUF012 - as the base has it

    def __init__(self, filename: Any, **kwargs: Any) -> None:
        super().__init__(filename, **kwargs)
        self._dump = Dump(self.filename)
        self._frames: Iterator[DumpFrame] = iter(())
        self._offsets = self._dump.offsets()
        self.n_atoms = self._dump.first().raw_column(0).size
        self._reopen()
        self._read_next_timestep()

    @property
    def n_frames(self) -> int:
        """Number of whole frames."""
        return len(self._offsets)

    def close(self) -> None:
        """Let go of the file."""
        self._frames = iter(())

    def _reopen(self) -> None:
        self._frames = self._dump.frames()
        self.ts = self._Timestep(self.n_atoms, **self._ts_kwargs)
        self.ts.frame = -1

    def _read_frame(self, frame: int) -> Timestep:
        self._frames = self._dump.frames(start=self._offsets[frame])
        self.ts.frame = frame - 1
        return self._read_next_timestep()

    def _read_next_timestep(self, ts: Timestep | None = None) -> Timestep:
        frame = next(self._frames, None)
        if frame is None:
            raise EOFError
        return self._fill(frame)

    def _fill(self, frame: DumpFrame) -> Timestep:
        ts = self.ts
        ts.frame += 1
        for name in frame.columns:
            ts.data[name] = frame.column(name)
        ts.data["step"] = frame.step
        ts.data["box_bounds"] = frame.bounds
        if "v_time" in frame.columns:
            ts.data["time"] = float(ts.data["v_time"][0])
        else:
            ts.data["time"] = frame.step * ts.dt if frame.time is None else frame.time
        if frame.time is not None:
            ts.data["carried_time"] = frame.time
        ts.dimensions = [*np.ptp(frame.bounds, axis=1), 90.0, 90.0, 90.0]
        for target, names in (
            ("positions", tuple((f"{a}s", f"{a}su", a, f"{a}u") for a in "xyz")),
            ("velocities", (("vx",), ("vy",), ("vz",))),
        ):
            values = np.zeros((self.n_atoms, 3), dtype=np.float32)
            for axis, choices in enumerate(names):
                for name in choices:
                    if name not in frame.columns:
                        continue
                    values[:, axis] = ts.data[name]
                    if name.endswith(("s", "su")):
                        if frame.tilted:
                            raise InputError(
                                f"the dump has scaled positions ({name}) in a tilted box; expected "
                                "unscaled ones: dump 'x' or 'xu'"
                            )
                        low, high = frame.bounds[axis]
                        values[:, axis] = low + ts.data[name] * (high - low)
            setattr(ts, target, values)
        return ts


class ChainStatesReader(MemoryReader):
    """
    MDAnalysis trajectory of states in memory, with all their digits in ``ts.data``.

    Use it through :func:`universe_of_states`.

    Parameters
    ----------
    coordinate_array : ndarray of shape (frames, n, 3)
        Positions, which MDAnalysis keeps as float32.
    states : sequence of ChainState
        Where columns ``vx``, ``v_displacement``, step and time of each frame come from.
    **kwargs
        As for MDAnalysis's MemoryReader.
    """

    format = "CHAINSTATES"
    units = {"time": None, "length": None, "velocity": None}  # noqa: RUF012 - as the base has it

    def __init__(
        self, coordinate_array: NDArray[np.float64], *, states: Sequence[ChainState], **kwargs: Any
    ) -> None:
        self._states = states
        super().__init__(coordinate_array, **kwargs)
        # For copies; the base class does not declare it.
        self._kwargs = {**self._kwargs, "states": states}  # type: ignore[has-type]

    def _read_next_timestep(self, ts: Timestep | None = None) -> Timestep:
        ts = super()._read_next_timestep(ts)
        state = self._states[ts.frame]
        ts.data["vx"] = state.all_velocities
        ts.data[DISPLACEMENT_COLUMN] = state.all_displacements
        ts.data[TIME_COLUMN] = np.full(self.n_atoms, state.time)
        ts.data["step"] = state.step
        ts.time = state.time
        return ts


def universe_of_states(
    states: Sequence[ChainState], masses: NDArray[np.float64]
) -> MDAnalysis.Universe:
    """
    Return states of a chain as an MDAnalysis Universe in reduced units.

    Parameters
    ----------
    states : sequence of ChainState
        At least one.
    masses : ndarray of shape (n,)
        Particle masses; with a free target of shape (n + M,), the chain's first.

    Returns
    -------
    MDAnalysis.Universe
        Atoms with ids from 1 on, the chain's before the target's, masses, bonds between neighbours
        and no box; float64 columns ``vx``, ``v_displacement`` and ``v_time`` in ``ts.data`` of each
        frame.
    """
    n, times = masses.size, [state.time for state in states]
    universe = MDAnalysis.Universe.empty(n, trajectory=False, velocities=True)
    universe.add_TopologyAttr("ids", np.arange(1, n + 1))
    universe.add_TopologyAttr("masses", masses)
    universe.add_TopologyAttr("bonds", states[0].all_bonds)
    vectors = np.zeros((2, len(states), n, 3), dtype=np.float32)
    vectors[0, :, :, 0] = [state.all_positions for state in states]
    vectors[1, :, :, 0] = [state.all_velocities for state in states]
    universe.trajectory = ChainStatesReader(
        vectors[0],
        states=tuple(states),
        velocities=vectors[1],
        dt=(times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 1.0,
    )
    return universe


def to_mdanalysis(
    dump: Path | str, data: Path | str | None = None, timestep: float = 1.0
) -> MDAnalysis.Universe:
    """
    Return a dump as an MDAnalysis Universe.

    Parameters
    ----------
    dump : pathlib.Path or str
        Any dump that :class:`~chaincor.analysis.dumps.dump.Dump` reads.
    data : pathlib.Path or str, optional
        LAMMPS data file of ``atom_style bond`` for the topology and masses; without it a bare chain
        of atoms, numbered from 1, with masses where the dump has them.
    timestep : float
        Simulated time per step, for dumps that do not carry the time.

    Returns
    -------
    MDAnalysis.Universe
        With exact float64 columns in ``ts.data`` of each frame.

    Raises
    ------
    InputError
        If the files cannot be read or do not fit together.
    """
    reader_arguments = {"format": ChainDumpReader, "dt": timestep}
    if data is None:
        first = Dump(dump).first()
        universe = MDAnalysis.Universe.empty(first.raw_column(0).size, velocities=True)
        if MASS_COLUMN in first.columns:
            universe.add_TopologyAttr("masses", first.column(MASS_COLUMN))
        universe.load_new(str(dump), **reader_arguments)
        return universe
    try:
        return MDAnalysis.Universe(
            str(data),
            str(dump),
            topology_format="DATA",
            atom_style="id resid type x y z",
            to_guess=(),
            **reader_arguments,
        )
    except (ValueError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{data} and {dump} do not make a chain: {reason}") from None


def universe_frames(universe: MDAnalysis.Universe) -> Iterator[DumpFrame]:
    """
    Yield the frames of a Universe for :func:`~chaincor.analysis.frame_analysis.analyze_frames`.

    Works with the reader here and with MDAnalysis's own LAMMPSDUMP reader, given
    ``additional_columns=["vx", "v_displacement", "v_time"]`` (or ``"x"``): only columns in
    ``ts.data`` have all their digits.

    Parameters
    ----------
    universe : MDAnalysis.Universe
        With a trajectory of a chain.

    Yields
    ------
    DumpFrame
        One frame, sorted by id.

    Raises
    ------
    InputError
        If the frames carry no exact columns.
    """
    for ts in universe.trajectory:
        columns = {
            name: values
            for name, values in ts.data.items()
            if name not in _FRAME_KEYS and np.shape(values) == (ts.n_atoms,)
        }
        if not columns:
            raise InputError(
                "the Universe holds single-precision positions only; make it with to_mdanalysis, "
                "or with additional_columns=['x', 'vx']"
            )
        names = tuple(columns)
        values = [np.array(values, dtype=float) for values in columns.values()]
        bounds = ts.data.get("box_bounds", np.full((3, 2), np.nan))
        yield DumpFrame(
            int(ts.data["step"]),
            ts.data.get("carried_time"),
            names,
            bounds,
            None,
            values.__getitem__,
            partial(_shortest_text, values),
        )


def _shortest_text(columns: list[NDArray[np.float64]], index: int) -> list[bytes]:
    """Return a column as text with the digits that the dump printed."""
    return [repr(value).encode() for value in columns[index].tolist()]
