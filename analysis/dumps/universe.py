"""
Dumps and states of a chain as MDAnalysis Universes, and back.

MDAnalysis's own reader needs three coordinates, keeps positions and velocities as float32, shifts
positions by the lower bound of the box, and fails on ``dump_modify time yes`` and on binary files.
Here every dump that :class:`~chaincor.analysis.dumps.dump.Dump` takes is read into memory, each
column in ``ts.data`` as the float64 that was written.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import MDAnalysis
import numpy as np
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


class ColumnsReader(MemoryReader):
    """
    MDAnalysis trajectory in memory, with the float64 columns of each frame in ``ts.data``.

    Made by :func:`universe_of_states` and :func:`to_mdanalysis`.

    Parameters
    ----------
    coordinate_array : ndarray of shape (frames, n, 3)
        Positions, which MDAnalysis keeps as float32.
    columns : sequence of dict
        What ``ts.data`` holds besides, frame by frame: columns by name, step and time.
    **kwargs
        As for MDAnalysis's MemoryReader.
    """

    format = "CHAINCOLUMNS"
    units = {"time": None, "length": None, "velocity": None}  # noqa: RUF012 - as the base has it

    def __init__(
        self,
        coordinate_array: NDArray[np.float32],
        *,
        columns: Sequence[dict[str, Any]],
        **kwargs: Any,
    ) -> None:
        self._columns = columns
        super().__init__(coordinate_array, **kwargs)
        # For copies; the base class does not declare it.
        self._kwargs = {**self._kwargs, "columns": columns}  # type: ignore[has-type]

    def _read_next_timestep(self, ts: Timestep | None = None) -> Timestep:
        ts = super()._read_next_timestep(ts)
        ts.data.update(self._columns[ts.frame])
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
    columns = [
        {
            "vx": state.all_velocities,
            DISPLACEMENT_COLUMN: state.all_displacements,
            TIME_COLUMN: np.full(n, state.time),
            "step": state.step,
            "time": state.time,
        }
        for state in states
    ]
    step = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 1.0
    universe.trajectory = ColumnsReader(vectors[0], columns=columns, velocities=vectors[1], dt=step)
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
    frames = list(Dump(dump))
    n = frames[0].raw_column(0).size
    if data is None:
        universe = MDAnalysis.Universe.empty(n, trajectory=False, velocities=True)
        if MASS_COLUMN in frames[0].columns:
            universe.add_TopologyAttr("masses", frames[0].column(MASS_COLUMN))
    else:
        try:
            universe = MDAnalysis.Universe(
                str(data), topology_format="DATA", atom_style="id resid type x y z", to_guess=()
            )
        except (ValueError, OSError) as error:
            raise InputError(f"{data} is not read: {str(error).splitlines()[0]}") from None
        if len(universe.atoms) != n:
            raise InputError(
                f"{data} and {dump} do not make a chain: {len(universe.atoms)} atoms and {n}"
            )
    columns = [_columns(frame, timestep) for frame in frames]
    places = [_vectors(frame, [(f"{a}s", f"{a}su", a, f"{a}u") for a in "xyz"]) for frame in frames]
    speeds = [_vectors(frame, [("vx",), ("vy",), ("vz",)]) for frame in frames]
    boxes = [[*np.ptp(frame.bounds, axis=1), 90.0, 90.0, 90.0] for frame in frames]
    universe.trajectory = ColumnsReader(
        np.array(places),
        columns=columns,
        velocities=np.array(speeds),
        dimensions=np.array(boxes, dtype=np.float32),
        dt=timestep,
    )
    return universe


def _columns(frame: DumpFrame, timestep: float) -> dict[str, Any]:
    """Return what ``ts.data`` holds of a frame."""
    held: dict[str, Any] = {name: frame.column(name) for name in frame.columns}
    time = frame.step * timestep if frame.time is None else frame.time
    if TIME_COLUMN in held:
        time = float(held[TIME_COLUMN][0])
    held |= {"step": frame.step, "time": time, "box_bounds": frame.bounds}
    return held if frame.time is None else held | {"carried_time": frame.time}


def _vectors(frame: DumpFrame, axes: Sequence[Sequence[str]]) -> NDArray[np.float32]:
    """Return positions or velocities, each axis from the last of its columns that there is."""
    values = np.zeros((frame.raw_column(0).size, 3), dtype=np.float32)
    for axis, choices in enumerate(axes):
        name = next((name for name in reversed(choices) if name in frame.columns), None)
        if name is None:
            continue
        values[:, axis] = frame.column(name)
        if name.endswith(("s", "su")):
            if frame.tilted:
                raise InputError(
                    f"the dump has scaled positions ({name}) in a tilted box; expected "
                    "unscaled ones: dump 'x' or 'xu'"
                )
            low, high = frame.bounds[axis]
            values[:, axis] = low + frame.column(name) * (high - low)
    return values


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
