"""Test files that are no stores, full disks, and several writers at once."""

import contextlib
import multiprocessing
import sqlite3
import threading

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError, StoreWriteError
from chaincor.workflows.store import connection as store_connection
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.schema import (
    APPLICATION_ID,
    CREATION,
    MIGRATIONS,
    SCHEMA_VERSION,
)

SCENE = Scene(potential="lj", particles=10, speed=0.4, tolerance=1e-6)


# ---- files that cannot be used ------------------------------------------------------------------


def test_a_newer_schema_is_refused_and_not_touched(tmp_path):
    path = tmp_path / "new.sqlite"
    Store(path).close()
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION + 1}")
    before = path.read_bytes()
    with pytest.raises(StoreError, match=f"schema {SCHEMA_VERSION + 1}.*newer chaincor"):
        Store(path)
    assert path.read_bytes() == before


def test_an_older_schema_is_brought_up_to_date(tmp_path, monkeypatch, make_attempt):
    path = tmp_path / "old.sqlite"
    with Store(path) as store:
        store.record([make_attempt(SCENE, 0.51)])
    newer = (*MIGRATIONS, ("ALTER TABLE collisions ADD COLUMN colour TEXT",))
    monkeypatch.setattr(store_connection, "MIGRATIONS", newer)
    monkeypatch.setattr(store_connection, "SCHEMA_VERSION", SCHEMA_VERSION + 1)
    with Store(path, read_only=True) as store:
        assert store.get(SCENE).restitution == 0.51
        assert store.select("SELECT colour FROM collisions")[1] == [(None,)]


def test_a_migration_that_fails_changes_nothing(tmp_path, monkeypatch):
    path = tmp_path / "old.sqlite"
    Store(path).close()
    broken = (*MIGRATIONS, ("ALTER TABLE collisions ADD COLUMN colour TEXT", "nonsense"))
    with monkeypatch.context() as patch:
        patch.setattr(store_connection, "MIGRATIONS", broken)
        patch.setattr(store_connection, "SCHEMA_VERSION", SCHEMA_VERSION + 1)
        with pytest.raises(StoreError, match="nonsense"):
            Store(path)
    with Store(path) as store:
        assert "colour" not in store.select("SELECT * FROM collisions")[0]


@pytest.mark.parametrize("content", [b"not a database at all, but text" * 40, b"PK\3\4" * 300])
def test_other_files_are_refused(tmp_path, content):
    path = tmp_path / "file.sqlite"
    path.write_bytes(content)
    with pytest.raises(StoreError, match="not a results store"):
        Store(path)
    assert path.read_bytes() == content


def test_other_databases_are_refused(tmp_path):
    path = tmp_path / "other.sqlite"
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.execute("CREATE TABLE mine (x)")
    with pytest.raises(StoreError, match="not a results store of chaincor"):
        Store(path)


def test_missing_files_and_folders_are_named(tmp_path):
    with pytest.raises(StoreError, match="there is no results store"):
        Store(tmp_path / "none.sqlite", read_only=True)
    with pytest.raises(StoreError, match="folder"):
        Store(tmp_path / "none" / "none.sqlite")
    for read_only in (True, False):
        for path in (tmp_path, "/dev/null"):
            with pytest.raises(StoreError, match="is no file"):
                Store(path, read_only=read_only)


def test_a_read_only_store_can_be_read_and_refuses_writes(tmp_path, make_attempt):
    path = tmp_path / "results.sqlite"
    with Store(path) as store:
        store.record([make_attempt(SCENE)])
    with Store(path, read_only=True) as store:
        assert store.get(SCENE) is not None
        with pytest.raises(StoreError, match="cannot be written"):
            store.check_writable()
        with pytest.raises(StoreError, match="cannot be written"):
            store.record([make_attempt(SCENE.replace(tolerance=1e-9))])


def test_a_full_disk_is_one_clear_error_and_loses_nothing(small_disk, make_attempt):
    path = small_disk / "results.sqlite"
    scenes = [SCENE.replace(speed=0.001 * k) for k in range(1, 400)]
    written = 0
    with Store(path) as store:
        with pytest.raises(StoreWriteError, match="Make room"):  # noqa: PT012
            for scene in scenes:
                store.record([make_attempt(scene)], arrays=True)
                written += 1
        assert 0 < written < len(scenes)
        assert len(store) == written
        assert store.get(scenes[written - 1], arrays=True) is not None
    with Store(path, read_only=True) as store:
        assert store.select("PRAGMA integrity_check")[1] == [("ok",)]
        assert len(store) == written


# ---- several at once ----------------------------------------------------------------------------


def test_two_writers_take_turns(tmp_path, make_attempt):
    path = tmp_path / "results.sqlite"
    errors = []

    def write(first):
        try:
            with Store(path) as store:
                for k in range(first, first + 60):
                    store.record([make_attempt(SCENE.replace(speed=0.001 * k))])
        except Exception as error:  # the main thread reports it
            errors.append(error)

    # Half of the two parts is common. Rows that two threads write must occur once.
    threads = [threading.Thread(target=write, args=(first,)) for first in (1, 31)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    with Store(path) as store:
        assert len(store) == 90


def test_a_store_made_while_it_is_opened_is_a_store(tmp_path, monkeypatch):
    path = tmp_path / "results.sqlite"
    plain = sqlite3.Connection

    class Overtaken(plain):
        """Connection that lets another process make the store after the first check of the file."""

        looked = False

        def execute(self, statement, *parameters):
            if statement == "PRAGMA user_version" and not Overtaken.looked:
                Overtaken.looked = True
                # The other process has to wait, unless a check and the creation are separate
                # transactions.
                with (
                    contextlib.closing(plain(path, timeout=0.0)) as other,
                    contextlib.suppress(sqlite3.OperationalError),
                ):
                    make_store(other)
            return super().execute(statement, *parameters)

    def make_store(connection):
        connection.isolation_level = None
        with store_connection.transaction(connection):
            for statement in CREATION:
                connection.execute(statement)
            connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    connect = sqlite3.connect
    monkeypatch.setattr(sqlite3, "connect", lambda *a, **k: connect(*a, factory=Overtaken, **k))
    Store(path).close()
    assert Overtaken.looked
    with Store(path, read_only=True) as store:
        assert len(store) == 0


@pytest.mark.slow
def test_many_processes_may_make_one_store(tmp_path):
    spawn = multiprocessing.get_context("spawn")
    workers, rounds = 8, 60
    barrier, errors = spawn.Barrier(workers), spawn.SimpleQueue()
    processes = [
        spawn.Process(target=_open_stores, args=(tmp_path, rounds, barrier, errors))
        for _ in range(workers)
    ]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert [errors.get() for _ in range(workers)] == [[]] * workers


def _open_stores(folder, rounds, barrier, errors):
    """Open a sequence of stores, each at the same moment as other processes."""
    seen = []
    for k in range(rounds):
        barrier.wait()
        try:
            with Store(folder / f"{k}.sqlite") as store:
                len(store)
        except Exception as error:  # the main process reports it
            seen.append(str(error))
    errors.put(seen)


def test_a_lock_that_does_not_end_is_named(tmp_path, monkeypatch, make_attempt):
    monkeypatch.setattr(store_connection, "LOCK_SECONDS", 0.1)
    path = tmp_path / "results.sqlite"
    with Store(path) as store, contextlib.closing(sqlite3.connect(path)) as other:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(StoreWriteError, match="locked"):
            store.record([make_attempt(SCENE)])
