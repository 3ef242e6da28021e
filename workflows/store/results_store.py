"""A results store: one SQLite file, one row a collision."""

import datetime
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Self

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.connection import connect, named_errors, transaction
from chaincor.workflows.store.row import (
    Row,
    array_from_bytes,
    array_to_bytes,
    row_key,
    scene_columns,
)
from chaincor.workflows.store.schema import FAILURE_COLUMNS, SCHEMA_VERSION

_HAS_ARRAYS = (
    "EXISTS (SELECT 1 FROM arrays WHERE arrays.collision_sha256 = collisions.collision_sha256) "
    "AS has_arrays"
)
# What decides whether a collision has to be run, and which of two rows stays.
_STANDINGS = f"""
    SELECT collision_sha256, restitution, restitution_error, tolerance, failure_tolerance,
    failure_stands, tries, finished, {_HAS_ARRAYS} FROM collisions
"""
# Keys of one question to the database; older versions take 999 values.
_MOST_KEYS = 500
_ROWS = f"""
    SELECT collisions.*, environments.versions, {_HAS_ARRAYS}
    FROM collisions LEFT JOIN environments ON environment = environments.id
"""
_ARRAYS = "SELECT name, npy FROM arrays WHERE collision_sha256 = ?"


class Store:
    """
    A results store in one SQLite file.

    A row is a collision whatever the tolerance: of its results the one that reached the smaller
    error stays (:meth:`~chaincor.workflows.store.row.Row.yields_to`). Every write is a
    transaction of its own, so that a killed program leaves whole rows only.

    Parameters
    ----------
    path : pathlib.Path or str
        The file; made if it is not there.
    read_only : bool
        Whether to refuse to change anything.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    connection : sqlite3.Connection
        To it, in autocommit mode.

    Raises
    ------
    StoreError
        If the file is not a store this version can use.
    StoreWriteError
        If the machine does not let it be written.

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
        self.path = Path(path)
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
        Return the result of a scene; None where it would have to be computed.

        That is where it is not there, not exact enough, or lacks the arrays that are wanted.
        """
        (standing,) = self.standings([scene])
        enough = standing is not None and standing.answers(scene, arrays=arrays)
        return self.find(scene, arrays=arrays) if enough else None

    def find(self, scene: Scene, *, arrays: bool = False) -> Row | None:
        """Return the row of a scene, however exact, even if it failed; None where there is none."""
        key = row_key(scene)
        found = next(self._rows(f"{_ROWS} WHERE collision_sha256 = ?", (key,)), None)
        if found is None:
            return None
        try:
            _ = found.scene, found.result  # JSON is read now, and whether it can be
        except (TypeError, ValueError) as error:
            raise StoreError(
                f"the row collision_sha256={key} of {self.path} is damaged ({error}); expected "
                "what `chaincor sweep` wrote: run the sweep into a new store"
            ) from None
        kept = self.select(_ARRAYS, (key,))[1] if arrays else []
        return Row(found.columns, {name: array_from_bytes(npy) for name, npy in kept})

    def _rows(self, query: str, parameters: Sequence[Any] = ()) -> Iterator[Row]:
        with named_errors(self.path):
            cursor = self.connection.execute(query, parameters)
            names = [column[0] for column in cursor.description]
            for values in cursor:
                yield Row(dict(zip(names, values, strict=True)))

    def standings(self, scenes: Sequence[Scene]) -> list[Row | None]:
        """Return of each scene's row what decides whether it has to be run; None without a row."""
        return self._standings([row_key(scene) for scene in scenes])

    def _standings(self, keys: Sequence[str]) -> list[Row | None]:
        found: dict[str, Row] = {}
        for begin in range(0, len(keys), _MOST_KEYS):
            part = keys[begin : begin + _MOST_KEYS]
            query = f"{_STANDINGS} WHERE collision_sha256 IN ({', '.join('?' * len(part))})"
            found |= {row.columns["collision_sha256"]: row for row in self._rows(query, part)}
        return [found.get(key) for key in keys]

    def check_writable(self) -> None:
        """Raise now, not after hours of computing, if the store cannot be written."""
        with named_errors(self.path), transaction(self.connection, end="ROLLBACK"):
            # Only a change, not the wish for one, is refused on a read-only file.
            self.connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    def record(
        self, found: Iterable[tuple[Scene, Row]], *, arrays: bool = False, replace: bool = False
    ) -> None:
        """
        Write what came of scenes, all in one transaction or, with StoreWriteError, nothing.

        What stays is decided by :meth:`~chaincor.workflows.store.row.Row.yields_to`;
        `replace` lets a result take the place of one that was asked for no more exactly.
        """
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        with named_errors(self.path), transaction(self.connection):
            for scene, row in found:
                self._write(scene, row, now, arrays, replace)

    def _write(self, scene: Scene, row: Row, finished: str, arrays: bool, replace: bool) -> None:
        key, asked = row_key(scene), scene.asked_tolerance
        (old,) = self._standings([key])
        tries = 1 + (0 if old is None else old.columns["tries"])
        columns = {**row.columns, **scene_columns(scene), "tries": tries, "finished": finished}
        if not row.has_result:
            columns |= {"failure_tolerance": asked, "tolerance": asked}
            if old is None or not old.has_result:
                self._upsert(columns)
            elif not old.answers(scene):
                kept = (*FAILURE_COLUMNS, "tries")
                self._update(key, {name: columns[name] for name in kept})
            return
        had_arrays = old is not None and old.columns["has_arrays"]
        # Arrays that were kept must stay those of the row's result.
        columns["has_arrays"] = arrays or had_arrays
        columns |= _NO_FAILURE
        kept_arrays = row.arrays if columns["has_arrays"] else {}
        self._put(
            old,
            Row(columns),
            {name: array_to_bytes(array) for name, array in kept_arrays.items()},
            changing=_NO_FAILURE | {"tries": tries},
            renew=replace or (arrays and not had_arrays),
        )

    def merge(self, other: "Store") -> None:
        """
        Copy the rows of another store, all in one transaction or, with StoreWriteError, nothing.

        Where both have a row, what stays is decided by
        :meth:`~chaincor.workflows.store.row.Row.yields_to`.
        """
        with named_errors(self.path), transaction(self.connection):
            for row in other._rows(_ROWS):
                key = row.columns["collision_sha256"]
                (old,) = self._standings([key])
                arrays = other.select(_ARRAYS, (key,))[1] if row.columns["has_arrays"] else []
                self._put(old, row, dict(arrays), changing={})

    def _put(
        self,
        old: Row | None,
        new: Row,
        arrays: Mapping[str, bytes],
        *,
        changing: dict[str, Any],
        renew: bool = False,
    ) -> None:
        """Write the better of two rows; `changing` is what the old one, if it stays, has anew."""
        columns = {**new.columns}
        key = columns["collision_sha256"]
        if old is not None:
            if not old.yields_to(new, renew=renew):
                if tightened := old.tightened_by(new):
                    self._update(key, tightened | changing)
                return
            columns |= new.tightened_by(old)
            self.connection.execute("DELETE FROM arrays WHERE collision_sha256 = ?", (key,))
        del columns["has_arrays"]
        versions = columns.pop("versions")
        columns["environment"] = None if versions is None else self._environment(versions)
        self._upsert(columns)
        if arrays:
            rows = [(key, name, npy) for name, npy in arrays.items()]
            self.connection.executemany("INSERT INTO arrays VALUES (?, ?, ?)", rows)

    def _environment(self, versions: str) -> int:
        query = "SELECT id FROM environments WHERE versions = ?"
        known = self.connection.execute(query, (versions,)).fetchone()
        if known is None:
            insert = "INSERT INTO environments (versions) VALUES (?)"
            return self.connection.execute(insert, (versions,)).lastrowid or 0
        return known[0]

    def _upsert(self, columns: dict[str, Any]) -> None:
        self.connection.execute(_upsertion(tuple(columns)), columns)

    def _update(self, key: str, columns: dict[str, Any]) -> None:
        assignments = ", ".join(f"{name} = :{name}" for name in columns)
        query = f"UPDATE collisions SET {assignments} WHERE collision_sha256 = :key"
        self.connection.execute(query, columns | {"key": key})

    def select(
        self, query: str, parameters: Sequence[Any] | dict[str, Any] = ()
    ) -> tuple[list[str], list[tuple[Any, ...]]]:
        """
        Ask the tables directly; the schema is in ``store/schema.py``.

        Parameters
        ----------
        query : str
            A SELECT statement.
        parameters : sequence or dict
            Values for its placeholders.

        Returns
        -------
        columns : list of str
            Names.
        rows : list of tuple
            Values.
        """
        with named_errors(self.path):
            cursor = self.connection.execute(query, parameters)
            return [column[0] for column in cursor.description], cursor.fetchall()


_NO_FAILURE: dict[str, Any] = dict.fromkeys(FAILURE_COLUMNS)


@lru_cache(maxsize=16)
def _upsertion(columns: tuple[str, ...]) -> str:
    names = ", ".join(f'"{name}"' for name in columns)
    values = ", ".join(f":{name}" for name in columns)
    updates = ", ".join(f'"{name}" = excluded."{name}"' for name in columns)
    return (
        f"INSERT INTO collisions ({names}) VALUES ({values}) "
        f"ON CONFLICT (collision_sha256) DO UPDATE SET {updates}"
    )
