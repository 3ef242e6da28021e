"""Read several stores as one, for example the shards of a sweep."""

import contextlib
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.connection import named_errors
from chaincor.workflows.store.merge import copy_rows
from chaincor.workflows.store.results_store import Part, Store

# Size of the cache of each open store. SQLite reads a negative size as kilobytes.
_CACHE_KILOBYTES = 256
_HIDDEN = "collision_sha256 NOT IN (SELECT collision_sha256 FROM temp.hidden)"


def find_stores(paths: Sequence[Path]) -> list[Path]:
    """
    Return the paths of all stores: given files, and files ``*.sqlite`` in given folders.

    Raise StoreError for a folder without stores.
    """
    found: list[Path] = []
    for path in paths:
        inside = sorted(path.glob("*.sqlite")) if path.is_dir() else [path]
        if not inside:
            raise StoreError(f"the folder {path} has no store *.sqlite. Give a folder of shards")
        found += inside
    return found


@contextmanager
def open_stores(paths: Sequence[Path]) -> "Iterator[Store | StoreSet]":
    """Open a store for reading, or open several stores and folders of stores as one."""
    found = find_stores(paths)
    with ExitStack() as stack:
        if len(found) == 1:
            yield stack.enter_context(Store(found[0], read_only=True))
            return
        _allow_open_files(len(found))
        stores = [stack.enter_context(Store(path, read_only=True)) for path in found]
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="chaincor-"))
        yield stack.enter_context(StoreSet(paths[0], stores, Path(folder)))


class StoreSet:
    """
    Several open stores that are read as one.

    If a collision is in several stores, only the row counts that :func:`merge_stores` would keep.
    Such rows are merged into a temporary store in `folder` and hidden in the given stores. `path`
    is a name for messages.
    """

    def __init__(self, path: Path, stores: Sequence[Store], folder: Path) -> None:
        self.path = path
        for store in stores:
            store.connection.execute(f"PRAGMA cache_size = -{_CACHE_KILOBYTES}")
        self._parts = [*map(Part, stores)]
        self._merged: Store | None = None
        if shared := _shared_keys(stores):
            self._merged = Store(folder / "shared.sqlite")
            self._parts = [_merged_rows_hidden(store, self._merged, shared) for store in stores]
            self._parts.append(Part(self._merged))

    def __enter__(self) -> "StoreSet":
        return self

    def __exit__(self, *_: object) -> None:
        if self._merged is not None:
            self._merged.close()

    def parts(self) -> list[Part]:
        """Return the stores, each with the SQL condition for rows that count."""
        return self._parts


def _shared_keys(stores: Sequence[Store]) -> set[bytes]:
    """Return the keys that several stores have."""
    # Hashes of keys are compared instead of keys, because a hash takes only 8 bytes.
    hashes = [
        np.fromiter((hash(key) for (key,) in _keys(store)), dtype=np.int64) for store in stores
    ]
    ordered = np.sort(np.concatenate(hashes))
    twice = set(ordered[1:][ordered[1:] == ordered[:-1]].tolist())
    if not twice:
        return set()
    counts = Counter(key for store in stores for (key,) in _keys(store) if hash(key) in twice)
    return {key for key, count in counts.items() if count > 1}


def _keys(store: Store) -> Iterator[tuple[bytes]]:
    with named_errors(store.path):
        yield from store.connection.execute("SELECT collision_sha256 FROM collisions")


def _merged_rows_hidden(store: Store, merged: Store, shared: set[bytes]) -> Part:
    """Copy the shared rows of a store, and return the store with these rows hidden."""
    mine = [key for (key,) in _keys(store) if key in shared]
    if not mine:
        return Part(store)
    copy_rows(store, merged, [key.hex() for key in mine])
    store.connection.execute("CREATE TEMP TABLE hidden (collision_sha256 BLOB PRIMARY KEY)")
    store.connection.executemany("INSERT INTO temp.hidden VALUES (?)", ((key,) for key in mine))
    return Part(store, _HIDDEN)


def _allow_open_files(stores: int) -> None:
    """
    Raise the limit on open files, if there is one.

    A query may open two files per store.
    """
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 2 * stores + 64
    if soft not in (resource.RLIM_INFINITY, -1) and soft < wanted:
        most = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
