"""Define the axes of a sweep. Each value on an axis sets fields of a scene."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

Axis = Sequence[Mapping[str, Any]]

# If a range has more values than this, each value is computed when it is needed, because a stored
# value takes 8 bytes.
_MOST_KEPT = 1_000_000


class ValuesAxis(Sequence[Mapping[str, Any]]):
    """Axis of one field, with a sequence of values that may be computed on request."""

    def __init__(self, name: str, values: Sequence[Any]) -> None:
        self.name, self._values = name, values

    def __len__(self) -> int:
        return len(self._values)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return ValuesAxis(self.name, self._values[index])
        return {self.name: self._values[index]}


class ZippedAxis(Sequence[Mapping[str, Any]]):
    """Axes of equal length whose values combine only at equal positions."""

    def __init__(self, axes: Sequence[Axis]) -> None:
        self._axes = axes

    def __len__(self) -> int:
        return len(self._axes[0])

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return ZippedAxis([axis[index] for axis in self._axes])
        return merged(*(axis[index] for axis in self._axes))


class Spaced(Sequence[float]):
    """
    Numbers with equal differences or equal ratios, computed on request.

    The numbers are ``first + k * step``, or 10 to this power. If `last` is given, the last number
    is exactly `last`.
    """

    def __init__(
        self, first: float, step: float, count: int, last: float | None = None, *, log: bool = False
    ) -> None:
        self._first, self._step, self._count = first, step, count
        self._last, self._log = last, log

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: Any) -> Any:
        places = range(self._count)[index]
        return [*map(self._value, places)] if isinstance(places, range) else self._value(places)

    def _value(self, place: int) -> float:
        if self._last is not None and place == self._count - 1 > 0:
            return self._last
        value = self._first + place * self._step
        return 10.0**value if self._log else value


def spaced(first: float, last: float, count: int, *, log: bool) -> Sequence[float]:
    """
    Return numbers with equal differences or ratios, from `first` to `last` inclusive.

    Short ranges are listed and rounded as in NumPy. Values of long ranges are computed on request.
    """
    if count <= _MOST_KEPT:
        space = np.geomspace if log else np.linspace
        return space(first, last, count).tolist()
    begin, end = (float(np.log10(first)), float(np.log10(last))) if log else (first, last)
    return Spaced(begin, (end - begin) / (count - 1), count, last, log=log)


def merged(*parts: Mapping[str, Any]) -> dict[str, Any]:
    """Join the fields that the values of several axes set."""
    return {key: value for part in parts for key, value in part.items()}


def fields_of(axis: Axis) -> list[str]:
    """Return the fields that an axis sets, without repetition, in the order of their first use."""
    if isinstance(axis, ValuesAxis):
        return [axis.name]
    return list(dict.fromkeys(key for entry in axis for key in entry))
