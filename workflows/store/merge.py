"""Merge stores, for example those from the tasks of a job array."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from chaincor.lammps_inputs.errors import one_line
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.checked_rows import KEY
from chaincor.workflows.store.connection import address, named_errors, transaction
from chaincor.workflows.store.results_store import STANDINGS, Store
from chaincor.workflows.store.schema import EXPRESSIONS
from chaincor.workflows.store.writing import update_row, upsertion

# Rows that exist both in the target (`main`) and in the store to be merged (`source`), in a fixed
# order.
_BOTH = """
    WHERE collision_sha256 IN (SELECT collision_sha256 FROM {0}.collisions)
    ORDER BY collision_sha256
"""
# Rows to copy from `source`: all rows except those for which `main` keeps its own row.
_TAKEN = f"WHERE {EXPRESSIONS[KEY]} NOT IN (SELECT value FROM json_each(:staying))"
_CHOSEN = f" AND {EXPRESSIONS[KEY]} IN (SELECT value FROM json_each(:chosen))"
_ENVIRONMENT = """
    (SELECT ours.id FROM main.environments AS ours JOIN source.environments AS theirs
    USING (versions) WHERE theirs.id = environment)
"""


class MergedRows(NamedTuple):
    """Numbers of rows after a merge."""

    rows: int  #: Rows in the target after the merge.
    added: int  #: Rows that the target lacked before.
    replaced: int  #: Rows that were replaced because the new result has a smaller error.
    equal: int  #: Rows in both stores for which neither result replaces the other.
    kept: int  #: Rows that were kept because the new result has a larger error.

    def __str__(self) -> str:
        return (
            f"{self.rows} rows ({self.added} added, {self.replaced} replaced by better ones, "
            f"{self.equal} equal, {self.kept} kept as better ones)"
        )


def merge_stores(target: Path, sources: list[Path]) -> MergedRows:
    """
    Copy the rows of some stores into another.

    If both stores have a row, the result with the smaller error stays.

    A missing target is created. Each source is copied in one transaction, so a StoreWriteError
    never leaves a partial copy. Raise StoreError before any copy if a store cannot be used, or if a
    source is the target.
    """
    for source in sources:
        # samefile also recognizes links to the target.
        if source.exists() and target.exists() and source.samefile(target):
            raise StoreError(f"{source} cannot be merged into itself. Give another store")
        _check_whole(source)
    replaced = equal = kept = 0
    with Store(target) as store:
        before = len(store)
        for source in sources:
            with Store(source, read_only=True) as part:
                counts = copy_rows(part, store)
            replaced, equal, kept = replaced + counts[0], equal + counts[1], kept + counts[2]
        return MergedRows(len(store), len(store) - before, replaced, equal, kept)


def _check_whole(source: Path) -> None:
    """Check every page of a source. Later errors can then come only from the target."""
    with Store(source, read_only=True) as store:
        ((found,), *_) = store.select("PRAGMA quick_check(1)")[1]
    if found != "ok":
        reason = one_line(found)
        raise StoreError(
            f"the results store {source} is damaged ({reason}), so nothing was merged. "
            "Leave it out, or run its sweep into a new store"
        )


def copy_rows(
    source: Store, target: Store, keys: Sequence[str] | None = None
) -> tuple[int, int, int]:
    """
    Copy all rows of a store, or the rows with some `keys`, into another in one transaction.

    If both stores have a row, :meth:`~chaincor.workflows.store.row.Row.yields_to` decides which row
    stays. Return how many of the rows in both stores were replaced, equal, and kept. If the target
    cannot be written, raise StoreWriteError and copy nothing.
    """
    with named_errors(target.path):
        target.connection.execute("ATTACH ? AS source", (address(source.path, "ro"),))
        try:
            with transaction(target.connection):
                return _copy_from_source(target, keys)
        finally:
            target.connection.execute("DETACH source")


def _copy_from_source(target: Store, keys: Sequence[str] | None) -> tuple[int, int, int]:
    # SQL copies the rows that need no change, because copying in Python would take five times as
    # long.
    replaced = equal = kept = 0
    staying: list[str] = []
    changes: dict[str, dict[str, Any]] = {}
    ours = target.read(STANDINGS.format("main") + _BOTH.format("source"))
    theirs = target.read(STANDINGS.format("source") + _BOTH.format("main"))
    for old, new in zip(ours, theirs, strict=True):
        key, taken = old.columns[KEY], old.yields_to(new)
        if taken:
            replaced += 1
        else:
            staying.append(key)
            better = new.yields_to(old)
            kept, equal = kept + better, equal + (not better)
        if tightened := new.tightened_by(old) if taken else old.tightened_by(new):
            changes[key] = tightened
    names = [row[1] for row in target.connection.execute("PRAGMA main.table_info(collisions)")]
    values = ", ".join(_ENVIRONMENT if name == "environment" else f'"{name}"' for name in names)
    taken_rows = _TAKEN + ("" if keys is None else _CHOSEN)
    for statement in (
        "INSERT OR IGNORE INTO environments (versions) "
        "SELECT versions FROM source.environments "
        f"WHERE id IN (SELECT environment FROM source.collisions {taken_rows})",
        "DELETE FROM arrays WHERE collision_sha256 IN "
        f"(SELECT collision_sha256 FROM source.collisions {taken_rows})",
        upsertion(tuple(names), f"SELECT {values} FROM source.collisions {taken_rows}"),
        f"INSERT INTO arrays SELECT * FROM source.arrays {taken_rows}",
    ):
        given = {"staying": json.dumps(staying)}
        given |= {} if keys is None else {"chosen": json.dumps(list(keys))}
        target.connection.execute(statement, given)
    for key, changed in changes.items():
        update_row(target, key, changed)
    return replaced, equal, kept
