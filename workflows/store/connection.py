"""Opening the file of a results store, and naming what can be wrong with it."""

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

from chaincor.lammps_inputs.errors import one_line
from chaincor.workflows.errors import StoreError, StoreWriteError
from chaincor.workflows.store.schema import (
    APPLICATION_ID,
    MIGRATIONS,
    SCHEMA_VERSION,
    TABLE_COLUMNS,
)

# How long to wait for another sweep that is writing; each writes for milliseconds.
LOCK_SECONDS = 60.0


def connect(path: Path, *, read_only: bool = False) -> sqlite3.Connection:
    """
    Open a results store; make it, or bring it to the newest schema, where that is needed.

    SQLite's own defaults are kept: a rollback journal and a sync at every commit. A write-ahead
    log would save about a millisecond a row, but needs shared memory, which network file systems
    of clusters do not have, and leaves files beside the store.

    The connection is in autocommit mode; `read_only` refuses changes, and a store that is not
    there. Raises StoreError if the file is not a store this version can use, and StoreWriteError if
    a new or older one cannot be written.
    """
    if read_only and not path.exists():
        raise StoreError(f"there is no results store {path}; expected one made by `chaincor sweep`")
    if path.exists() and not path.is_file():
        raise StoreError(f"the results store {path} is no file; expected one, or a new name")
    if not path.parent.is_dir():
        raise StoreError(f"the folder of the results store {path} does not exist; make it first")
    mode = "ro" if read_only else "rwc"
    with named_errors(path):
        connection = sqlite3.connect(
            address(path, mode), uri=True, timeout=LOCK_SECONDS, isolation_level=None
        )
        try:
            # Between two reads another process may make the store.
            with transaction(connection, "BEGIN", "ROLLBACK"):
                version = _version(connection, path)
            if version < SCHEMA_VERSION:
                _migrate(connection, path, read_only)
            _refuse_other_schema(connection, path)
        except BaseException:
            connection.close()
            raise
    return connection


def address(path: Path, mode: str) -> str:
    """Return what SQLite opens a file by: ``ro`` to read it only, ``rwc`` to write or make it."""
    return f"file:{quote(str(path.absolute()))}?mode={mode}"


def _version(connection: sqlite3.Connection, path: Path) -> int:
    """Return the schema version, 0 for an empty file."""
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if application != APPLICATION_ID and (tables or application):
        raise StoreError(
            f"{path} is an SQLite file, but not a results store of chaincor; expected one made by "
            "`chaincor sweep`, or a new name"
        )
    if version > SCHEMA_VERSION:
        raise StoreError(
            f"the results store {path} has schema {version}; this chaincor knows up to "
            f"{SCHEMA_VERSION}: install a newer chaincor, nothing was changed"
        )
    return version


def _refuse_other_schema(connection: sqlite3.Connection, path: Path) -> None:
    """
    Refuse a store whose tables are something else than tables.

    Views, triggers and computed columns run queries of their own, which may never end. Raises
    StoreError, which names the first of them.
    """
    others = "type IN ('view', 'trigger') OR sql LIKE 'CREATE VIRTUAL%'"
    found = connection.execute(f"SELECT type, name FROM sqlite_master WHERE {others}").fetchall()
    for name, known in TABLE_COLUMNS.items():
        columns = connection.execute("SELECT name, hidden FROM pragma_table_xinfo(?)", (name,))
        hidden = dict(columns.fetchall())
        if not known <= set(hidden):
            found.append(("table without its columns", name))
        found += (("computed column", column) for column, kind in hidden.items() if kind)
    if found:
        kind, name = found[0]
        raise StoreError(
            f"{path} has a {kind} {str(name)[:40]!a}; expected the tables of a results store and "
            "no more: run the sweep into a new store"
        )


def _migrate(connection: sqlite3.Connection, path: Path, read_only: bool) -> None:
    if read_only:
        raise StoreError(
            f"the results store {path} is empty or has an older schema than {SCHEMA_VERSION}, and "
            "it is opened read-only; expected one that can be written once, to be brought up to "
            "date"
        )
    with transaction(connection):
        # Another process may have been faster since the version was read.
        for statements in MIGRATIONS[_version(connection, path) :]:
            for statement in statements:
                connection.execute(statement)
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")


@contextlib.contextmanager
def transaction(
    connection: sqlite3.Connection, begin: str = "BEGIN IMMEDIATE", end: str = "COMMIT"
) -> Iterator[None]:
    """Write all or nothing, or read one state, on a connection in autocommit mode."""
    if connection.in_transaction:
        # Ctrl-C can come between the beginning of a transaction and the code that would end it.
        connection.execute("ROLLBACK")
    try:
        connection.execute(begin)
        yield
        connection.execute(end)
    except BaseException:
        # A full disk makes SQLite roll back by itself.
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


@contextlib.contextmanager
def named_errors(path: Path) -> Iterator[None]:
    """Turn errors of SQLite into StoreError, or StoreWriteError where writing is not possible."""
    try:
        yield
    except sqlite3.Error as error:
        name = getattr(error, "sqlite_errorname", "")
        reason = one_line(error)
        if name.startswith(("SQLITE_READONLY", "SQLITE_CANTOPEN", "SQLITE_PERM", "SQLITE_AUTH")):
            raise StoreError(
                f"the results store {path} cannot be written or opened ({reason}); expected a "
                "file and a folder that may be written: copy it, or name another with --store"
            ) from None
        if name in ("SQLITE_NOTADB", "SQLITE_CORRUPT"):
            raise StoreError(
                f"{path} is not a results store, or is damaged ({reason}); expected one made by "
                "`chaincor sweep`"
            ) from None
        if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
            raise StoreWriteError(
                f"the results store {path} has been locked by another program for "
                f"{LOCK_SECONDS:g} s; end that program and run the same command again"
            ) from None
        if name == "SQLITE_FULL" or name.startswith("SQLITE_IOERR"):
            raise StoreWriteError(
                f"the results store {path} cannot be written ({reason}); what is in it is safe: "
                "make room and run the same command again"
            ) from None
        raise StoreError(
            f"the results store {path} cannot be read ({reason}); expected an undamaged one made "
            "by `chaincor sweep`: copy an earlier one back, or run the sweep into a new store"
        ) from None
