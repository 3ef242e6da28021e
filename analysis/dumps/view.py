"""View of a dump in the chain's units, with the wall at 0 and the chain at positive x."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from chaincor.analysis.dumps.chain_frames import (
    DISPLACEMENT_COLUMN,
    IMAGE_COLUMN,
    SCALED_COLUMNS,
    TIME_COLUMN,
)
from chaincor.analysis.dumps.frame import DumpFrame, DumpFrames
from chaincor.analysis.dumps.masses import MASS_COLUMN
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem

_PLACES, _SPEEDS = ("x", "xu"), ("vx", "vy", "vz")
# A format with at least this many digits preserves float64 exactly.
_EXACT_DIGITS = 16


@dataclass(frozen=True)
class DumpView:
    """Transformation of a dump to the chain's units, with a wall at x = 0."""

    units: UnitSystem = CHAIN_UNITS  #: Units of the chain, in the dump's units.
    wall: float = 0.0  #: Position of the wall, in the dump's units.
    upwards: bool = False  #: Whether the chain moves towards +x.

    def with_length_of(self, frame: DumpFrame) -> "DumpView":
        """Take the natural length from a frame: the median distance between neighbours."""
        name = next((name for name in _PLACES if name in frame.columns), None)
        places = np.sort(frame.column(name)) if name is not None else np.empty(0)
        length = float(np.median(np.diff(places))) if places.size > 1 else 0.0
        if not 0.0 < length < np.inf:
            raise InputError(
                "the first frame shows no distance between neighbours. Give the natural length "
                "(--length L), or dump two or more particles with a column x or xu"
            )
        return replace(self, units=replace(self.units, length=length))

    def of(self, frame: DumpFrame) -> DumpFrame:
        """
        Return a frame in the chain's units.

        Raises InputError if the wall is not at 0 and the frame has displacements, because
        displacements assume a wall at 0.
        """
        if (self.upwards or self.wall != 0.0) and DISPLACEMENT_COLUMN in frame.columns:
            raise InputError(
                f"the dump has {DISPLACEMENT_COLUMN}, which holds displacements of a chain that "
                "moves along -x to a wall at x = 0. Drop the options for another wall or "
                "direction"
            )

        def column(index: int) -> Array:
            return self._converted(frame.columns[index], frame.raw_column(index))

        bounds = np.array(frame.bounds, dtype=float)
        bounds[0] = self._place(bounds[0])[:: -1 if self.upwards else 1]
        return replace(
            frame,
            raw_column=column,
            bounds=bounds,
            time=None if frame.time is None else frame.time / self.units.time,
            units=None,
            absolute_resolution=self._resolution(frame),
        )

    def _place(self, x: Array) -> Array:
        return (self.wall - x if self.upwards else x - self.wall) / self.units.length

    def _converted(self, name: str, values: Array) -> Array:
        units, sign = self.units, -1.0 if self.upwards else 1.0
        if name in _PLACES:
            return self._place(values)
        if name in SCALED_COLUMNS and self.upwards:
            return 1.0 - values
        if name in _SPEEDS:
            return (sign if name == "vx" else 1.0) * values / units.speed
        if name == IMAGE_COLUMN:
            return sign * values
        scales = {DISPLACEMENT_COLUMN: units.length, TIME_COLUMN: units.time}
        scales[MASS_COLUMN] = units.mass
        return values / scales.get(name, 1.0)

    def _resolution(self, frame: DumpFrame) -> float:
        """Return the resolution of shifted positions, from the digits of the printed positions."""
        own = frame.absolute_resolution / min(self.units.length, self.units.speed)
        digits = frame.significant_digits() if self.wall != 0.0 else _EXACT_DIGITS
        name = next((name for name in _PLACES if name in frame.columns), None)
        if digits >= _EXACT_DIGITS or name is None:
            return own
        return max(own, float(np.max(frame.resolution(name, digits))) / self.units.length)


class ViewedDump(DumpFrames):
    """Dump in the chain's units."""

    def __init__(self, source: DumpFrames, view: DumpView) -> None:
        self._source, self._view = source, view

    def frames(self, progress: Callable[[int], None] | None = None) -> Iterator[DumpFrame]:
        """Yield the frames in the order of the file."""
        for frame in self._source.frames(progress):
            yield self._view.of(frame)
        self.truncated = self._source.truncated
