"""Open the file of a results store, and turn SQLite's errors into named errors."""

import contextlib
import itertools
import sqlite3
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

from chaincor.lammps_inputs.errors import one_line
from chaincor.workflows.errors import StoreError, StoreWriteError
from chaincor.workflows.store.schema import (
    APPLICATION_ID,
    CREATION,
    DROPPED_COLUMNS,
    MIGRATIONS,
    SCHEMA_VERSION,
    TABLE_COLUMNS,
)
from chaincor.workflows.store.short_scene import define_functions

# Longest time to wait for other sweeps that are writing. One write takes milliseconds.
LOCK_SECONDS = 60.0


def connect(path: Path, *, read_only: bool = False) -> sqlite3.Connection:
    """
    Open a results store. Create it or migrate it to the newest schema if necessary.

    The connection uses SQLite's defaults: a rollback journal, and a sync at every commit. A
    write-ahead log would save about a millisecond per row. But it leaves files beside the store,
    and needs shared memory, which network file systems on clusters lack.

    The connection is in autocommit mode. If `read_only` is true, the store must exist, and only an
    older schema is changed. Raise StoreError if this version of chaincor cannot use the file, and
    StoreWriteError if a new or older store cannot be written.
    """
    if read_only and not path.exists():
        raise StoreError(
            f"there is no results store {path}. Give a store that `chaincor sweep` made"
        )
    if path.exists() and not path.is_file():
        raise StoreError(f"the results store {path} is no file. Give a file, or a new name")
    if not path.parent.is_dir():
        raise StoreError(f"the folder of the results store {path} does not exist. Create it first")
    with named_errors(path):
        try:
            connection, version = _opened(path, read_only)
        except sqlite3.OperationalError as error:
            interrupted = getattr(error, "sqlite_errorname", "").startswith("SQLITE_READONLY")
            if not (read_only and interrupted):
                raise
            # A killed writer left a journal. Only a connection with write access can roll it back.
            connect(path).close()
            connection, version = _opened(path, read_only)
        try:
            if version < SCHEMA_VERSION:
                _migrate_read_only(path, version) if read_only else _migrate(connection, path)
            _refuse_other_schema(connection, path)
        except BaseException:
            connection.close()
            raise
    return connection


def _opened(path: Path, read_only: bool) -> tuple[sqlite3.Connection, int]:
    """Return a connection to a file, and the version of its schema."""
    connection = sqlite3.connect(
        address(path, "ro" if read_only else "rwc"),
        uri=True,
        timeout=LOCK_SECONDS,
        isolation_level=None,
    )
    try:
        define_functions(connection)
        # Without this transaction, another process could create the store between two reads.
        with transaction(connection, "BEGIN", "ROLLBACK"):
            return connection, _version(connection, path)
    except BaseException:
        connection.close()
        raise


def address(path: Path, mode: str) -> str:
    """
    Return SQLite's URI for a file.

    Mode ``ro`` only reads the file, and ``rwc`` writes or creates it.
    """
    return f"file:{quote(str(path.absolute()))}?mode={mode}"


def _version(connection: sqlite3.Connection, path: Path) -> int:
    """Return the schema version; 0 for an empty file."""
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if application != APPLICATION_ID and (tables or application):
        raise StoreError(
            f"{path} is an SQLite file, but not a results store of chaincor. Give a store "
            "that `chaincor sweep` made, or a new name"
        )
    if version > SCHEMA_VERSION:
        raise StoreError(
            f"the results store {path} has schema {version}; this chaincor knows up to "
            f"{SCHEMA_VERSION}: install a newer chaincor, nothing was changed"
        )
    return version


def _refuse_other_schema(connection: sqlite3.Connection, path: Path) -> None:
    """
    Refuse a store with views, triggers, virtual tables, computed columns or missing columns.

    Views, triggers and computed columns run their own queries, which may never end. Raise
    StoreError, which names the first such object.
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
            f"{path} has a {kind} {str(name)[:40]!a}, which no results store has. Run the "
            "sweep into a new store"
        )


def _migrate_read_only(path: Path, version: int) -> None:
    """Migrate a store that is being opened for reading; raise StoreError if it is empty."""
    if version == 0:
        raise StoreError(
            f"the results store {path} is empty. Give a store that `chaincor sweep` made"
        )
    connect(path).close()


def _migrate(connection: sqlite3.Connection, path: Path) -> None:
    """Create the tables of a store, or turn an older store into one of the newest schema."""
    with transaction(connection):
        # The version is read again, because another process may have migrated the store in the
        # meantime.
        version = _version(connection, path)
        if version == 1:
            _refuse_lossy_migration(connection, path)
            if sys.stderr.isatty():
                print(f"chaincor: converting {path} to a smaller format", file=sys.stderr)
        steps = (CREATION,) if version == 0 else MIGRATIONS[version - 1 :]
        for statement in itertools.chain(*steps):
            connection.execute(statement)
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
    if version == 1:
        # Free the space of the old tables. If the disk is full or the store is in use, later rows
        # fill this space.
        with contextlib.suppress(sqlite3.Error):
            connection.execute("VACUUM")


def _refuse_lossy_migration(connection: sqlite3.Connection, path: Path) -> None:
    """Raise StoreError if a migration from version 1 would lose something or a row is damaged."""
    _refuse_other_schema(connection, path)
    for name, known in TABLE_COLUMNS.items():
        columns = connection.execute("SELECT name FROM pragma_table_info(?)", (name,)).fetchall()
        for (column,) in columns:
            if column not in known | DROPPED_COLUMNS:
                raise StoreError(
                    f"{path} has a column {str(column)[:40]!a} that no results store has; "
                    "converting the store would lose it. Save the column elsewhere, then drop it"
                )
    damaged = connection.execute(
        "SELECT collision_sha256 FROM collisions "
        "WHERE bytes_of_hex(collision_sha256) IS NULL OR julianday(finished) IS NULL"
    ).fetchone()
    if damaged is not None:
        raise StoreError(
            f"the row collision_sha256={str(damaged[0])[:64]!a} of {path} is damaged: its key is "
            "no hash, or its time no date. Delete the row, or run the sweep into a new store"
        )


@contextlib.contextmanager
def transaction(
    connection: sqlite3.Connection, begin: str = "BEGIN IMMEDIATE", end: str = "COMMIT"
) -> Iterator[None]:
    """
    Run a block in a transaction, and roll back on errors.

    The connection must be in autocommit mode.
    """
    if connection.in_transaction:
        # An earlier transaction may still be open, if Ctrl-C arrived between its beginning and its
        # `try` block.
        connection.execute("ROLLBACK")
    try:
        connection.execute(begin)
        yield
        connection.execute(end)
    except BaseException:
        # If the disk was full, SQLite has already rolled back.
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


@contextlib.contextmanager
def named_errors(path: Path) -> Iterator[None]:
    """Turn SQLite's errors into StoreError, or into StoreWriteError if writing is impossible."""
    try:
        yield
    except sqlite3.Error as error:
        name = getattr(error, "sqlite_errorname", "")
        reason = one_line(error)
        if name.startswith(("SQLITE_READONLY", "SQLITE_CANTOPEN", "SQLITE_PERM", "SQLITE_AUTH")):
            raise StoreError(
                f"the results store {path} cannot be written or opened ({reason}). Copy it to a "
                "folder where you may write, or name another with --store"
            ) from None
        if name in ("SQLITE_NOTADB", "SQLITE_CORRUPT"):
            raise StoreError(
                f"{path} is not a results store, or is damaged ({reason}). Give a store that "
                "`chaincor sweep` made"
            ) from None
        if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
            raise StoreWriteError(
                f"the results store {path} has been locked by another program for "
                f"{LOCK_SECONDS:g} s. Wait for that program, and run the same command again"
            ) from None
        if name == "SQLITE_FULL" or name.startswith("SQLITE_IOERR"):
            raise StoreWriteError(
                f"the results store {path} cannot be written ({reason}). Make room and "
                "run the same command again: the results in the store are safe"
            ) from None
        raise StoreError(
            f"the results store {path} cannot be read ({reason}). Restore an earlier copy, "
            "or run the sweep into a new store"
        ) from None
