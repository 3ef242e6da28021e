"""Query a store for tables and plots: columns, conditions and order."""

import math
import re
from collections.abc import Sequence
from typing import Any

from chaincor.lammps_inputs.given_numbers import number_in
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.checked_rows import KEY, check_rows
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.schema import (
    BODY_COLUMNS,
    FLAG_COLUMNS,
    PLAIN_COLUMNS,
    SCENE_KEYS,
    WORDS,
)

# Largest integer of SQLite.
_MOST_ROWS = 2**63 - 1
_PARAMETER = re.compile(r"parameters\.[A-Za-z]\w*")
_CONDITION = re.compile(r"\s*([\w.]+)\s*(<=|>=|!=|==?|<|>)\s*(.*?)\s*")


def query_rows(
    store: Store,
    columns: Sequence[str],
    *,
    where: Sequence[str] = (),
    order: Sequence[str] = (),
    limit: int | None = None,
) -> list[tuple[Any, ...]]:
    """
    Read some columns of some rows.

    Parameters
    ----------
    store : Store
        The store.
    columns : sequence of str
        Names from :data:`~chaincor.workflows.store.schema.PLAIN_COLUMNS`, or ``scene``, the JSON
        text of the canonical scene. ``parameters.a`` is the parameter a of a formula. ``masses.2``
        is the mass of particle 2 of the chain, counted from the contact outward.
        ``target_masses.1`` is the mass of the target's first particle.
    where : sequence of str
        Conditions that must all hold, such as ``potential=lj`` or ``speed<=0.5``. An empty value,
        as in ``failure=``, matches rows without that field. Text is compared character by
        character: ``finished>2026-11`` holds for later dates.
    order : sequence of str
        Columns to sort by. A ``-`` before a name sorts the largest first.
    limit : int, optional
        Largest number of rows to return.

    Returns
    -------
    list of tuple
        Values of the columns, one tuple for each row.

    Raises
    ------
    StoreError
        If there is no such column, a condition cannot be read, a column of numbers is compared with
        text, or a row holds a value that chaincor does not write.
    """
    conditions, values = _conditions(store, where)
    ordered = [
        _quoted(name.removeprefix("-")) + (" DESC" if name.startswith("-") else "")
        for name in order
    ]
    wanted = ", ".join([*map(_quoted, columns), KEY])
    query = f"SELECT {wanted} FROM collisions{conditions}"
    if ordered:
        query += f" ORDER BY {', '.join(ordered)}"
    if limit is not None:
        query += " LIMIT ?"
        values = [*values, min(limit, _MOST_ROWS)]
    found = store.select(query, values)[1]
    rows = [row[:-1] for row in found]
    check_rows(store.path, columns, rows, [row[-1] for row in found])
    return rows


def count_rows(store: Store, where: Sequence[str] = ()) -> int:
    """Count the rows that fulfil conditions, written as for :func:`query_rows`."""
    conditions, values = _conditions(store, where)
    return store.select(f"SELECT count(*) FROM collisions{conditions}", values)[1][0][0]


def _conditions(store: Store, where: Sequence[str]) -> tuple[str, list[Any]]:
    parts: list[str] = []
    values: list[float | str] = []
    types = dict(store.select("SELECT name, type FROM pragma_table_info('collisions')")[1])
    for text in where:
        match = _CONDITION.fullmatch(text)
        if match is None:
            raise StoreError(f"the condition '{text}' cannot be read. Write it like potential=lj")
        name, operator, value = match.groups()
        column = _quoted(name)
        if value:
            parts.append(f"{column} {operator} ?")
            kind = types.get(name, "TEXT" if name in WORDS else "REAL")
            values.append(value if kind == "TEXT" else _number(text, name, value))
        elif operator in ("=", "==", "!="):
            parts.append(f"{column} IS {'NOT ' if operator == '!=' else ''}NULL")
        else:
            raise StoreError(f"the condition '{text}' has no value. Write it like speed<0.5")
    return (" WHERE " + " AND ".join(parts) if parts else ""), values


def _number(text: str, name: str, value: str) -> float:
    """
    Return the number in a condition on a column of numbers.

    Raises StoreError for text, because SQLite sorts text above all numbers.
    """
    if name in FLAG_COLUMNS and value.lower() in ("true", "false"):
        return float(value.lower() == "true")
    number = number_in(value)
    if number is None or math.isnan(number):
        raise StoreError(
            f"the condition '{text}' compares column '{name}' with '{value}'. Give a "
            "number, as in speed<0.5"
        )
    return number


# Mass of one particle: body, and index of the particle, counted from 1.
ONE_MASS = re.compile(r"(masses|target_masses)\.([1-9]\d{0,7})")


def _quoted(name: str) -> str:
    """Return the SQL expression of a column."""
    if name in BODY_COLUMNS:
        return BODY_COLUMNS[name]
    if one := ONE_MASS.fullmatch(name):
        return _mass(one[1], int(one[2]))
    if name in SCENE_KEYS or _PARAMETER.fullmatch(name):
        return f"json_extract(scene, '$.{name}')"
    if name not in PLAIN_COLUMNS and name != "scene":
        raise StoreError(f"there is no column '{name}'. Use one of {', '.join(PLAIN_COLUMNS)}")
    return f'"{name}"'


def _mass(masses: str, particle: int) -> str:
    """
    Return the SQL expression of the mass of one particle.

    A shorter list of masses repeats. A chain without masses has masses of 1.
    """
    place = f"'$.{masses}[' || ({particle - 1} % json_array_length(scene, '$.{masses}')) || ']'"
    body, absent = ("particles", "1.0") if masses == "masses" else ("target_particles", "NULL")
    return (
        f"CASE WHEN {particle} > json_extract(scene, '$.{body}') THEN NULL "
        f"WHEN json_type(scene, '$.{masses}') IS NULL THEN {absent} "
        f"WHEN json_type(scene, '$.{masses}') = 'array' THEN json_extract(scene, {place}) END"
    )
