"""
States of a chain as an MDAnalysis Universe.

MDAnalysis keeps positions and velocities as float32. Columns with all digits are in ``ts.data``,
which also contains the `additional_columns` of MDAnalysis's own reader of dumps.
"""

from collections.abc import Sequence
from typing import Any

import MDAnalysis
import numpy as np
from MDAnalysis.coordinates.memory import MemoryReader
from MDAnalysis.coordinates.timestep import Timestep
from numpy.typing import NDArray

from chaincor.analysis.dumps.chain_frames import DISPLACEMENT_COLUMN, TIME_COLUMN
from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.lammps_inputs.arrays import Array


class ColumnsReader(MemoryReader):
    """
    MDAnalysis trajectory in memory. ``ts.data`` has the float64 columns of the current frame.

    `coordinate_array` contains positions, of shape (frames, n, 3), which MDAnalysis keeps as
    float32. `columns` contains the further content of ``ts.data`` for each frame: columns by name,
    step and time.
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
        # ``copy`` needs these arguments, which the base class does not declare.
        self._kwargs = {**self._kwargs, "columns": columns}  # type: ignore[has-type]

    def _read_next_timestep(self, ts: Timestep | None = None) -> Timestep:
        ts = super()._read_next_timestep(ts)
        ts.data.update(self._columns[ts.frame])
        return ts


def universe_of_states(states: Sequence[ChainState], masses: Array) -> MDAnalysis.Universe:
    """
    Return one or more states of a chain as an MDAnalysis Universe in reduced units.

    `masses`, of shape (n,) or (n + M,), begin with the chain; a free target follows. Atoms are
    numbered from 1 in this order. They have masses, and neighbours are bonded. There is no box. In
    each frame ``ts.data`` contains the float64 columns ``vx``, ``v_displacement`` and ``v_time``.
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
