"""One frame of a LAMMPS dump, whatever file it came from."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


class TruncatedFrameError(Exception):
    """The file ends inside a frame, as after a crash; everything before is sound."""


@dataclass(frozen=True)
class DumpFrame:
    """
    One frame, its columns converted only when asked for.

    Attributes
    ----------
    step : int
        LAMMPS timestep number.
    time : float or None
        Simulation time, where the dump carries it (``dump_modify time yes``).
    columns : tuple of str
        Names of the columns.
    bounds : ndarray of shape (3, 2)
        Lower and upper bound of the box in x, y and z.
    order : ndarray of shape (n,) or None
        Rows in the order of ids; None where they are in order already.
    raw_column : callable
        Returns a column by its index, in the order of the file.
    raw_text : callable or None
        Returns the text of a column by its index; None for binary dumps.
    """

    step: int
    time: float | None
    columns: tuple[str, ...]
    bounds: NDArray[np.float64]
    order: NDArray[np.int64] | None
    raw_column: Callable[[int], NDArray[np.float64]] = field(repr=False)
    raw_text: Callable[[int], list[bytes]] | None = field(default=None, repr=False)

    def column(self, name: str) -> NDArray[np.float64]:
        """
        Return one column as float64, sorted by id.

        Parameters
        ----------
        name : str
            One of `columns`.

        Returns
        -------
        numpy.ndarray of shape (n,)
            The values, exactly as written.
        """
        values = self.raw_column(self.columns.index(name))
        return values if self.order is None else values[self.order]

    def resolution(self, name: str) -> NDArray[np.float64]:
        """
        Return the half-width of the interval that each printed number stands for.

        The number of digits of the format is the largest met in the column, since ``%g`` drops
        trailing zeros; with 16 digits or more the number is taken as the float64 itself.

        Parameters
        ----------
        name : str
            One of `columns`.

        Returns
        -------
        numpy.ndarray of shape (n,)
            Half a unit of the last printed digit, or half a unit of float64.
        """
        values = np.abs(self.column(name))
        exact = 0.5 * np.spacing(values)
        if self.raw_text is None:
            return exact
        texts = self.raw_text(self.columns.index(name))
        digits = max(_significant_digits(text) for text in texts)
        if digits >= 16:
            return exact
        # A column of short numbers (0, 1, 2.5) was hardly printed with so few digits on purpose.
        digits = max(digits, 6)
        safe = np.where(values > 0.0, values, 1.0)
        half_unit = 0.5 * 10.0 ** (np.floor(np.log10(safe)) - digits + 1)
        return np.where(values > 0.0, half_unit, 0.0)


def _significant_digits(text: bytes) -> int:
    mantissa = text.lower().split(b"e")[0].lstrip(b"+-").replace(b".", b"")
    return len(mantissa.lstrip(b"0"))
