"""Query a store: select columns and rows, and sort them."""

import heapq
import itertools
import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

from chaincor.lammps_inputs.given_numbers import number_in
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.checked_rows import DECLARED, KEY, check_rows
from chaincor.workflows.store.connection import named_errors
from chaincor.workflows.store.results_store import Part, Store
from chaincor.workflows.store.schema import (
    BODY_COLUMNS,
    EXPRESSIONS,
    FLAG_COLUMNS,
    PLAIN_COLUMNS,
    SCENE_KEYS,
    WORDS,
)
from chaincor.workflows.store.store_set import StoreSet

# Largest integer in SQLite.
_MOST_ROWS = 2**63 - 1
# Number of rows that are read and checked at a time.
_CHECKED = 1000
_PARAMETER = re.compile(r"parameters\.[A-Za-z]\w*")
_CONDITION = re.compile(r"\s*([\w.]+)\s*(<=|>=|!=|==?|<|>)\s*(.*?)\s*")


def query_rows(
    store: Store | StoreSet,
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
    store : Store or StoreSet
        The store, or several stores that are read as one.
    columns : sequence of str
        Names from :data:`~chaincor.workflows.store.schema.PLAIN_COLUMNS`, or ``scene`` for the JSON
        text of the canonical scene. ``parameters.a`` is the parameter a of a formula. ``masses.2``
        is the mass of the chain's particle 2, where particle 1 makes the contact.
        ``target_masses.1`` is the mass of the target's first particle.
    where : sequence of str
        Conditions on the rows, such as ``potential=lj`` or ``speed<=0.5``. All of them must be
        fulfilled. An empty value, as in ``failure=``, matches rows without a value in this column.
        Text is compared character by character, so ``finished>2026-11`` matches later dates.
    order : sequence of str
        Columns by which the rows are sorted. With ``-`` before a name, the largest value comes
        first.
    limit : int, optional
        Largest number of rows to return.

    Returns
    -------
    list of tuple
        One tuple for each row, with the values in the columns.

    Raises
    ------
    StoreError
        If a column does not exist, if a condition cannot be read, if a column of numbers is
        compared with text, or if a row has a value that chaincor never writes.
    """
    return [*iterate_rows(store, columns, where=where, order=order, limit=limit)]


def iterate_rows(
    store: Store | StoreSet,
    columns: Sequence[str],
    *,
    where: Sequence[str] = (),
    order: Sequence[str] = (),
    limit: int | None = None,
) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of :func:`query_rows` without keeping them in memory."""
    parts = store.parts()
    streams = [_rows_of(part, columns, where, order, limit) for part in parts]
    if len(parts) == 1:
        yield from (row for row, _ in streams[0])
        return
    descending = [name.startswith("-") for name in order]
    joined = heapq.merge(*streams, key=lambda pair: _rank(pair[1], descending))
    yield from (row for row, _ in itertools.islice(joined, limit))


def _rows_of(
    part: Part,
    columns: Sequence[str],
    where: Sequence[str],
    order: Sequence[str],
    limit: int | None,
) -> Iterator[tuple[tuple[Any, ...], tuple[Any, ...]]]:
    """Yield the rows of one store, each with its sort key."""
    store = part.store
    conditions, values = _conditions(part, where)
    sorting = [_quoted(name.removeprefix("-")) for name in order]
    wanted = ", ".join([*map(_quoted, columns), *sorting, _quoted(KEY)])
    query = f"SELECT {wanted} FROM collisions{conditions}"
    if order:
        ways = (" DESC" if name.startswith("-") else "" for name in order)
        query += f" ORDER BY {', '.join(map(''.join, zip(sorting, ways, strict=True)))}"
    if limit is not None:
        query += " LIMIT ?"
        values = [*values, min(limit, _MOST_ROWS)]
    with named_errors(store.path):
        cursor = store.connection.execute(query, values)
        while found := cursor.fetchmany(_CHECKED):
            rows = [row[: len(columns)] for row in found]
            check_rows(store.path, columns, rows, [row[-1] for row in found])
            for row, whole in zip(rows, found, strict=True):
                yield row, whole[len(columns) : -1]


class _Descending:
    """Sort key of a value in a column that is sorted in descending order."""

    def __init__(self, rank: tuple[int, Any]) -> None:
        self.rank = rank

    def __lt__(self, other: "_Descending") -> bool:
        return other.rank < self.rank

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Descending) and self.rank == other.rank

    __hash__ = None  # type: ignore[assignment]


def _rank(values: Sequence[Any], descending: Sequence[bool]) -> list[Any]:
    """Return a sort key for SQLite's order: null, numbers, text, bytes."""
    ranks = []
    for value, reverse in zip(values, descending, strict=True):
        kind = 0 if value is None else 1 if isinstance(value, int | float) else 2
        rank = (kind + isinstance(value, bytes), 0 if value is None else value)
        ranks.append(_Descending(rank) if reverse else rank)
    return ranks


def count_rows(store: Store | StoreSet, where: Sequence[str] = ()) -> int:
    """Count the rows that fulfil conditions, which are written as for :func:`query_rows`."""
    count = 0
    for part in store.parts():
        conditions, values = _conditions(part, where)
        query = f"SELECT count(*) FROM collisions{conditions}"
        count += part.store.select(query, values)[1][0][0]
    return count


def _conditions(part: Part, where: Sequence[str]) -> tuple[str, list[Any]]:
    parts: list[str] = [part.condition] if part.condition else []
    values: list[float | str] = []
    for text in where:
        match = _CONDITION.fullmatch(text)
        if match is None:
            raise StoreError(f"the condition '{text}' cannot be read. Write it like potential=lj")
        name, operator, value = match.groups()
        column = _quoted(name)
        if value:
            parts.append(f"{column} {operator} ?")
            is_text = name in WORDS or DECLARED.get(name, ("REAL",))[0] == "TEXT"
            values.append(value if is_text else _number(text, name, value))
        elif operator in ("=", "==", "!="):
            parts.append(f"{column} IS {'NOT ' if operator == '!=' else ''}NULL")
        else:
            raise StoreError(f"the condition '{text}' has no value. Write it like speed<0.5")
    return (" WHERE " + " AND ".join(parts) if parts else ""), values


def _number(text: str, name: str, value: str) -> float:
    """
    Return the number with which a condition compares a column.

    Raise StoreError for text, because SQLite regards text as larger than all numbers.
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


# Column with the mass of one particle: the body, and the particle's index, counted from 1.
ONE_MASS = re.compile(r"(masses|target_masses)\.([1-9]\d{0,7})")


def _quoted(name: str) -> str:
    """Return the SQL expression of a column."""
    for expressions in (EXPRESSIONS, BODY_COLUMNS):
        if name in expressions:
            return expressions[name]
    if one := ONE_MASS.fullmatch(name):
        return _mass(one[1], int(one[2]))
    if name in SCENE_KEYS or _PARAMETER.fullmatch(name):
        return f"json_extract(scene, '$.{name}')"
    if name not in PLAIN_COLUMNS:
        raise StoreError(f"there is no column '{name}'. Use one of {', '.join(PLAIN_COLUMNS)}")
    return f'"{name}"'


def _mass(masses: str, particle: int) -> str:
    """
    Return the SQL expression of the mass of one particle.

    If the list of masses is shorter than the chain, it repeats. If there is no list, all masses are
    1.
    """
    place = f"'$.{masses}[' || ({particle - 1} % json_array_length(scene, '$.{masses}')) || ']'"
    body, absent = "particles", "1.0"
    if masses == "target_masses":
        body, absent = "json_extract(scene, '$.target_particles')", "NULL"
    return (
        f"CASE WHEN {particle} > {body} THEN NULL "
        f"WHEN json_type(scene, '$.{masses}') IS NULL THEN {absent} "
        f"WHEN json_type(scene, '$.{masses}') = 'array' THEN json_extract(scene, {place}) END"
    )
