"""Order the collisions of a sweep, and divide the sweep into parts for job arrays."""

import bisect
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.axes import Axis, ValuesAxis, fields_of
from chaincor.workflows.campaign.points import Point, SweepPoints
from chaincor.workflows.errors import SweepError

# Number of cells that are created at a time. A process needs some seconds to describe them.
WINDOW = 8192
# The index of a cell is multiplied by these odd numbers to scatter its bits.
_ROUNDS = (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB, 0xD6E8FEB86659FD93)
_WORD = (1 << 64) - 1


@dataclass(frozen=True)
class _Digit:
    """
    Distinct values of one axis.

    Values that are equal, or differ only in their tolerance, belong to the same collision.
    """

    #: For each distinct value, the indices at which it occurs; None if all values differ.
    members: Sequence[Sequence[int]] | None
    size: int  #: Number of distinct values.

    @classmethod
    def of(cls, axis: Axis) -> "_Digit":
        if isinstance(axis, ValuesAxis) and axis.name != "tolerance":
            return cls(None, len(axis))
        found: dict[str, list[int]] = {}
        for place, entry in enumerate(axis):
            fields = sorted((key, value) for key, value in entry.items() if key != "tolerance")
            found.setdefault(repr(fields), []).append(place)
        return cls([*found.values()], len(found))

    def places(self, value: int) -> Sequence[int]:
        return (value,) if self.members is None else self.members[value]


class Cells:
    """
    Collisions of a sweep, or of one part of a sweep, in the order in which they are computed.

    A cell contains the points that share a row of a store because they differ only in their
    tolerance. Cells are numbered, and their points are created on request. Chains of one length
    follow each other, and a fixed permutation scatters them over the other axes. All parts
    therefore have equally many chains of each length and take about equally long. The division is
    the same on every machine.

    Raise SweepError if part `number` of `count` does not exist.
    """

    def __init__(self, points: SweepPoints, number: int = 1, count: int = 1) -> None:
        if not 1 <= number <= count:
            raise SweepError(
                f"shard {number}/{count} does not exist. Give 1/{count} to {count}/{count}"
            )
        self.points, self._part, self._parts = points, number - 1, count
        self._digits = [_Digit.of(group) for group in points.groups]
        lengths = [k for k, each in enumerate(points.groups) if "particles" in fields_of(each)]
        self._slowest = lengths[0] if lengths else None
        self._others = [k for k in range(len(self._digits)) if k != self._slowest]
        self._each = math.prod(self._digits[k].size for k in self._others)
        self._blocks = self._values_of_lengths()
        sizes = [len(values) * self._each for values in self._blocks]
        self._starts = [0, *itertools.accumulate(sizes)]

    def _values_of_lengths(self) -> list[list[int]]:
        """Return, for each chain length, the values on its axis that give this length."""
        if self._slowest is None:
            return [[0]]
        group, digit = self.points.groups[self._slowest], self._digits[self._slowest]
        found: dict[Any, list[int]] = {}
        for value in range(digit.size):
            length = group[digit.places(value)[0]].get("particles")
            found.setdefault(repr(length), []).append(value)
        return [found[key] for key in sorted(found, key=lambda key: (len(key), key))]

    def __len__(self) -> int:
        return len(range(self._part, self._starts[-1], self._parts))

    @property
    def number_of_points(self) -> int:
        """Number of points. For a large part, the number is estimated from the mean per cell."""
        if self._parts == 1:
            return len(self.points)
        if len(self) <= WINDOW:
            return len(self.numbers(0, WINDOW))
        return round(len(self) * len(self.points) / self._starts[-1])

    def __getitem__(self, place: int) -> list[int]:
        """Return the numbers of the points in a cell."""
        rank = range(self._part, self._starts[-1], self._parts)[place]
        block = bisect.bisect_right(self._starts, rank) - 1
        values = self._blocks[block]
        index = scattered(rank - self._starts[block], len(values) * self._each, block)
        length, rest = divmod(index, self._each)
        chosen = dict.fromkeys(range(len(self._digits)), 0)
        if self._slowest is not None:
            chosen[self._slowest] = values[length]
        for k in reversed(self._others):
            rest, chosen[k] = divmod(rest, self._digits[k].size)
        groups = zip(self._digits, self.points.groups, chosen.values(), strict=True)
        numbers = [0]
        for digit, group, value in groups:
            places = digit.places(value)
            numbers = [number * len(group) + place for number in numbers for place in places]
        return numbers

    def numbers(self, first: int, last: int) -> list[int]:
        """Return the numbers of the points in the cells from `first` up to `last`."""
        return [number for place in range(first, min(last, len(self))) for number in self[place]]

    def first_scenes(self, count: int) -> list[Scene]:
        """Return the first points of the sweep, or the points in the first cells of a part."""
        numbers = range(len(self.points))[:count]
        return [self.points[k] for k in (numbers if self._parts == 1 else self.numbers(0, count))]

    def windows(self) -> Iterator[list[Point]]:
        """Yield the points of WINDOW cells at a time, with long chains first."""
        last = len(self)
        while last > 0:
            first = max(last - WINDOW, 0)
            yield [self.points.point(number) for number in self.numbers(first, last)]
            last = first


def scattered(index: int, size: int, block: int = 0) -> int:
    """
    Return the position of an index in a fixed pseudo-random permutation of ``range(size)``.

    Each `block` has its own permutation. Otherwise short blocks would be divided among parts alike.

    Four rounds of a Feistel network permute a range whose size is a power of four. The rounds are
    repeated until the position lies in ``range(size)``.
    """
    half = (max(size - 1, 1).bit_length() + 1) // 2
    mask = (1 << half) - 1
    while True:
        left, right = index >> half, index & mask
        for odd in _ROUNDS:
            bits = ((right + odd >> 7) + block) * odd & _WORD
            left, right = right, left ^ ((bits ^ bits >> 29) * odd >> 31 & mask)
        index = left << half | right
        if index < size:
            return index
