"""One frame of a LAMMPS dump, from any kind of file."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError

# float64 represents all whole numbers up to this one exactly.
_LARGEST_WHOLE = 2.0**53


class TruncatedFrameError(Exception):
    """The file ends inside a frame, for example after a crash; all earlier frames are complete."""


@dataclass(frozen=True)
class DumpFrame:
    """One frame of a dump. Columns are converted to numbers on demand."""

    step: int  #: LAMMPS timestep number.
    time: float | None  #: Simulated time, if the dump has it (``dump_modify time yes``).
    columns: tuple[str, ...]  #: Names of the columns.
    bounds: Array  #: Lower and upper bound of the box in x, y and z; of shape (3, 2).
    #: Indices that sort the rows by id, of shape (n,); None if the rows are sorted already.
    order: NDArray[np.int64] | None
    #: Function that returns a column by its index, with rows in the order of the file.
    raw_column: Callable[[int], Array] = field(repr=False)
    #: Function that returns the printed text of a column by its index; None for binary dumps.
    raw_text: Callable[[int], list[bytes]] | None = field(default=None, repr=False)
    #: Whether the box is periodic along x. In a periodic box, positions may be wrapped.
    periodic_x: bool = False
    tilted: bool = False  #: Whether the box is triclinic.
    #: Units of the run, if the dump names them (``dump_modify units yes``).
    units: str | None = None
    #: Half a unit of the last decimal, if all numbers have the same number of decimals.
    absolute_resolution: float = 0.0
    #: Significant digits with which all numbers of the file were printed, if this is known.
    printed_digits: int | None = None

    def column(self, name: str) -> Array:
        """Return one column as float64, sorted by id; of shape (n,)."""
        if name not in self.columns:
            raise InputError(
                f"the frame of step {self.step} has no column '{name}' (it has "
                f"{' '.join(self.columns)}). Dump the same columns in all frames"
            )
        values = self.raw_column(self.columns.index(name))
        return values if self.order is None else values[self.order]

    def whole_numbers(self, name: str) -> NDArray[np.int64]:
        """
        Return a column of whole numbers, such as types, sorted by id; of shape (n,).

        Raises InputError, with the frame and the column, if a number is not whole.
        """
        values = self.column(name)
        wrong = values[~(np.abs(values) < _LARGEST_WHOLE) | (values != np.floor(values))]
        if wrong.size:
            raise InputError(
                f"the dump is damaged: column '{name}' of the frame of step {self.step} has the "
                f"value {wrong[0]:g}, where LAMMPS writes whole numbers. Repeat the run"
            )
        return values.astype(np.int64)

    def significant_digits(self) -> int:
        """
        Return the number of digits in the dump's format, as far as this frame shows.

        ``%g`` drops trailing zeros. The result is therefore the number of digits in the longest
        number, except ids and other whole numbers. The result is 17 for binary dumps, and at least
        6, the default of LAMMPS.
        """
        if self.printed_digits is not None:
            return self.printed_digits
        if self.raw_text is None:
            return 17
        words = (word for index in range(len(self.columns)) for word in self.raw_text(index))
        return max((_count_digits(word) for word in words if b"." in word), default=0) or 6

    @np.errstate(invalid="ignore")
    def resolution(self, name: str, digits: int) -> Array:
        """
        Return half a unit of the last printed digit of each number.

        Numbers have `digits` significant digits. With 16 digits or more, the result is the rounding
        error of float64.
        """
        values = np.abs(self.column(name))
        if digits >= 16:
            return np.maximum(0.5 * np.spacing(values), self.absolute_resolution)
        safe = np.where(values > 0.0, values, 1.0)
        half_unit = 0.5 * 10.0 ** (np.floor(np.log10(safe)) - digits + 1)
        return np.maximum(np.where(values > 0.0, half_unit, 0.0), self.absolute_resolution)


class DumpFrames(ABC):
    """
    Frames of a dump, or of a trajectory in another format. Iteration can be repeated.

    `truncated` says whether the last complete iteration found an incomplete frame.
    """

    truncated = False

    @abstractmethod
    def frames(self, progress: Callable[[int], None] | None = None) -> Iterator[DumpFrame]:
        """Yield the frames in order; `progress` receives the number of bytes read."""

    def __iter__(self) -> Iterator[DumpFrame]:
        return self.frames()

    def first(self) -> DumpFrame:
        """Return the first frame."""
        return next(self.frames())


def _count_digits(word: bytes) -> int:
    mantissa = word.lower().split(b"e")[0].lstrip(b"+-").replace(b".", b"")
    return max(6, len(mantissa.lstrip(b"0")))
