"""A record of bounded size of something of unknown length."""

from typing import Generic, TypeVar

Item = TypeVar("Item")


class Thinned(Generic[Item]):
    """
    Keeps every k-th of the items it is fed, k doubling so that no more than a limit stay.

    The last item is kept besides, so that the record reaches to the end.

    Parameters
    ----------
    limit : int
        Most items to keep, at least 2.
    """

    def __init__(self, limit: int):
        self._limit = max(2, limit)
        self._items: list[Item] = []
        self._last: Item | None = None
        self._count = 0
        self.stride = 1

    def feed(self, item: Item) -> None:
        """Offer the next item, which is kept if its turn comes."""
        if self._count % self.stride == 0:
            if len(self._items) == self._limit:
                self._items = self._items[::2]
                self.stride *= 2
            if self._count % self.stride == 0:
                self._items.append(item)
        self._last = item
        self._count += 1

    def items(self) -> list[Item]:
        """Return what was kept, in order: at most the limit, and the last item."""
        if self._items and self._last is not None and self._items[-1] is not self._last:
            return [*self._items, self._last]
        return list(self._items)
