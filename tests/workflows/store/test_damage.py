"""Test that every command refuses a damaged store in one line and replaces no file."""

import contextlib
import sqlite3

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.merge import merge_stores
from chaincor.workflows.store.results_store import Store

SCENES = [Scene(potential="lj", particles=n, speed=0.4) for n in (2, 3, 4, 5)]
HURT = SCENES[1]


@pytest.fixture
def store_path(tmp_path, make_attempt):
    path = tmp_path / "speeds.sqlite"
    with Store(path) as store:
        store.record([make_attempt(scene, 0.5) for scene in SCENES], arrays=True)
    return path


def _hurt(path, damage):
    with contextlib.closing(sqlite3.connect(path)) as connection, connection:
        key = bytes.fromhex(HURT.collision_sha256)
        connection.execute(f"UPDATE collisions SET {damage} WHERE collision_sha256 = ?", (key,))


@pytest.mark.parametrize(
    "damage", ["scene = '{'", "details = '{'", "potential = CAST(x'ff' AS TEXT)"]
)
def test_a_damaged_row_is_refused_in_one_line(store_path, chaincor, tmp_path, damage):
    _hurt(store_path, damage)
    before = store_path.read_bytes()
    table, picture = tmp_path / "a.csv", tmp_path / "a.png"
    for command in (
        ("store", "export", store_path, table),
        ("plot", store_path, "--x", "particles", "--y", "vibrational_energy", "-o", picture),
    ):
        status, _, error = chaincor(*command)
        assert (status, error.count("\n")) == (2, 1)
        assert str(store_path) in error
    assert not table.exists()
    assert not picture.exists()
    assert store_path.read_bytes() == before


@pytest.mark.parametrize("damage", ["scene = '{'", "details = '{'"])
def test_a_row_that_cannot_be_read_back_is_named(store_path, damage):
    _hurt(store_path, damage)
    with Store(store_path) as store:
        with pytest.raises(StoreError, match=HURT.collision_sha256):
            store.find(HURT)
        # If a smaller error is requested, the row is not read, and the collision is computed again.
        assert store.get(HURT.replace(tolerance=1e-12)) is None


def test_a_damaged_file_is_named_by_a_merge_and_nothing_is_merged(tmp_path, make_attempt):
    target, whole, broken = (tmp_path / f"{name}.sqlite" for name in ("t", "whole", "broken"))
    for path, scenes in ((target, SCENES[:1]), (whole, SCENES[:2])):
        with Store(path) as store:
            store.record([make_attempt(scene) for scene in scenes], arrays=True)
    content = bytearray(whole.read_bytes())
    with contextlib.closing(sqlite3.connect(whole)) as connection:
        query = "SELECT rootpage FROM sqlite_master WHERE name = 'arrays'"
        page = connection.execute(query).fetchone()[0] - 1
    content[4096 * page : 4096 * (page + 1)] = b"Z" * 4096
    broken.write_bytes(content)
    before = target.read_bytes()
    with pytest.raises(StoreError, match=r"broken\.sqlite is .*damaged .*nothing was merged"):
        merge_stores(target, [whole, broken])
    assert target.read_bytes() == before


COMMANDS = (
    ("show", "STORE", "--columns", "COLUMN"),
    ("show", "STORE", "--columns", "COLUMN", "--json"),
    ("store", "export", "STORE", "a.csv"),
    ("store", "export", "STORE", "a.parquet"),
    ("plot", "STORE", "--x", "particles", "--y", "COLUMN", "-o", "a.png"),
)


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("tolerance_met", "7"),
        ("speed", "1e308"),
        ("speed", "9e999"),
        ("contacts", "x'00ff'"),
        ("contacts", "2.5"),
        ("restitution", "'high'"),
        ("failure", "x'00'"),
    ],
)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_value_that_no_run_writes_is_named(
    store_path, chaincor, tmp_path, monkeypatch, command, column, value
):
    _hurt(store_path, f"{column} = {value}")
    monkeypatch.chdir(tmp_path)
    places = {"STORE": store_path, "COLUMN": column}
    status, out, error = chaincor(*(places.get(word, word) for word in command))
    assert (status, out, error.count("\n")) == (2, "", 1)
    if command[0] != "plot":
        assert f"in column '{column}'" in error
        assert HURT.collision_sha256 in error
    assert {path.name for path in tmp_path.iterdir()} == {store_path.name}


@pytest.mark.parametrize(
    ("table", "damage"),
    [
        ("collisions", "scene = '[1]'"),
        ("collisions", f"scene = '{'[' * 900}{']' * 900}'"),
        ("environments", "versions = '[]'"),
        ("environments", "versions = '{\"numpy\": 2}'"),
        ("environments", "versions = x'00'"),
    ],
)
def test_json_of_another_kind_is_refused_by_all_that_read_it(
    store_path, chaincor, tmp_path, table, damage
):
    with contextlib.closing(sqlite3.connect(store_path)) as connection, connection:
        connection.execute(f"UPDATE {table} SET {damage}")
    crate = ("store", "export", store_path, tmp_path / "crate", "--rocrate")
    drawn = ("plot", store_path, "--x", "particles", "--y", "contacts", "-o", tmp_path / "a.png")
    for command in (crate,) if table == "environments" else (drawn,):
        status, out, error = chaincor(*command)
        assert (status, out, error.count("\n")) == (2, "", 1)
    with Store(store_path) as store, pytest.raises(StoreError, match="Delete this row"):
        store.find(HURT)


@pytest.mark.parametrize(
    "statement",
    [
        "CREATE VIEW v AS SELECT 1",
        "CREATE TRIGGER t AFTER INSERT ON arrays BEGIN DELETE FROM collisions; END",
        "ALTER TABLE collisions ADD COLUMN c AS (particles + 1)",
        "DROP TABLE arrays",
        "ALTER TABLE collisions DROP COLUMN host",
    ],
)
def test_the_tables_of_a_store_are_tables(store_path, chaincor, tmp_path, statement):
    with contextlib.closing(sqlite3.connect(store_path)) as connection, connection:
        connection.execute(statement)
    before = store_path.read_bytes()
    for command in (
        ("show", store_path),
        ("plot", store_path, "-o", tmp_path / "a.png"),
        ("store", "merge", tmp_path / "new.sqlite", store_path),
        ("store", "export", store_path, tmp_path / "a.csv"),
    ):
        status, out, error = chaincor(*command)
        assert (status, out, error.count("\n")) == (2, "", 1)
        assert "which no results store has" in error
    assert store_path.read_bytes() == before


def test_an_array_that_is_none_is_named(store_path):
    with contextlib.closing(sqlite3.connect(store_path)) as connection, connection:
        connection.execute("UPDATE arrays SET npy = x'00'")
    with Store(store_path) as store, pytest.raises(StoreError, match=r"array .* is damaged"):
        store.find(HURT, arrays=True)


@pytest.mark.parametrize("text", ["\x1b]0;owned\x07", "a\nb", "\u202eabc", "\x9b31m"])
def test_control_characters_of_a_store_do_not_reach_the_terminal(store_path, chaincor, text):
    with contextlib.closing(sqlite3.connect(store_path)) as connection, connection:
        connection.execute("UPDATE collisions SET potential = ?", (text,))
    status, out, error = chaincor("show", store_path, "--columns", "potential,particles")
    assert (status, error) == (0, "")
    assert len(out.splitlines()) == 1 + len(SCENES)
    assert out.replace("\n", "").isprintable()
    _, _, error = chaincor("plot", store_path, "--x", "potential", "--y", "contacts")
    assert error.replace("\n", "").isprintable()


@pytest.mark.parametrize("text", ["=1+1", "+1", "-x", "@sum", "\t=1", "plain"])
def test_no_cell_of_an_export_is_a_formula(store_path, chaincor, tmp_path, text):
    import csv

    with contextlib.closing(sqlite3.connect(store_path)) as connection, connection:
        connection.execute("UPDATE collisions SET potential = ?, energy_drift = -1e-9", (text,))
    assert chaincor("store", "export", store_path, tmp_path / "a.csv")[0] == 0
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["potential"] for row in rows} == {text if text == "plain" else f"'{text}"}
    assert {row["energy_drift"] for row in rows} == {"-1e-09"}
