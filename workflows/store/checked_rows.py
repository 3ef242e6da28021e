"""Check values that are read from a store: types, ranges and JSON."""

import json
import math
import re
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.schema import (
    CREATION,
    EXPRESSIONS,
    FLAG_COLUMNS,
    WORDS,
)

KEY = "collision_sha256"
# A row with a larger number is damaged. Such numbers would overflow the axes of figures.
_LARGEST = 1e306
_LARGEST_WHOLE = 2**53
# The JSON of a scene or result is always far shorter than this number of characters.
_LONGEST_JSON = 10_000_000
_DECLARATION = re.compile(r'^ +"?(\w+)"? (TEXT|INTEGER|REAL)( NOT NULL)?', re.MULTILINE)
# Type of each column of a Row, and whether the column must have a value.
DECLARED = {
    name: (kind, bool(not_null)) for name, kind, not_null in _DECLARATION.findall(CREATION[1])
} | dict.fromkeys(EXPRESSIONS, ("TEXT", True))


def check_rows(
    path: Path, names: Sequence[str], rows: Sequence[Sequence[Any]], keys: Sequence[Any]
) -> None:
    """
    Check the values of some columns of a store.

    `names` names columns, including ``scene``, ``versions`` and ``has_arrays``, or values that a
    query extracts from the scene. `keys` identify the rows. Raise StoreError, which names row and
    column, for a value that chaincor cannot have written.
    """
    for k, name in enumerate(names):
        check = _check_of(name)
        for row, key in zip(rows, keys, strict=True):
            if (wrong := check(row[k])) is not None:
                raise StoreError(
                    f"row {KEY}={str(key)[:64]!a} of {path} has {wrong} in column '{name}'. Delete "
                    "this row, or run the sweep into a new store"
                )


@cache
def _check_of(name: str) -> Callable[[Any], str | None]:
    """
    Return a function that describes a wrong value in a column.

    For a valid value, the function returns None.
    """
    if name == "scene":
        return lambda value: _wrong_json(value, _is_scene)
    if name == "versions":
        return lambda value: None if value is None else _wrong_json(value, _is_versions)
    if name == "details":
        return lambda value: None if value is None else _wrong_json(value, lambda _: True)
    if name in FLAG_COLUMNS or name == "has_arrays":
        return lambda value: None if value in (None, 0, 1) else _shown(value)
    kind, not_null = DECLARED.get(name, ("", False))
    if name in WORDS:
        kind = "TEXT"
    right = {"TEXT": _is_text, "INTEGER": _is_whole, "REAL": _is_number}.get(kind, _is_plain)

    def check(value: Any) -> str | None:
        if value is None:
            return "nothing" if not_null else None
        return None if right(value) else _shown(value)

    return check


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and math.isfinite(value) and abs(value) < _LARGEST


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and abs(value) <= _LARGEST_WHOLE


def _is_plain(value: Any) -> bool:
    return _is_text(value) or _is_number(value)


def _shown(value: Any) -> str:
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    return ascii(value)[:40]


def _wrong_json(value: Any, is_right: Callable[[dict[str, Any]], bool]) -> str | None:
    """Describe a value that is not the expected JSON object; return None if it is."""
    if not isinstance(value, str):
        return _shown(value)
    try:
        read = json.loads(value) if len(value) <= _LONGEST_JSON else None
    except (ValueError, RecursionError):
        read = None
    return None if isinstance(read, dict) and is_right(read) else "text that is no such object"


def _is_versions(read: dict[str, Any]) -> bool:
    return all(isinstance(each, str) for each in read.values())


def _is_scene(read: dict[str, Any]) -> bool:
    """Return whether an object has only values of types that occur in scenes."""
    return _is_number(read.get("velocity", 0.0)) and all(map(_is_scene_value, read.values()))


def _is_scene_value(value: Any) -> bool:
    if isinstance(value, dict):
        return all(map(_is_number, value.values()))
    if isinstance(value, list):
        return all(map(_is_number, value))
    return value is None or _is_plain(value)
