"""A results store: one SQLite file, one row a collision."""

import datetime
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from lammps_inputs.errors import SceneError
from lammps_inputs.potentials import Potential
from lammps_inputs.scene import Scene
from workflows.attempt import Attempt, Failure
from workflows.result import Collision
from workflows.store_connection import connect, named_errors, transaction
from workflows.store_schema import SCHEMA_VERSION
from workflows.stored_collision import (
    Standing,
    StoredCollision,
    array_from_bytes,
    array_to_bytes,
    asked_tolerance,
    result_columns,
    result_from_columns,
    scene_columns,
)

_HAS_ARRAYS = (
    "EXISTS (SELECT 1 FROM arrays WHERE arrays.collision_sha256 = collisions.collision_sha256)"
)
_STANDING = f"""
    SELECT restitution, restitution_error, tolerance, failure_tolerance,
           coalesce(failure_stands, 0), tries, {_HAS_ARRAYS}
    FROM collisions WHERE collision_sha256 = ?
"""
_ROW = f"""
    SELECT collisions.*, environments.versions, {_HAS_ARRAYS} AS has_arrays
    FROM collisions LEFT JOIN environments ON environment = environments.id
    WHERE collision_sha256 = ?
"""


class Store:
    """
    A results store in one SQLite file.

    A row is a collision whatever the tolerance: a result that was asked for more exactly takes the
    place of an older one, never the other way round. Every write is a transaction of its own, so
    that a killed program leaves whole rows only.

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
        Return the result of a scene, if it is there and exact enough.

        Parameters
        ----------
        scene : Scene
            The collision.
        arrays : bool
            Whether the arrays are wanted as well.

        Returns
        -------
        StoredCollision or None
            None where it would have to be computed.
        """
        standing = self.standing(scene)
        if standing is None or not standing.answers(scene):
            return None
        if arrays and not standing.has_arrays:
            return None
        return self.find(scene, arrays=arrays)

    def find(self, scene: Scene, *, arrays: bool = False) -> StoredCollision | None:
        """
        Return the row of a scene, however exact, and even if it failed.

        Parameters
        ----------
        scene : Scene
            The collision.
        arrays : bool
            Whether to read its arrays.

        Returns
        -------
        StoredCollision or None
            None where there is no row.
        """
        key = _key(scene)
        with named_errors(self.path):
            cursor = self.connection.execute(_ROW, (key,))
            row = cursor.fetchone()
            if row is None:
                return None
            names = [column[0] for column in cursor.description]
            kept = self._arrays(key) if arrays else {}
        return _stored(dict(zip(names, row, strict=True)), kept)

    def _arrays(self, key: str) -> dict[str, NDArray[np.float64]]:
        query = "SELECT name, npy FROM arrays WHERE collision_sha256 = ?"
        rows = self.connection.execute(query, (key,))
        return {name: array_from_bytes(content) for name, content in rows}

    def standing(self, scene: Scene) -> Standing | None:
        """
        Return what decides whether a scene has to be run.

        Parameters
        ----------
        scene : Scene
            The collision.

        Returns
        -------
        Standing or None
            None where there is no row.
        """
        with named_errors(self.path):
            return self._standing(_key(scene))

    def _standing(self, key: str) -> Standing | None:
        row = self.connection.execute(_STANDING, (key,)).fetchone()
        return None if row is None else Standing(*row)

    def check_writable(self) -> None:
        """
        Raise now, not after hours of computing, if the store cannot be written.

        Raises
        ------
        StoreError
            If it is read-only.
        """
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
        Write attempts, all in one transaction.

        Parameters
        ----------
        attempts : iterable of Attempt
            Results and failures. A failure never takes the place of a result.
        arrays : bool
            Whether to keep the arrays of the results.
        replace : bool
            Whether a result takes the place of one that is as exact.

        Raises
        ------
        StoreWriteError
            If it cannot be written; then nothing was.
        """
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        with named_errors(self.path), transaction(self.connection):
            for attempt in attempts:
                self._record(attempt, arrays, replace, now)

    def _record(self, attempt: Attempt, arrays: bool, replace: bool, now: str) -> None:
        scene = attempt.scene
        old = self._standing(_key(scene))
        record = {"host": attempt.host, "finished": now, "tries": 1 + (old.tries if old else 0)}
        answered = old is not None and old.answers(scene)
        if attempt.collision is None:
            assert attempt.failure is not None
            if not answered:
                self._write_failure(scene, attempt.failure, old, record)
            return
        if answered and not replace:
            assert old is not None
            asked = asked_tolerance(scene)
            sharper = asked is not None and old.tolerance is not None and old.tolerance < asked
            if old.has_arrays or not arrays or sharper:
                return
        self._write_result(scene, attempt.collision, record)
        # Arrays that were kept must stay those of the row's result.
        if arrays or (old is not None and old.has_arrays):
            self._write_arrays(_key(scene), attempt.collision)

    def _write_failure(
        self, scene: Scene, failure: Failure, old: Standing | None, record: dict[str, Any]
    ) -> None:
        columns: dict[str, Any] = {
            "failure": failure.name,
            "failure_message": failure.message,
            "failure_tolerance": asked_tolerance(scene),
            "failure_stands": int(failure.stands),
        }
        if old is None or old.restitution is None:
            columns |= scene_columns(scene) | record | {"tolerance": asked_tolerance(scene)}
            self._upsert(columns)
        else:
            columns |= {"tries": record["tries"], "collision_sha256": _key(scene)}
            assignments = ", ".join(f"{name} = :{name}" for name in columns)
            self.connection.execute(
                f"UPDATE collisions SET {assignments} WHERE collision_sha256 = :collision_sha256",
                columns,
            )

    def _write_result(self, scene: Scene, collision: Collision, record: dict[str, Any]) -> None:
        result, versions = result_columns(collision)
        failures = ("failure", "failure_message", "failure_tolerance", "failure_stands")
        columns = result | scene_columns(scene) | record | dict.fromkeys(failures)
        self._upsert(columns | {"environment": self._environment(versions)})

    def _write_arrays(self, key: str, collision: Collision) -> None:
        self.connection.executemany(
            "INSERT OR REPLACE INTO arrays VALUES (?, ?, ?)",
            [(key, name, array_to_bytes(a)) for name, a in collision.arrays().items()],
        )

    def _environment(self, versions: str) -> int:
        self.connection.execute(
            "INSERT OR IGNORE INTO environments (versions) VALUES (?)", (versions,)
        )
        query = "SELECT id FROM environments WHERE versions = ?"
        return self.connection.execute(query, (versions,)).fetchone()[0]

    def _upsert(self, columns: dict[str, Any]) -> None:
        names = ", ".join(f'"{name}"' for name in columns)
        values = ", ".join(f":{name}" for name in columns)
        updates = ", ".join(f'"{name}" = excluded."{name}"' for name in columns)
        self.connection.execute(
            f"INSERT INTO collisions ({names}) VALUES ({values}) "
            f"ON CONFLICT (collision_sha256) DO UPDATE SET {updates}",
            columns,
        )

    def select(
        self, query: str, parameters: Sequence[Any] | dict[str, Any] = ()
    ) -> tuple[list[str], list[tuple[Any, ...]]]:
        """
        Ask the tables directly; see docs/sweeps.md for the schema.

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


def _key(scene: Scene) -> str:
    if isinstance(scene.potential, Potential):
        raise SceneError(
            f"potential '{scene.label}' is a Python object, which a store cannot tell from another "
            "of the same name; expected a named potential or 'table' with a bond_file"
        )
    return scene.collision_sha256


def _stored(columns: dict[str, Any], arrays: dict[str, NDArray[np.float64]]) -> StoredCollision:
    failure = None
    if columns["failure"] is not None:
        failure = Failure(
            columns["failure"], columns["failure_message"], bool(columns["failure_stands"])
        )
    return StoredCollision(
        collision_sha256=columns["collision_sha256"],
        scene=json.loads(columns["scene"]),
        result=result_from_columns(columns),
        failure=failure,
        failure_tolerance=columns["failure_tolerance"],
        tries=columns["tries"],
        host=columns["host"],
        finished=columns["finished"],
        has_arrays=bool(columns["has_arrays"]),
        arrays=arrays,
    )
