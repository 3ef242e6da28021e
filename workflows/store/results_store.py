"""Results store: one SQLite file with one row for each collision."""

import datetime
import json
from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.checked_rows import KEY, check_rows
from chaincor.workflows.store.connection import address, connect, named_errors, transaction
from chaincor.workflows.store.row import (
    Row,
    array_from_bytes,
    array_to_bytes,
    row_key,
)
from chaincor.workflows.store.schema import FAILURE_COLUMNS, SCHEMA_VERSION

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_HAS_ARRAYS = (
    "EXISTS (SELECT 1 FROM {0}.arrays AS kept "
    "WHERE kept.collision_sha256 = collisions.collision_sha256) AS has_arrays"
)
# Columns that decide whether a collision must be run, and which of two rows stays.
_STANDINGS = f"""
    SELECT collision_sha256, restitution, restitution_error, tolerance, failure_tolerance,
    failure_stands, tries, finished, {_HAS_ARRAYS} FROM {{0}}.collisions
"""
# Largest number of keys in one query. Older versions of SQLite accept 999 values.
_MOST_KEYS = 500
_ROW = f"""
    SELECT collisions.*, environments.versions, {_HAS_ARRAYS.format("main")}
    FROM collisions LEFT JOIN environments ON environment = environments.id
    WHERE collision_sha256 = ?
"""
_ARRAYS = "SELECT name, npy FROM arrays WHERE collision_sha256 = ?"
_INSERT_ARRAY = "INSERT INTO arrays VALUES (?, ?, ?)"
# Rows that both this store (`main`) and the store to be merged (`source`) have, in one order.
_BOTH = """
    WHERE collision_sha256 IN (SELECT collision_sha256 FROM {0}.collisions)
    ORDER BY collision_sha256
"""
# Rows to copy from `source`: all except those that do not replace a row of `main`.
_TAKEN = "WHERE collision_sha256 NOT IN (SELECT value FROM json_each(:staying))"
_ENVIRONMENT = """
    (SELECT ours.id FROM main.environments AS ours JOIN source.environments AS theirs
    USING (versions) WHERE theirs.id = environment)
"""


class Store:
    """
    A results store in one SQLite file.

    One row holds one collision for all tolerances: the result with the smallest error stays
    (:meth:`~chaincor.workflows.store.row.Row.yields_to`). Every write is its own transaction, so
    that a killed program leaves only complete rows.

    Parameters
    ----------
    path : pathlib.Path or str
        The file. It is created if it does not exist.
    read_only : bool
        Whether to refuse all changes.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    connection : sqlite3.Connection
        Connection to the file, in autocommit mode.

    Raises
    ------
    StoreError
        If this version cannot use the file as a store.
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
        Return the row of a scene, or None if the scene must be computed.

        A scene must be computed if it has no result, if the result is not accurate enough, or if
        requested arrays are missing.
        """
        (standing,) = self.standings([scene])
        enough = standing is not None and standing.answers(scene, arrays=arrays)
        return self.find(scene, arrays=arrays) if enough else None

    def find(self, scene: Scene, *, arrays: bool = False) -> Row | None:
        """Return the row of a scene, whatever its accuracy, even if it failed; None without one."""
        key = row_key(scene)
        rows = self._rows(_ROW, (key,))
        if not rows:
            return None
        (found,) = rows
        try:
            _ = found.scene, found.result  # reads the JSON now, to find damage
        except (TypeError, ValueError) as error:
            raise StoreError(
                f"the row collision_sha256={key} of {self.path} is damaged ({error}). Run the "
                "sweep into a new store"
            ) from None
        kept = self.select(_ARRAYS, (key,))[1] if arrays else []
        return Row(found.columns, {name: self._array(key, name, npy) for name, npy in kept})

    def _array(self, key: str, name: Any, npy: Any) -> "NDArray[np.float64]":
        try:
            return array_from_bytes(npy)
        except (ValueError, TypeError, EOFError, MemoryError, SyntaxError) as error:
            raise StoreError(
                f"the array {name!a} of the row {KEY}={key} of {self.path} is damaged "
                f"({error}). Run the sweep into a new store"
            ) from None

    def _rows(self, query: str, parameters: Sequence[Any] = ()) -> list[Row]:
        names, rows = self.select(query, parameters)
        place = names.index(KEY)
        check_rows(self.path, names, rows, [row[place] for row in rows])
        return [Row(dict(zip(names, values, strict=True))) for values in rows]

    def standings(self, scenes: Sequence[Scene]) -> list[Row | None]:
        """
        Return a row of each scene with the columns that decide whether it must be run.

        The result has None for a scene without a row.
        """
        return self.standings_of([row_key(scene) for scene in scenes])

    def standings_of(self, keys: Sequence[str]) -> list[Row | None]:
        """Return the same as :meth:`standings`, for keys of rows."""
        found: dict[str, Row] = {}
        for begin in range(0, len(keys), _MOST_KEYS):
            part = keys[begin : begin + _MOST_KEYS]
            places = ", ".join("?" * len(part))
            query = f"{_STANDINGS.format('main')} WHERE collision_sha256 IN ({places})"
            found |= {row.columns["collision_sha256"]: row for row in self._rows(query, part)}
        return [found.get(key) for key in keys]

    def check_writable(self) -> None:
        """Raise an error if the store cannot be written, before hours of computation are lost."""
        with named_errors(self.path), transaction(self.connection, end="ROLLBACK"):
            # SQLite lets a transaction begin on a read-only file, but refuses the first change.
            self.connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    def version(self) -> int:
        """Return a number that changes when another program has written the store."""
        with named_errors(self.path):
            return self.connection.execute("PRAGMA data_version").fetchone()[0]

    def record(
        self, found: Iterable[tuple[Scene, Row]], *, arrays: bool = False, replace: bool = False
    ) -> None:
        """Write the results or failures of scenes as :meth:`write` does."""
        self.write([row.of_scene(scene) for scene, row in found], arrays=arrays, replace=replace)

    def write(self, rows: Sequence[Row], *, arrays: bool = False, replace: bool = False) -> None:
        """
        Write rows with the columns of their scenes in one transaction.

        :meth:`~chaincor.workflows.store.row.Row.yields_to` decides which result stays. With
        `replace`, a result replaces an older one whose tolerance is not tighter. Raises
        StoreWriteError, and writes nothing, if the store cannot be written.
        """
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        with named_errors(self.path), transaction(self.connection):
            olds = self.standings_of([row.columns[KEY] for row in rows])
            seen: set[str] = set()
            new: dict[tuple[str, ...], list[tuple[Any, ...]]] = {}
            later: list[tuple[Row, Row | None]] = []
            kept: list[tuple[str, str, bytes]] = []
            environments: dict[str, int] = {}
            for row, old in zip(rows, olds, strict=True):
                key = row.columns[KEY]
                if old is not None or key in seen or not row.has_result:
                    later.append((row, old))
                    continue
                seen.add(key)
                columns = {**row.columns, "tries": 1, "finished": now}
                versions = columns.pop("versions")
                if versions not in environments:
                    environments[versions] = self._environment(versions)
                columns["environment"] = environments[versions]
                new.setdefault(tuple(columns), []).append(tuple(columns.values()))
                kept += _npy(key, row) if arrays else ()
            # Rows of new collisions are most of a sweep, and are written in one statement.
            for names, values in new.items():
                places = f"VALUES ({', '.join('?' * len(names))})"
                self.connection.executemany(_upsertion(names, places), values)
            self.connection.executemany(_INSERT_ARRAY, kept)
            for row, old in later:
                if row.columns[KEY] in seen:
                    (old,) = self.standings_of([row.columns[KEY]])
                seen.add(row.columns[KEY])
                self._write(row, old, now, arrays, replace)

    def _write(self, row: Row, old: Row | None, finished: str, arrays: bool, replace: bool) -> None:
        key = row.columns[KEY]
        tries = 1 + (0 if old is None else old.columns["tries"])
        columns = {**row.columns, "tries": tries, "finished": finished}
        if not row.has_result:
            asked = columns["failure_tolerance"]
            if old is None or not old.has_result:
                self._upsert(columns)
            elif not (asked is None or old.reaches(asked)):
                kept = (*FAILURE_COLUMNS, "tries")
                self._update(key, {name: columns[name] for name in kept})
            return
        had_arrays = old is not None and old.columns["has_arrays"]
        # If the row had arrays, write the new ones: kept arrays must belong to the row's result.
        keep_arrays = arrays or had_arrays
        columns |= _NO_FAILURE
        if old is not None:
            new = Row(columns | {"has_arrays": keep_arrays})
            if not old.yields_to(new, renew=replace or (arrays and not had_arrays)):
                if tightened := old.tightened_by(new):
                    self._update(key, tightened | _NO_FAILURE | {"tries": tries})
                return
            columns |= new.tightened_by(old)
            self.connection.execute("DELETE FROM arrays WHERE collision_sha256 = ?", (key,))
        columns["environment"] = self._environment(columns.pop("versions"))
        self._upsert(columns)
        if keep_arrays:
            self.connection.executemany(_INSERT_ARRAY, _npy(key, row))

    def merge(self, other: "Store") -> tuple[int, int, int]:
        """
        Copy the rows of another store in one transaction.

        If both stores have a row, :meth:`~chaincor.workflows.store.row.Row.yields_to` decides which
        one stays. Returns the numbers of such rows that were replaced, equal, and kept. Raises
        StoreWriteError, and copies nothing, if this store cannot be written.
        """
        with named_errors(self.path):
            self.connection.execute("ATTACH ? AS source", (address(other.path, "ro"),))
            try:
                with transaction(self.connection):
                    return self._merge_source()
            finally:
                self.connection.execute("DETACH source")

    def _merge_source(self) -> tuple[int, int, int]:
        # SQL copies the unchanged rows: Python takes five times as long.
        replaced = equal = kept = 0
        staying: list[str] = []
        changes: dict[str, dict[str, Any]] = {}
        ours = self._rows(_STANDINGS.format("main") + _BOTH.format("source"))
        theirs = self._rows(_STANDINGS.format("source") + _BOTH.format("main"))
        for old, new in zip(ours, theirs, strict=True):
            key, taken = old.columns["collision_sha256"], old.yields_to(new)
            if taken:
                replaced += 1
            else:
                staying.append(key)
                better = new.yields_to(old)
                kept, equal = kept + better, equal + (not better)
            if tightened := new.tightened_by(old) if taken else old.tightened_by(new):
                changes[key] = tightened
        names = [row[1] for row in self.connection.execute("PRAGMA main.table_info(collisions)")]
        values = ", ".join(_ENVIRONMENT if name == "environment" else f'"{name}"' for name in names)
        for statement in (
            "INSERT OR IGNORE INTO environments (versions) "
            "SELECT versions FROM source.environments "
            f"WHERE id IN (SELECT environment FROM source.collisions {_TAKEN})",
            "DELETE FROM arrays WHERE collision_sha256 IN "
            f"(SELECT collision_sha256 FROM source.collisions {_TAKEN})",
            _upsertion(tuple(names), f"SELECT {values} FROM source.collisions {_TAKEN}"),
            f"INSERT INTO arrays SELECT * FROM source.arrays {_TAKEN}",
        ):
            self.connection.execute(statement, {"staying": json.dumps(staying)})
        for key, changed in changes.items():
            self._update(key, changed)
        return replaced, equal, kept

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
        Run an SQL query; the schema is in ``store/schema.py``.

        Parameters
        ----------
        query : str
            A SELECT statement.
        parameters : sequence or dict
            Values for its placeholders.

        Returns
        -------
        columns : list of str
            Names of the columns.
        rows : list of tuple
            Values of each row.
        """
        with named_errors(self.path):
            cursor = self.connection.execute(query, parameters)
            return [column[0] for column in cursor.description], cursor.fetchall()


def _npy(key: str, row: Row) -> list[tuple[str, str, bytes]]:
    return [(key, name, array_to_bytes(array)) for name, array in row.arrays.items()]


_NO_FAILURE: dict[str, Any] = dict.fromkeys(FAILURE_COLUMNS)


@lru_cache(maxsize=16)
def _upsertion(columns: tuple[str, ...], rows: str = "") -> str:
    names = ", ".join(f'"{name}"' for name in columns)
    values = ", ".join(f":{name}" for name in columns)
    updates = ", ".join(f'"{name}" = excluded."{name}"' for name in columns)
    return (
        f"INSERT INTO collisions ({names}) {rows or f'VALUES ({values})'} "
        f"ON CONFLICT (collision_sha256) DO UPDATE SET {updates}"
    )
