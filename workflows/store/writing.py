"""Write rows into a store: new rows in one statement, other rows one by one."""

import time
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from chaincor.workflows.store.checked_rows import KEY
from chaincor.workflows.store.connection import named_errors, transaction
from chaincor.workflows.store.row import Row, array_to_bytes
from chaincor.workflows.store.schema import FAILURE_COLUMNS, HELD
from chaincor.workflows.store.short_scene import json_object, short_scene, whole_scene

if TYPE_CHECKING:
    from chaincor.workflows.store.results_store import Store

_INSERT_ARRAY = "INSERT INTO arrays VALUES (?, ?, ?)"
_NO_FAILURE: dict[str, Any] = dict.fromkeys(FAILURE_COLUMNS)


def write_rows(store: "Store", rows: Sequence[Row], *, arrays: bool, replace: bool) -> None:
    """Write rows in one transaction, see :meth:`Store.write`."""
    now = time.time_ns() // 1_000_000
    with named_errors(store.path), transaction(store.connection):
        olds = store.standings_of([row.columns[KEY] for row in rows])
        seen: set[str] = set()
        new: dict[tuple[str, ...], list[tuple[Any, ...]]] = {}
        later: list[tuple[Row, Row | None]] = []
        kept: list[tuple[bytes, str, bytes]] = []
        environments: dict[str, int] = {}
        for row, old in zip(rows, olds, strict=True):
            key = row.columns[KEY]
            if old is not None or key in seen or not row.has_result:
                later.append((row, old))
                continue
            seen.add(key)
            columns = {**row.columns, KEY: bytes.fromhex(key), "tries": 1, "finished": now}
            versions = columns.pop("versions")
            if versions not in environments:
                environments[versions] = _environment(store, versions)
            columns["environment"] = environments[versions]
            new.setdefault(tuple(columns), []).append(tuple(columns.values()))
            kept += _npy(columns[KEY], row) if arrays else ()
        # New rows, the majority in a sweep, are written in one statement.
        for names, values in new.items():
            places = f"VALUES ({', '.join('?' * len(names))})"
            store.connection.executemany(upsertion(names, places), values)
        store.connection.executemany(_INSERT_ARRAY, kept)
        for row, old in later:
            if row.columns[KEY] in seen:
                (old,) = store.standings_of([row.columns[KEY]])
            seen.add(row.columns[KEY])
            _write(store, row, old, now, arrays, replace)


def _write(
    store: "Store", row: Row, old: Row | None, finished: int, arrays: bool, replace: bool
) -> None:
    key = row.columns[KEY]
    tries = 1 + (0 if old is None else old.columns["tries"])
    stored_key = bytes.fromhex(key)
    columns = {**row.columns, KEY: stored_key, "tries": tries, "finished": finished}
    if not row.has_result:
        asked = columns["failure_tolerance"]
        if old is None or not old.has_result:
            _upsert(store, columns)
        elif not (asked is None or old.reaches(asked)):
            kept = (*FAILURE_COLUMNS, "tries")
            update_row(store, key, {name: columns[name] for name in kept})
        return
    had_arrays = old is not None and old.columns["has_arrays"]
    # If the old row had arrays, the new arrays are written, because stored arrays must belong to
    # the stored result. Workers send arrays only on request.
    keep_arrays = bool(row.arrays) and (arrays or had_arrays)
    columns |= _NO_FAILURE
    if old is not None:
        new = Row(columns | {"has_arrays": keep_arrays})
        if not old.yields_to(new, renew=replace or (arrays and not had_arrays)):
            if tightened := old.tightened_by(new):
                update_row(store, key, tightened | _NO_FAILURE | {"tries": tries})
            return
        if tightened := new.tightened_by(old):
            columns |= tightened
            columns["scene"] = short_scene(new.scene, columns)
        store.connection.execute("DELETE FROM arrays WHERE collision_sha256 = ?", (stored_key,))
    columns["environment"] = _environment(store, columns.pop("versions"))
    _upsert(store, columns)
    if keep_arrays:
        store.connection.executemany(_INSERT_ARRAY, _npy(stored_key, row))


def _environment(store: "Store", versions: str) -> int:
    query = "SELECT id FROM environments WHERE versions = ?"
    known = store.connection.execute(query, (versions,)).fetchone()
    if known is None:
        insert = "INSERT INTO environments (versions) VALUES (?)"
        return store.connection.execute(insert, (versions,)).lastrowid or 0
    return known[0]


def _upsert(store: "Store", columns: dict[str, Any]) -> None:
    store.connection.execute(upsertion(tuple(columns)), columns)


def update_row(store: "Store", key: str, columns: dict[str, Any]) -> None:
    """Change some columns of a row, but not the tolerance in its scene."""
    stored_key = bytes.fromhex(key)
    if "tolerance" in columns:
        query = f"SELECT scene, {', '.join(HELD)} FROM collisions WHERE collision_sha256 = ?"
        scene, *held = store.connection.execute(query, (stored_key,)).fetchone()
        known = dict(zip(HELD, held, strict=True))
        if (rest := json_object(scene)) is not None:
            whole = whole_scene(rest, known)
            columns = columns | {"scene": short_scene(whole, known | columns)}
    assignments = ", ".join(f"{name} = :{name}" for name in columns)
    query = f"UPDATE collisions SET {assignments} WHERE collision_sha256 = :key"
    store.connection.execute(query, columns | {"key": stored_key})


def _npy(key: bytes, row: Row) -> list[tuple[bytes, str, bytes]]:
    return [(key, name, array_to_bytes(array)) for name, array in row.arrays.items()]


@lru_cache(maxsize=16)
def upsertion(columns: tuple[str, ...], rows: str = "") -> str:
    """Return the SQL statement that inserts rows, or replaces rows with equal keys."""
    names = ", ".join(f'"{name}"' for name in columns)
    values = ", ".join(f":{name}" for name in columns)
    updates = ", ".join(f'"{name}" = excluded."{name}"' for name in columns)
    return (
        f"INSERT INTO collisions ({names}) {rows or f'VALUES ({values})'} "
        f"ON CONFLICT (collision_sha256) DO UPDATE SET {updates}"
    )
