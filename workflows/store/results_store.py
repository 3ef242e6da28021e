"""A results store: one SQLite file, one row a collision."""

import datetime
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.attempt import Attempt
from chaincor.workflows.store.connection import connect, named_errors, transaction
from chaincor.workflows.store.record import write_attempt
from chaincor.workflows.store.rows import array_from_bytes, row_key, stored_collision
from chaincor.workflows.store.schema import SCHEMA_VERSION
from chaincor.workflows.store.standing import Standing, standing_columns
from chaincor.workflows.store.stored_collision import StoredCollision

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

    def get(self, scene: Scene, *, arrays: bool = False) -> StoredCollision | None:
        """
        Return the result of a scene; None where it would have to be computed.

        That is where it is not there, not exact enough, or lacks the arrays that are wanted.
        """
        return self.find(scene, arrays=arrays) if self.has(scene, arrays=arrays) else None

    def has(self, scene: Scene, *, arrays: bool = False) -> bool:
        """Say whether :meth:`get` would return a result."""
        standing = self.standing(scene)
        return standing is not None and standing.answers(scene, arrays=arrays)

    def find(self, scene: Scene, *, arrays: bool = False) -> StoredCollision | None:
        """Return the row of a scene, however exact, even if it failed; None where there is none."""
        key = row_key(scene)
        with named_errors(self.path):
            cursor = self.connection.execute(_ROW, (key,))
            row = cursor.fetchone()
            if row is None:
                return None
            names = [column[0] for column in cursor.description]
            kept = self._arrays(key) if arrays else {}
        try:
            return stored_collision(dict(zip(names, row, strict=True)), kept)
        except (TypeError, ValueError) as error:
            raise StoreError(
                f"the row collision_sha256={key} of {self.path} is damaged ({error}); expected "
                "what `chaincor sweep` wrote: run the sweep into a new store"
            ) from None

    def _arrays(self, key: str) -> dict[str, NDArray[np.float64]]:
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
        self, attempts: Iterable[Attempt], *, arrays: bool = False, replace: bool = False
    ) -> None:
        """
        Write attempts, all in one transaction or, with StoreWriteError, none.

        What stays is decided by :meth:`~chaincor.workflows.store.standing.Standing.yields_to`;
        `replace` lets a result take the place of one that was asked for no more exactly.
        """
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        with named_errors(self.path), transaction(self.connection):
            for attempt in attempts:
                old = self.standing(attempt.scene)
                write_attempt(self.connection, attempt, old, now, arrays=arrays, replace=replace)

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
