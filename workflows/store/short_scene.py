"""Store a scene without the fields that columns of its row contain, and restore it."""

import json
import sqlite3
from collections.abc import Mapping
from typing import Any

from chaincor.lammps_inputs.scene_parts.identity import canonical_json, hash_of
from chaincor.workflows.store.schema import HELD


def short_scene(fields: Mapping[str, Any], columns: Mapping[str, Any]) -> str:
    """
    Return the JSON text of the fields of a scene that no column contains.

    `fields` are the canonical fields of the scene, and `columns` are the columns of its row. A
    column can differ from the field, because a row may get a tighter tolerance than that of its
    run. Such a field is in the text, and so is a null for a field that the scene lacks.
    """
    rest = {**fields}
    for name in HELD:
        value, column = fields.get(name), columns[name]
        if type(value) is type(column) and value == column:
            rest.pop(name, None)
        elif value is None:
            rest[name] = None
    return canonical_json(rest) if rest else "{}"


def whole_scene(rest: Mapping[str, Any], columns: Mapping[str, Any]) -> dict[str, Any]:
    """Return the canonical fields of a scene from those of its short text and its columns."""
    fields = {**rest, **{name: rest.get(name, columns[name]) for name in HELD}}
    return {name: value for name, value in fields.items() if value is not None or name not in HELD}


def define_functions(connection: sqlite3.Connection) -> None:
    """Define the SQL functions that the schema uses; damaged values give null."""
    number = 1 + len(HELD)
    for name, arguments, function in (
        ("bytes_of_hex", 1, _bytes_of_hex),
        ("short_scene", number, _short_text),
        ("whole_scene", number, _whole_text),
        ("scene_sha256", number, _sha256),
    ):
        connection.create_function(name, arguments, function, deterministic=True)


def _bytes_of_hex(text: Any) -> bytes | None:
    try:
        return bytes.fromhex(text)
    except (TypeError, ValueError):
        return None


def _short_text(text: Any, *held: Any) -> str | None:
    fields = json_object(text)
    if fields is None:
        return text
    try:
        return short_scene(fields, dict(zip(HELD, held, strict=True)))
    except (TypeError, ValueError, RecursionError):
        return text


def _whole_text(text: Any, *held: Any) -> str | None:
    rest = json_object(text)
    if rest is None:
        return text
    try:
        return canonical_json(whole_scene(rest, dict(zip(HELD, held, strict=True))))
    except (TypeError, ValueError, RecursionError):
        return None


def _sha256(text: Any, *held: Any) -> str | None:
    whole = _whole_text(text, *held)
    return hash_of(whole) if isinstance(whole, str) else None


def json_object(text: Any) -> dict[str, Any] | None:
    """Return a JSON object; None for any other value."""
    try:
        read = json.loads(text)
    except (TypeError, ValueError, RecursionError):
        return None
    return read if isinstance(read, dict) else None
