"""Test that rows keep their scenes, also those of stores with the first schema."""

import contextlib
import sqlite3
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.merge import merge_stores
from chaincor.workflows.store.query import query_rows
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.row import array_to_bytes

PLAIN = Scene(potential="lj", particles=3, speed=0.4, tolerance=1e-4)
FIRST_SCHEMA = Path(__file__).parents[2] / "analysis" / "store_of_november_2026.sql"


@pytest.mark.parametrize(
    "scene",
    [
        PLAIN,
        Scene(particles=3),
        Scene(particles=3, velocity=1, timestep=0.01, error=False),
        Scene(particles=3, temperature=1e-3, seed=7, masses=[1.0, 2.0]),
        Scene(potential="formula", energy="a*s^2/2", parameters={"a": 2.0}, particles=2),
    ],
)
def test_the_scene_of_a_row_is_the_canonical_scene(tmp_path, make_attempt, scene):
    with Store(tmp_path / "a.sqlite") as store:
        store.record([make_attempt(scene)])
        row = store.find(scene)
        assert row.scene == scene.canonical_fields
        assert row.result["scene_sha256"] == scene.sha256
        names = ["scene", "scene_sha256", "collision_sha256"]
        assert query_rows(store, names) == [
            (scene.canonical_json, scene.sha256, scene.collision_sha256)
        ]
        assert query_rows(store, ["particles"], where=[f"scene_sha256={scene.sha256}"])


def test_a_tightened_row_keeps_the_tolerance_of_its_run(tmp_path, make_attempt):
    tight = PLAIN.replace(tolerance=1e-8)
    with Store(tmp_path / "a.sqlite") as store:
        store.record([make_attempt(PLAIN, error=1e-5)])
        store.record([make_attempt(tight, error=2e-5)])
        row = store.find(PLAIN)
        assert row.columns["tolerance"] == 1e-8
        assert row.restitution_error == 1e-5
        assert row.scene == PLAIN.canonical_fields


def test_plain_scenes_take_no_room(tmp_path, make_attempt):
    with Store(tmp_path / "a.sqlite") as store:
        store.record([make_attempt(PLAIN)])
        assert store.select("SELECT scene FROM collisions")[1] == [("{}",)]


def first_schema(path, *statements):
    """Write a store of the first schema, change it by SQL, and return its content."""
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.executescript(FIRST_SCHEMA.read_text())
        for statement in statements:
            connection.execute(statement)
        connection.commit()
        return list(connection.iterdump())


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("CREATE VIEW mine AS SELECT 1", "has a view 'mine'"),
        (
            "CREATE TRIGGER mine AFTER INSERT ON collisions BEGIN SELECT 1; END",
            "has a trigger 'mine'",
        ),
        ("ALTER TABLE collisions ADD COLUMN note TEXT", "has a column 'note'"),
        ("UPDATE collisions SET collision_sha256 = 'zz' WHERE rowid = 1", "sha256='zz' of"),
        ("UPDATE collisions SET finished = 'yesterday' WHERE rowid = 1", "its time no date"),
    ],
)
def test_what_a_migration_would_lose_is_refused_before_any_change(tmp_path, statement, message):
    path = tmp_path / "old.sqlite"
    before = first_schema(path, statement)
    for read_only in (True, False):
        with pytest.raises(StoreError, match=message):
            Store(path, read_only=read_only)
    with contextlib.closing(sqlite3.connect(path)) as connection:
        assert list(connection.iterdump()) == before


def test_a_migration_keeps_damaged_scenes_and_drops_arrays_without_a_row(tmp_path):
    path = tmp_path / "old.sqlite"
    first_schema(
        path,
        "UPDATE collisions SET scene = '{\"velocity\": NaN}' WHERE rowid = 1",
        "INSERT INTO arrays VALUES ('zz', 'contact_times', x'00')",
    )
    with Store(path) as store:
        assert len(store) == 2
        assert store.select("SELECT * FROM arrays")[1] == []
        assert store.select("SELECT scene FROM collisions WHERE rowid = 1")[1] == [
            ('{"velocity": NaN}',)
        ]


# A write that is killed after its pages reached the file.
_KILLED = """
import os, signal, sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
connection.execute("PRAGMA cache_size = 1")
connection.execute("BEGIN IMMEDIATE")
connection.execute("UPDATE collisions SET details = hex(zeroblob(100000))")
connection.execute("INSERT INTO arrays VALUES (x'00', 'a', zeroblob(1000000))")
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_store_whose_writer_was_killed_can_be_read(tmp_path, make_attempt):
    path = tmp_path / "a.sqlite"
    with Store(path) as store:
        store.record([make_attempt(PLAIN)])
        before = store.select("SELECT * FROM collisions")
    killed = subprocess.run([sys.executable, "-c", _KILLED, str(path)], check=False)
    assert killed.returncode == -9
    assert path.with_name("a.sqlite-journal").exists()
    with Store(path, read_only=True) as store:
        assert store.select("SELECT * FROM collisions") == before
        assert store.select("SELECT * FROM arrays")[1] == []


def test_a_store_of_the_first_schema_keeps_every_value(tmp_path):
    old, merged = tmp_path / "old.sqlite", tmp_path / "merged.sqlite"
    with contextlib.closing(sqlite3.connect(old)) as connection, connection:
        connection.executescript(FIRST_SCHEMA.read_text())
        array = array_to_bytes(np.array([0.5, 1.5]))
        connection.execute(
            "INSERT INTO arrays SELECT collision_sha256, 'contact_times', ? FROM collisions",
            (array,),
        )
        columns = connection.execute("SELECT * FROM collisions").description
        names = [name for name, *_ in columns if name not in ("environment", "details")]
        quoted = ", ".join(f'"{name}"' for name in names)
        before = connection.execute(f"SELECT {quoted} FROM collisions ORDER BY velocity").fetchall()
    assert len(before) == 2
    merge_stores(merged, [old])
    for path in (old, merged):
        with Store(path, read_only=True) as store:
            assert query_rows(store, names, order=["velocity"]) == before
            assert len(store.select("SELECT * FROM arrays")[1]) == 2
