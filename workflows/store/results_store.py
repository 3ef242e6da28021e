"""A results store: one SQLite file, one row a collision."""

import datetime
import sqlite3
from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Self

from chaincor.lammps_inputs.arrays import Array
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
from chaincor.workflows.store.standing import Standing, standing_columns

_HAS_ARRAYS = (
    "EXISTS (SELECT 1 FROM arrays WHERE arrays.collision_sha256 = collisions.collision_sha256)"
)
_STANDINGS = f"SELECT collision_sha256, {standing_columns()} FROM collisions"
# Keys of one question to the database; older versions take 999 values.
_MOST_KEYS = 500
_ROW = f"""
    SELECT collisions.*, environments.versions, {_HAS_ARRAYS} AS has_arrays
    FROM collisions LEFT JOIN environments ON environment = environments.id
    WHERE collision_sha256 = ?
"""


class Store:
    """
    A results store in one SQLite file.

    A row is a collision whatever the tolerance: of its results the one that reached the smaller
    error stays (:meth:`~chaincor.workflows.store.standing.Standing.yields_to`). Every write is a
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
        with named_errors(self.path):
            return self.connection.execute("SELECT count(*) FROM collisions").fetchone()[0]

    def get(self, scene: Scene, *, arrays: bool = False) -> Row | None:
        """
        Return the result of a scene; None where it would have to be computed.

        That is where it is not there, not exact enough, or lacks the arrays that are wanted.
        """
        standing = self.standing(scene)
        enough = standing is not None and standing.answers(scene, arrays=arrays)
        return self.find(scene, arrays=arrays) if enough else None

    def find(self, scene: Scene, *, arrays: bool = False) -> Row | None:
        """Return the row of a scene, however exact, even if it failed; None where there is none."""
        key = row_key(scene)
        with named_errors(self.path):
            cursor = self.connection.execute(_ROW, (key,))
            row = cursor.fetchone()
            if row is None:
                return None
            names = [column[0] for column in cursor.description]
            kept = self._arrays(key) if arrays else {}
        found = Row(dict(zip(names, row, strict=True)), kept)
        try:
            _ = found.scene, found.result  # JSON is read now, and whether it can be
        except (TypeError, ValueError) as error:
            raise StoreError(
                f"the row collision_sha256={key} of {self.path} is damaged ({error}); expected "
                "what `chaincor sweep` wrote: run the sweep into a new store"
            ) from None
        return found

    def _arrays(self, key: str) -> dict[str, Array]:
        query = "SELECT name, npy FROM arrays WHERE collision_sha256 = ?"
        rows = self.connection.execute(query, (key,))
        return {name: array_from_bytes(content) for name, content in rows}

    def standing(self, scene: Scene) -> Standing | None:
        """Return what decides whether a scene has to be run; None where there is no row."""
        return self.standings([scene])[0]

    def standings(self, scenes: Sequence[Scene]) -> list[Standing | None]:
        """Return the same of each of several scenes."""
        keys = [row_key(scene) for scene in scenes]
        found: dict[str, Standing] = {}
        with named_errors(self.path):
            for begin in range(0, len(keys), _MOST_KEYS):
                part = keys[begin : begin + _MOST_KEYS]
                places = ", ".join("?" * len(part))
                query = f"{_STANDINGS} WHERE collision_sha256 IN ({places})"
                for key, *columns in self.connection.execute(query, part):
                    found[key] = Standing(*columns)
        return [found.get(key) for key in keys]

    def check_writable(self) -> None:
        """Raise now, not after hours of computing, if the store cannot be written."""
        with named_errors(self.path):
            self.connection.execute("BEGIN IMMEDIATE")
            try:
                # Only a change, not the wish for one, is refused on a read-only file.
                self.connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
            finally:
                self.connection.execute("ROLLBACK")

    def record(
        self, found: Iterable[tuple[Scene, Row]], *, arrays: bool = False, replace: bool = False
    ) -> None:
        """
        Write what came of scenes, all in one transaction or, with StoreWriteError, nothing.

        What stays is decided by :meth:`~chaincor.workflows.store.standing.Standing.yields_to`;
        `replace` lets a result take the place of one that was asked for no more exactly.
        """
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        with named_errors(self.path), transaction(self.connection):
            for scene, row in found:
                self._write(scene, row, now, arrays, replace)

    def _write(self, scene: Scene, row: Row, finished: str, arrays: bool, replace: bool) -> None:
        key, old, columns = row_key(scene), self.standing(scene), dict(row.columns)
        tries = 1 + (0 if old is None else old.tries)
        record = {"tries": tries, "finished": finished}
        if columns.get("restitution") is None:
            if old is None or not old.answers(scene):
                self._write_failure(scene, columns, record, old)
            return
        had_arrays = old is not None and old.has_arrays
        # Arrays that were kept must stay those of the row's result.
        keep_arrays = arrays or had_arrays
        new = Standing(
            restitution=columns["restitution"],
            restitution_error=columns["restitution_error"],
            tolerance=columns["tolerance"],
            failure_tolerance=None,
            failure_stands=False,
            tries=tries,
            finished=finished,
            has_arrays=keep_arrays,
        )
        if old is not None:
            if not old.yields_to(new, renew=replace or (arrays and not had_arrays)):
                if changes := old.tightened_by(new):
                    changes |= _NO_FAILURE | {"tries": tries}
                    update_row(self.connection, key, changes)
                return
            columns |= new.tightened_by(old)
        columns["environment"] = self._environment(columns.pop("versions"))
        self._upsert(columns | record | scene_columns(scene) | _NO_FAILURE)
        if keep_arrays:
            self.connection.executemany(
                "INSERT OR REPLACE INTO arrays VALUES (?, ?, ?)",
                [(key, name, array_to_bytes(array)) for name, array in row.arrays.items()],
            )

    def _write_failure(
        self, scene: Scene, columns: dict[str, Any], record: dict[str, Any], old: Standing | None
    ) -> None:
        asked = scene.asked_tolerance
        columns["failure_tolerance"] = asked
        if old is None or old.restitution is None:
            self._upsert(columns | scene_columns(scene) | record | {"tolerance": asked})
            return
        changed = {name: columns[name] for name in FAILURE_COLUMNS} | {"tries": record["tries"]}
        update_row(self.connection, row_key(scene), changed)

    def _environment(self, versions: str) -> int:
        query = "SELECT id FROM environments WHERE versions = ?"
        known = self.connection.execute(query, (versions,)).fetchone()
        if known is None:
            insert = "INSERT INTO environments (versions) VALUES (?)"
            return self.connection.execute(insert, (versions,)).lastrowid or 0
        return known[0]

    def _upsert(self, columns: dict[str, Any]) -> None:
        self.connection.execute(_upsertion(tuple(columns)), columns)

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


def update_row(connection: sqlite3.Connection, key: str, columns: dict[str, Any]) -> None:
    """Change some columns of a row."""
    assignments = ", ".join(f"{name} = :{name}" for name in columns)
    connection.execute(
        f"UPDATE main.collisions SET {assignments} WHERE collision_sha256 = :key",
        columns | {"key": key},
    )


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
