"""Writing attempts into a results store."""

import sqlite3
from functools import lru_cache
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.store.attempt import Attempt, Failure
from chaincor.workflows.store.kept import Kept
from chaincor.workflows.store.rows import array_to_bytes, row_key, scene_columns
from chaincor.workflows.store.schema import FAILURE_COLUMNS
from chaincor.workflows.store.standing import Standing

_NO_FAILURE: dict[str, Any] = dict.fromkeys(FAILURE_COLUMNS)


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

    `old` is what the store has on the scene, `finished` UTC in ISO 8601. What stays is decided by
    :meth:`~chaincor.workflows.store.standing.Standing.yields_to`; `replace` lets a result take the
    place of one that was asked for no more exactly.
    """
    scene, key = attempt.scene, row_key(attempt.scene)
    tries = 1 + (0 if old is None else old.tries)
    record = {"host": attempt.host, "finished": finished, "tries": tries}
    kept = attempt.kept
    if attempt.collision is not None:
        kept = Kept.of(attempt.collision)
    if kept is None:
        assert attempt.failure is not None
        if old is None or not old.answers(scene):
            _write_failure(connection, scene, attempt.failure, old, record)
        return
    had_arrays = old is not None and old.has_arrays
    # Arrays that were kept must stay those of the row's result.
    keep_arrays = arrays or had_arrays
    result = dict(kept.columns)
    new = Standing(
        restitution=result["restitution"],
        restitution_error=result["restitution_error"],
        tolerance=result["tolerance"],
        failure_tolerance=None,
        failure_stands=False,
        tries=tries,
        finished=finished,
        has_arrays=keep_arrays,
    )
    if old is not None:
        if not old.yields_to(new, renew=replace or (arrays and not had_arrays)):
            if changes := old.tightened_by(new):
                update_row(connection, key, changes | _NO_FAILURE | {"tries": tries})
            return
        result |= new.tightened_by(old)
    _write_result(connection, scene, result | record, kept.versions)
    if keep_arrays:
        connection.executemany(
            "INSERT OR REPLACE INTO arrays VALUES (?, ?, ?)",
            [(key, name, array_to_bytes(array)) for name, array in kept.arrays().items()],
        )


def update_row(connection: sqlite3.Connection, key: str, columns: dict[str, Any]) -> None:
    """Change some columns of a row."""
    assignments = ", ".join(f"{name} = :{name}" for name in columns)
    connection.execute(
        f"UPDATE main.collisions SET {assignments} WHERE collision_sha256 = :key",
        columns | {"key": key},
    )


def _write_failure(
    connection: sqlite3.Connection,
    scene: Scene,
    failure: Failure,
    old: Standing | None,
    record: dict[str, Any],
) -> None:
    tolerance = scene.asked_tolerance
    values = (failure.name, failure.message, tolerance, int(failure.stands))
    columns: dict[str, Any] = dict(zip(FAILURE_COLUMNS, values, strict=True))
    if old is None or old.restitution is None:
        _upsert(connection, columns | scene_columns(scene) | record | {"tolerance": tolerance})
        return
    update_row(connection, row_key(scene), columns | {"tries": record["tries"]})


def _write_result(
    connection: sqlite3.Connection, scene: Scene, columns: dict[str, Any], versions: str
) -> None:
    query = "SELECT id FROM environments WHERE versions = ?"
    known = connection.execute(query, (versions,)).fetchone()
    if known is None:
        connection.execute("INSERT INTO environments (versions) VALUES (?)", (versions,))
        known = connection.execute(query, (versions,)).fetchone()
    (environment,) = known
    columns |= scene_columns(scene) | _NO_FAILURE | {"environment": environment}
    _upsert(connection, columns)


def _upsert(connection: sqlite3.Connection, columns: dict[str, Any]) -> None:
    connection.execute(_upsertion(tuple(columns)), columns)


@lru_cache(maxsize=16)
def _upsertion(columns: tuple[str, ...]) -> str:
    names = ", ".join(f'"{name}"' for name in columns)
    values = ", ".join(f":{name}" for name in columns)
    updates = ", ".join(f'"{name}" = excluded."{name}"' for name in columns)
    return (
        f"INSERT INTO collisions ({names}) VALUES ({values}) "
        f"ON CONFLICT (collision_sha256) DO UPDATE SET {updates}"
    )
