"""Implement ``chaincor show``: show a store as a table."""

from pathlib import Path
from typing import Any

import click

from chaincor.workflows.commands.options import PATH, json_option, option, tell
from chaincor.workflows.json_output import finite
from chaincor.workflows.showing.table import aligned
from chaincor.workflows.terminal_text import printable

_COLUMNS = (
    "potential",
    "particles",
    "speed",
    "velocity",
    "restitution",
    "restitution_error",
    "contacts",
    "scheme",
    "seconds_total",
    "failure",
)


@click.command()
@click.argument("stores", metavar="STORE...", nargs=-1, required=True, type=PATH)
@option("--columns A,B,...", "columns to show, in this order")
@option(
    "--where COND", "choose rows by a condition, such as potential=lj or speed<0.5", multiple=True
)
@option(
    "--sort A,-B",
    "columns to sort by; -B puts the largest values first",
    default="potential,particles,velocity",
)
@option(
    "--limit N",
    "largest number of rows; 0 for all [default: 100]",
    click.IntRange(min=0),
    default=100,
)
@json_option
def show(
    stores: tuple[Path, ...],
    columns: str | None,
    where: tuple[str, ...],
    sort: str,
    limit: int,
    as_json: bool,
) -> None:
    """
    Show stores of results, or folders of shards, as one table.

    By default, the table has the usual columns, and each key of the scene that differs between the
    rows shown.
    """
    from chaincor.workflows.store.query import count_rows, query_rows
    from chaincor.workflows.store.store_set import open_stores

    names = [name.strip() for name in columns.split(",")] if columns else _default_columns()
    order = [name.strip() for name in sort.split(",")] if sort else ()
    with open_stores(stores) as store:
        for part, _ in store.parts():
            # A damaged row is also shown, if its text can be read.
            part.connection.text_factory = lambda content: content.decode(errors="replace")
        rows = query_rows(store, names, where=where, order=order, limit=limit or None)
        found = count_rows(store, where)
    if not columns:
        names, rows = _without_constants(names, rows)
    objects = [dict(zip(names, row, strict=True)) for row in rows]
    text = aligned([names, *([_cell(value) for value in row] for row in rows)])
    if found == 0:
        text += "\nno row matches"
    elif len(rows) < found:
        text += f"\n{len(rows)} of {found} rows; --limit 0 shows all"
    tell({"count": found, "rows": finite(objects)}, text, as_json)


def _default_columns() -> list[str]:
    """Return the usual columns, with all other keys of a scene after the particles."""
    from chaincor.lammps_inputs.scene import Scene
    from chaincor.workflows.store.schema import (
        BODY_COLUMNS,
        PLAIN_COLUMNS,
        SCENE_COLUMNS,
        SCENE_KEYS,
    )

    at = _COLUMNS.index("particles") + 1
    known = (*SCENE_COLUMNS, *SCENE_KEYS, *BODY_COLUMNS, "tolerance")
    keys = (key for key in known if key in PLAIN_COLUMNS and key in Scene.model_fields)
    return list(dict.fromkeys([*_COLUMNS[:at], *keys, *_COLUMNS[at:]]))


def _without_constants(
    names: list[str], rows: list[tuple[Any, ...]]
) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Leave out the columns that are not usual and have one value in all rows."""
    kept = [
        k for k, name in enumerate(names) if name in _COLUMNS or len({row[k] for row in rows}) > 1
    ]
    return [names[k] for k in kept], [tuple(row[k] for k in kept) for row in rows]


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.10g}" if isinstance(value, float) else printable(str(value))
