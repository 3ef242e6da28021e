"""Writing attempts into a results store: which result stays, and which columns it fills."""

import sqlite3
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.tolerance import asked_tolerance
from chaincor.workflows.result import Collision
from chaincor.workflows.store.attempt import Attempt, Failure
from chaincor.workflows.store.rows import array_to_bytes, result_columns, row_key, scene_columns
from chaincor.workflows.store.schema import FAILURE_COLUMNS
from chaincor.workflows.store.stored_collision import Standing


def write_attempt(
    connection: sqlite3.Connection,
    attempt: Attempt,
    old: Standing | None,
    finished: str,
    *,
    arrays: bool,
    replace: bool,
) -> None:
    """
    Write one attempt, inside a transaction.

    `old` is what the store has on the scene, `finished` UTC in ISO 8601. A failure never takes the
    place of a result; `replace` lets a result take that of one that is as exact.
    """
    scene = attempt.scene
    tries = 1 + (0 if old is None else old.tries)
    record = {"host": attempt.host, "finished": finished, "tries": tries}
    if attempt.collision is None:
        assert attempt.failure is not None
        if old is None or not old.answers(scene):
            _write_failure(connection, scene, attempt.failure, old, record)
        return
    if old is not None and not replace and old.answers(scene):
        asked = asked_tolerance(scene)
        sharper = asked is not None and old.tolerance is not None and old.tolerance < asked
        if sharper or old.answers(scene, arrays=arrays):
            return
    _write_result(connection, scene, attempt.collision, record)
    # Arrays that were kept must stay those of the row's result.
    if arrays or (old is not None and old.has_arrays):
        connection.executemany(
            "INSERT OR REPLACE INTO arrays VALUES (?, ?, ?)",
            [
                (row_key(scene), name, array_to_bytes(array))
                for name, array in attempt.collision.arrays().items()
            ],
        )


def _write_failure(
    connection: sqlite3.Connection,
    scene: Scene,
    failure: Failure,
    old: Standing | None,
    record: dict[str, Any],
) -> None:
    tolerance = asked_tolerance(scene)
    values = (failure.name, failure.message, tolerance, int(failure.stands))
    columns: dict[str, Any] = dict(zip(FAILURE_COLUMNS, values, strict=True))
    if old is None or old.restitution is None:
        _upsert(connection, columns | scene_columns(scene) | record | {"tolerance": tolerance})
        return
    columns["tries"] = record["tries"]
    assignments = ", ".join(f"{name} = :{name}" for name in columns)
    connection.execute(
        f"UPDATE collisions SET {assignments} WHERE collision_sha256 = :key",
        columns | {"key": row_key(scene)},
    )


def _write_result(
    connection: sqlite3.Connection, scene: Scene, collision: Collision, record: dict[str, Any]
) -> None:
    result, versions = result_columns(collision)
    connection.execute("INSERT OR IGNORE INTO environments (versions) VALUES (?)", (versions,))
    query = "SELECT id FROM environments WHERE versions = ?"
    (environment,) = connection.execute(query, (versions,)).fetchone()
    no_failure = dict.fromkeys(FAILURE_COLUMNS)
    columns = result | scene_columns(scene) | record | no_failure | {"environment": environment}
    _upsert(connection, columns)


def _upsert(connection: sqlite3.Connection, columns: dict[str, Any]) -> None:
    names = ", ".join(f'"{name}"' for name in columns)
    values = ", ".join(f":{name}" for name in columns)
    updates = ", ".join(f'"{name}" = excluded."{name}"' for name in columns)
    connection.execute(
        f"INSERT INTO collisions ({names}) VALUES ({values}) "
        f"ON CONFLICT (collision_sha256) DO UPDATE SET {updates}",
        columns,
    )
