"""Rows of a store that cannot be read as what was written: found, named, and left out."""

import sqlite3
from typing import TYPE_CHECKING

from chaincor.workflows.store.schema import (
    FAILURE_COLUMNS,
    RECORD_COLUMNS,
    RESULT_COLUMNS,
    SCENE_COLUMNS,
)

if TYPE_CHECKING:
    from chaincor.workflows.store.results_store import Store

_JSON = ("scene", "details")
_WORDS = (
    *("collision_sha256", "scene_sha256", "potential", "engine", "ending", "reason", "wall"),
    *("scheme", "table", "failure", "failure_message", "host", "finished"),
)
_NUMBERS = tuple(
    name
    for name in (*SCENE_COLUMNS, *RESULT_COLUMNS, *FAILURE_COLUMNS, *RECORD_COLUMNS)
    if name not in _WORDS
)
# More than these are counted, not named.
_MOST_NAMED = 3


def damaged_column(database: str = "main") -> str:
    """Return the SQL expression of the first damaged column of a row; null if there is none."""
    row = f"{database}.collisions"
    wrong = {f"typeof({row}.{name}) NOT IN ('null', 'text')": name for name in _JSON}
    wrong |= {f"{row}.{name} IS NOT NULL AND NOT json_valid({row}.{name})": name for name in _JSON}
    wrong |= {f"json_type({row}.{name}) <> 'object'": name for name in _JSON}
    wrong[f"json_type({row}.scene, '$.parameters') <> 'object'"] = "scene"
    wrong[f"{row}.restitution IS NOT NULL AND {row}.details IS NULL"] = "details"
    wrong |= {f"""typeof({row}."{name}") IN ('text', 'blob')""": name for name in _NUMBERS}
    wrong |= {f"""typeof({row}."{name}") = 'blob'""": name for name in _WORDS}
    text = " || ' ' || ".join(f"""coalesce({row}."{name}", '')""" for name in (*_JSON, *_WORDS))
    wrong[f"NOT is_utf8(CAST({text} AS BLOB))"] = "text"
    wrong[
        f"{row}.environment IS NOT NULL AND NOT EXISTS (SELECT 1 FROM {database}.environments AS e "
        f"WHERE e.id = {row}.environment AND json_valid(e.versions))"
    ] = "environment"
    cases = " ".join(f"WHEN {condition} THEN '{name}'" for condition, name in wrong.items())
    return f"CASE {cases} END"


def add_functions(connection: sqlite3.Connection) -> None:
    """Let a connection decide what :func:`damaged_column` asks."""
    connection.create_function("is_utf8", 1, _is_utf8, deterministic=True)


def _is_utf8(content: bytes) -> bool:
    try:
        content.decode()
    except UnicodeDecodeError:
        return False
    return True


def tell_damage(store: "Store") -> str | None:
    """Return one line that names the damaged rows of a store; None if there are none."""
    damaged = store.select(
        f"SELECT CAST(collision_sha256 AS BLOB), {damaged_column()} AS bad FROM collisions "
        "WHERE bad IS NOT NULL ORDER BY rowid"
    )[1]
    if not damaged:
        return None
    named = [
        f"collision_sha256={key.decode(errors='replace')} ({column})"
        for key, column in damaged[:_MOST_NAMED]
    ]
    more = len(damaged) - len(named)
    rows = f"{len(damaged)} damaged row{'s' if len(damaged) > 1 else ''}"
    return (
        f"{store.path} has {rows}, left out: {', '.join(named)}"
        f"{f' and {more} more' if more else ''}; run the sweep into this store once more, which "
        "computes them anew"
    )
