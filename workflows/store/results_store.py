"""Read and write a results store, an SQLite file with one row for each collision."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from chaincor.lammps_inputs.given_texts import path_given
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.checked_rows import KEY, check_rows
from chaincor.workflows.store.connection import connect, named_errors, transaction
from chaincor.workflows.store.row import Row, array_from_bytes, row_key
from chaincor.workflows.store.schema import EXPRESSIONS, ROW_COLUMNS, SCHEMA_VERSION
from chaincor.workflows.store.writing import write_rows

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_HAS_ARRAYS = (
    "EXISTS (SELECT 1 FROM {0}.arrays AS kept "
    "WHERE kept.collision_sha256 = collisions.collision_sha256) AS has_arrays"
)
# These columns decide whether a collision must be run, and which of two rows is kept.
STANDINGS = f"""
    SELECT {EXPRESSIONS[KEY]} AS {KEY}, restitution, restitution_error, tolerance,
    failure_tolerance, failure_stands, tries, {EXPRESSIONS["finished"]} AS finished, {_HAS_ARRAYS}
    FROM {{0}}.collisions
"""
# Largest number of keys in one query. Older versions of SQLite accept up to 999 values.
_MOST_KEYS = 500
_ROWS = f"""
    SELECT {ROW_COLUMNS}, environments.versions, {_HAS_ARRAYS.format("main")}
    FROM collisions LEFT JOIN environments ON environment = environments.id
"""
_ARRAYS = "SELECT name, npy FROM arrays WHERE collision_sha256 = ?"


class Store:
    """
    Results store in one SQLite file.

    Each row describes one collision. Requests that differ only in their tolerance share a row,
    which keeps the result with the smallest error
    (:meth:`~chaincor.workflows.store.row.Row.yields_to`). Every write is its own transaction, so a
    killed program leaves only complete rows.

    Parameters
    ----------
    path : pathlib.Path or str
        The file. It is created if it does not exist.
    read_only : bool
        Whether the store refuses all changes.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    connection : sqlite3.Connection
        Connection to the file, in autocommit mode.

    Raises
    ------
    StoreError
        If this version of chaincor cannot use the file as a store.
    StoreWriteError
        If the file cannot be written.

    Examples
    --------
    >>> from chaincor import Scene, Store, collide
    >>> scene = Scene(particles=5, engine="reference")
    >>> with Store("results.sqlite") as store:
    ...     rows = collide([scene], store=store, progress=False)
    ...     len(store), round(store.get(scene).restitution, 4)
    (1, 0.5805)
    """

    def __init__(self, path: Path | str, *, read_only: bool = False) -> None:
        self.path = path_given("the results store", path)
        self.connection = connect(self.path, read_only=read_only)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self.connection.close()

    def __len__(self) -> int:
        return self.select("SELECT count(*) FROM collisions")[1][0][0]

    def get(self, scene: Scene, *, arrays: bool = False) -> Row | None:
        """
        Return the row of a scene; None if the scene must be computed.

        A scene must be computed if it has no result, if the result is not accurate enough, or if
        requested arrays are missing.
        """
        (standing,) = self.standings([scene])
        enough = standing is not None and standing.answers(scene, arrays=arrays)
        return self.find(scene, arrays=arrays) if enough else None

    def find(self, scene: Scene, *, arrays: bool = False) -> Row | None:
        """Return the row of a scene, even if it is inaccurate or a failure; None without a row."""
        return self.find_all([scene], arrays=arrays)[0]

    def find_all(self, scenes: Sequence[Scene], *, arrays: bool = False) -> list[Row | None]:
        """Return the rows of scenes, as :meth:`find` does for one."""
        keys = [row_key(scene) for scene in scenes]
        found = self._read_keys(_ROWS, keys)
        for key, row in found.items():
            try:
                _ = row.scene, row.result  # reads the JSON now to detect damage
            except (TypeError, ValueError) as error:
                raise StoreError(
                    f"the row {KEY}={key} of {self.path} is damaged ({error}). Run the sweep into "
                    "a new store"
                ) from None
            if arrays:
                kept = self.select(_ARRAYS, (bytes.fromhex(key),))[1]
                row.arrays.update((name, self._array(key, name, npy)) for name, npy in kept)
        return [found.get(key) for key in keys]

    def _read_keys(self, query: str, keys: Sequence[str]) -> dict[str, Row]:
        """Return the rows of a query that have some keys, by key."""
        found: dict[str, Row] = {}
        for begin in range(0, len(keys), _MOST_KEYS):
            part = keys[begin : begin + _MOST_KEYS]
            query_part = f"{query} WHERE {KEY} IN ({', '.join('?' * len(part))})"
            rows = self.read(query_part, [*map(bytes.fromhex, part)])
            found |= {row.columns[KEY]: row for row in rows}
        return found

    def _array(self, key: str, name: Any, npy: Any) -> "NDArray[np.float64]":
        try:
            return array_from_bytes(npy)
        except (ValueError, TypeError, EOFError, MemoryError, SyntaxError) as error:
            raise StoreError(
                f"the array {name!a} of the row {KEY}={key} of {self.path} is damaged "
                f"({error}). Run the sweep into a new store"
            ) from None

    def read(self, query: str, parameters: Sequence[Any] = ()) -> list[Row]:
        """
        Run a query, check its rows, and return them.

        The columns of the query must include the key.
        """
        names, rows = self.select(query, parameters)
        place = names.index(KEY)
        check_rows(self.path, names, rows, [row[place] for row in rows])
        return [Row(dict(zip(names, values, strict=True))) for values in rows]

    def standings(self, scenes: Sequence[Scene]) -> list[Row | None]:
        """
        Return a row for each scene, with the columns that decide whether the scene must be run.

        For a scene without a row, the result contains None.
        """
        return self.standings_of([row_key(scene) for scene in scenes])

    def standings_of(self, keys: Sequence[str]) -> list[Row | None]:
        """Return the rows of :meth:`standings` for given keys."""
        found = self._read_keys(STANDINGS.format("main"), keys)
        return [found.get(key) for key in keys]

    def check_writable(self) -> None:
        """
        Raise an error if the store cannot be written.

        Without this check, hours of computation could be lost.
        """
        with named_errors(self.path), transaction(self.connection, end="ROLLBACK"):
            # In a read-only file, SQLite allows a transaction but refuses the first change.
            self.connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    def has_arrays(self) -> bool:
        """Return whether any row has arrays."""
        return bool(self.select("SELECT EXISTS (SELECT 1 FROM arrays)")[1][0][0])

    def version(self) -> int:
        """Return a number that changes when another program writes to the store."""
        with named_errors(self.path):
            return self.connection.execute("PRAGMA data_version").fetchone()[0]

    def record(
        self, found: Iterable[tuple[Scene, Row]], *, arrays: bool = False, replace: bool = False
    ) -> None:
        """Write the results or failures of scenes by :meth:`write`."""
        self.write([row.of_scene(scene) for scene, row in found], arrays=arrays, replace=replace)

    def write(self, rows: Sequence[Row], *, arrays: bool = False, replace: bool = False) -> None:
        """
        Write rows in one transaction.

        The rows must have the columns of their scenes.
        :meth:`~chaincor.workflows.store.row.Row.yields_to` decides which result stays. If `replace`
        is true, a new result replaces an older result unless the older tolerance is tighter. If the
        store cannot be written, raise StoreWriteError and write nothing.
        """
        write_rows(self, rows, arrays=arrays, replace=replace)

    def parts(self) -> "list[Part]":
        """Return a list with this store as the only part, as in a :class:`StoreSet`."""
        return [Part(self)]

    def select(
        self, query: str, parameters: Sequence[Any] | dict[str, Any] = ()
    ) -> tuple[list[str], list[tuple[Any, ...]]]:
        """
        Run an SQL query; the schema is in ``store/schema.py``.

        Parameters
        ----------
        query : str
            A SELECT statement.
        parameters : sequence or dict
            Values for the placeholders of the query.

        Returns
        -------
        columns : list of str
            Names of the columns.
        rows : list of tuple
            Values in each row.
        """
        with named_errors(self.path):
            cursor = self.connection.execute(query, parameters)
            return [column[0] for column in cursor.description], cursor.fetchall()


class Part(NamedTuple):
    """One of several stores that are read as one."""

    store: Store
    #: SQL condition that excludes rows for which another store has a better row.
    condition: str = ""
