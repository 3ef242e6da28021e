"""Joining stores: the parts that the tasks of a job array have written."""

import dataclasses
import sqlite3
from pathlib import Path
from typing import Any
from urllib.parse import quote

from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.connection import named_errors, transaction
from chaincor.workflows.store.results_store import Store, update_row
from chaincor.workflows.store.standing import Standing, standing_columns


def merge_stores(target: Path, sources: list[Path]) -> int:
    """
    Copy the rows of some stores into another; where both have a row, the smaller error stays.

    What stays is decided by :meth:`~chaincor.workflows.store.standing.Standing.yields_to`.

    Returns how many rows the target, which is made if it is not there, has then. Each source is
    only read, and copied in one transaction: after a StoreWriteError whole stores are missing, no
    halves. Raises StoreError, and copies nothing, if a store cannot be used, or is to be merged
    into itself.
    """
    for source in sources:
        # A link to the target is the target as well.
        if source.exists() and target.exists() and source.samefile(target):
            raise StoreError(f"{source} cannot be merged into itself; expected another store")
        _check_whole(source)
    with Store(target) as store:
        for source in sources:
            _copy(store, source)
        return len(store)


def _check_whole(source: Path) -> None:
    """Read every page of a store: what goes wrong after that is the target's."""
    with Store(source, read_only=True) as store:
        ((found,), *_) = store.select("PRAGMA quick_check(1)")[1]
    if found != "ok":
        reason = " ".join(str(found).split())
        raise StoreError(
            f"the results store {source} is damaged ({reason}), and nothing was merged; expected a "
            "whole one: run its sweep into a new store, or leave it out"
        )


_WHERE_BOTH_HAVE_A_ROW = f"""
    SELECT collision_sha256, {standing_columns("main")}, {standing_columns("source")}
    FROM main.collisions JOIN source.collisions USING (collision_sha256)
"""
_WHERE_THE_TARGET_HAS_NONE = """
    INSERT INTO winners SELECT collision_sha256 FROM source.collisions
    WHERE collision_sha256 NOT IN (SELECT collision_sha256 FROM main.collisions)
"""


def _choose(connection: sqlite3.Connection) -> dict[str, dict[str, Any]]:
    """
    List in a table `winners` the keys of the rows to be copied.

    Returns by key what changes in the rows that stay, whichever of the two they are.
    """
    fields = len(dataclasses.fields(Standing))
    changes: dict[str, dict[str, Any]] = {}
    winners = []
    for key, *values in connection.execute(_WHERE_BOTH_HAVE_A_ROW):
        kept, other = Standing(*values[:fields]), Standing(*values[fields:])
        if kept.yields_to(other):
            winners.append((key,))
            kept, other = other, kept
        if tightened := kept.tightened_by(other):
            changes[key] = tightened
    connection.execute("CREATE TEMP TABLE winners (key TEXT NOT NULL)")
    connection.executemany("INSERT INTO winners VALUES (?)", winners)
    connection.execute(_WHERE_THE_TARGET_HAS_NONE)
    return changes


def _copy(store: Store, source: Path) -> None:
    connection = store.connection
    with named_errors(store.path):
        address = f"file:{quote(str(source.absolute()))}?mode=ro"
        connection.execute("ATTACH ? AS source", (address,))
        try:
            names = [row[1] for row in connection.execute("PRAGMA table_info(collisions)")]
            copied = ", ".join(f'"{name}"' for name in names)
            values = copied.replace(
                '"environment"',
                "(SELECT e.id FROM main.environments AS e "
                "JOIN source.environments AS s USING (versions) WHERE s.id = environment)",
            )
            with transaction(connection):
                connection.execute(
                    "INSERT OR IGNORE INTO environments (versions) "
                    "SELECT versions FROM source.environments"
                )
                changes = _choose(connection)
                among = "WHERE collision_sha256 IN (SELECT key FROM winners)"
                connection.execute(f"DELETE FROM main.arrays {among}")
                connection.execute(f"DELETE FROM main.collisions {among}")
                connection.execute(
                    f"INSERT INTO main.collisions ({copied}) "
                    f"SELECT {values} FROM source.collisions {among}"
                )
                connection.execute(f"INSERT INTO main.arrays SELECT * FROM source.arrays {among}")
                connection.execute("DROP TABLE winners")
                for key, columns in changes.items():
                    update_row(connection, key, columns)
        finally:
            connection.execute("DETACH source")
