"""Test that rows keep their scenes, also those of stores with the first schema."""

import contextlib
import sqlite3
from pathlib import Path

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
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
