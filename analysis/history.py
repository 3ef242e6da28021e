"""Record a collision in time, with a bounded size for any number of frames."""

from typing import Generic, TypeVar

import numpy as np

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.restitution import bond_strains
from chaincor.analysis.results import History
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential

# Whole states are kept only for figures: at most as many as a figure can show, and at most this
# many bytes. Time series have at most _SERIES_ROWS rows.
_PICTURE_FRAMES = 600
_PICTURE_BYTES = 64 * 2**20
_SERIES_ROWS = 20_000

Item = TypeVar("Item")


class Thinned(Generic[Item]):
    """
    Every k-th item of a sequence. k doubles whenever more items than a limit (>= 2) would be kept.

    The last item is always kept, and the record reaches the end.
    """

    def __init__(self, limit: int):
        self._limit = max(2, limit)
        self._items: list[Item] = []
        self._last: Item | None = None
        self._count = 0
        self.stride = 1

    def feed(self, item: Item) -> None:
        """Add the next item; keep it if its number is a multiple of k."""
        if self._count % self.stride == 0:
            if len(self._items) == self._limit:
                self._items = self._items[::2]
                self.stride *= 2
            if self._count % self.stride == 0:
                self._items.append(item)
        self._last = item
        self._count += 1

    def items(self) -> list[Item]:
        """Return the kept items in order: at most the limit, and the last item."""
        if self._items and self._last is not None and self._items[-1] is not self._last:
            return [*self._items, self._last]
        return list(self._items)


class Record:
    """Motion and energies of a body in time, collected state by state."""

    def __init__(self, masses: Array, bond: Potential | None):
        self._masses = masses
        self._total_mass = float(np.sum(masses))
        self._bond = bond
        limit = min(_PICTURE_FRAMES, _PICTURE_BYTES // (16 * masses.size))
        self._states: Thinned[ChainState] = Thinned(limit)
        self._rows: Thinned[tuple[float, ...]] = Thinned(_SERIES_ROWS)
        self.bond_min = np.inf
        self.bond_max = -np.inf
        self.count = 0

    def feed(self, state: ChainState) -> None:
        """Add the next state to the record."""
        self.count += 1
        self._states.feed(state)
        v, m = state.velocities, self._masses
        momentum = float((m * v).sum())
        translation = 0.5 * momentum**2 / self._total_mass
        relative = v - momentum / self._total_mass
        vibration = 0.5 * float((m * relative) @ relative)
        low = high = np.nan
        if v.size > 1:
            strains = bond_strains(state.displacements)
            low, high = 1.0 + float(strains.min()), 1.0 + float(strains.max())
            if self._bond is not None:
                vibration += float(np.sum(self._bond.energy(strains)))
            self.bond_min = min(self.bond_min, low)
            self.bond_max = max(self.bond_max, high)
        self._rows.feed((state.time, momentum, translation, vibration, low, high))

    def history(self, origin: float) -> History:
        """Return the record, with times relative to an origin."""
        states = self._states.items()
        rows = np.array(self._rows.items()).T
        return History(
            np.array([state.time for state in states]) - origin,
            np.array([state.displacements for state in states]),
            np.array([state.velocities for state in states]),
            rows[0] - origin,
            *rows[1:],
        )
