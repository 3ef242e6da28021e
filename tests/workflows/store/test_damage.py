"""Rows that are damaged are named, left out, and computed anew; the others are of use."""

import contextlib
import csv
import sqlite3

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.damage import tell_damage
from chaincor.workflows.store.export import to_pandas
from chaincor.workflows.store.merge import merge_stores
from chaincor.workflows.store.query import query_rows
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.sweep.todo import plan_sweep

SCENES = [Scene(potential="lj", particles=n, speed=0.4) for n in (2, 3, 4, 5)]
HURT = SCENES[1]
KEY = HURT.collision_sha256
DAMAGES = {
    "scene = '{'": "scene",
    "scene = '[1]'": "scene",
    "scene = x'ff'": "scene",
    "scene = json_set(scene, '$.parameters', 3)": "scene",
    "details = '{'": "details",
    "details = NULL": "details",
    "restitution_error = 'abc'": "restitution_error",
    "\"table\" = x'00'": "table",
    "potential = CAST(x'ff' AS TEXT)": "text",
    "environment = 77": "environment",
}


@pytest.fixture
def damaged(tmp_path, make_attempt):
    """Return a function that makes a store of four rows, one of them damaged."""

    def make(damage, name="damaged.sqlite"):
        path = tmp_path / name
        with Store(path) as store:
            store.record([make_attempt(scene, 0.5) for scene in SCENES], arrays=True)
        with contextlib.closing(sqlite3.connect(path)) as connection, connection:
            connection.execute(f"UPDATE collisions SET {damage} WHERE collision_sha256 = ?", (KEY,))
        return path

    return make


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_row_is_named_and_the_others_are_used(damaged, chaincor, tmp_path, damage):
    path = damaged(damage)
    before = path.read_bytes()
    table, picture, merged = (tmp_path / name for name in ("a.csv", "a.png", "all.sqlite"))
    for command in (
        ("store", "export", path, table),
        ("plot", path, "--x", "particles", "-o", picture),
        ("store", "merge", merged, path),
    ):
        status, out, error = chaincor(*command)
        assert status == 1
        assert str(command[-1 if command[1] != "merge" else 2]) in out
        assert f"{path} has 1 damaged row, left out: collision_sha256={KEY}" in error
        assert f"({DAMAGES[damage]})" in error
        assert error.count("\n") == 1
    rows = csv.DictReader(table.read_text().splitlines())
    assert [row["particles"] for row in rows] == ["2", "4", "5"]
    with Store(merged, read_only=True) as store:
        assert (len(store), tell_damage(store)) == (3, None)
    assert chaincor("show", path, "--columns", "potential,masses.1,energy")[0] == 0
    assert path.read_bytes() == before


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_row_is_computed_anew(damaged, make_attempt, damage):
    with Store(damaged(damage)) as store:
        assert store.find(HURT) is None
        assert plan_sweep(store, SCENES).todo == (HURT,)
        store.record([make_attempt(HURT, 0.7)])
        assert tell_damage(store) is None
        assert len(store) == 4
        # The arrays were those of the lost result.
        assert store.find(HURT).restitution == 0.7
        assert not store.find(HURT).has_arrays


def test_a_sound_row_takes_the_place_of_a_damaged_one_and_never_the_other_way(
    damaged, tmp_path, make_attempt
):
    sound = tmp_path / "sound.sqlite"
    with Store(sound) as store:
        store.record([make_attempt(HURT, 0.7)])
    for damage in DAMAGES:
        path = damaged(damage, f"{len(list(tmp_path.iterdir()))}.sqlite")
        assert merge_stores(sound, [path]) == 4
        assert merge_stores(path, [sound]) == 4
        for merged in (sound, path):
            with Store(merged, read_only=True) as store:
                assert tell_damage(store) is None
                assert store.find(HURT).restitution == 0.7


def test_a_data_frame_leaves_damaged_rows_out_with_a_warning(damaged):
    pytest.importorskip("pandas")
    path = damaged("restitution = 'abc'")
    with pytest.warns(UserWarning, match=f"1 damaged row, left out: collision_sha256={KEY}"):
        assert to_pandas(path)["particles"].to_list() == [2, 4, 5]


def test_many_damaged_rows_are_counted(damaged, chaincor, tmp_path):
    path = damaged("scene = '{'")
    with contextlib.closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE collisions SET scene = '{'")
    with Store(path, read_only=True) as store:
        assert "has 4 damaged rows, left out: " in tell_damage(store)
        assert "(scene) and 1 more; run the sweep" in tell_damage(store)
        assert query_rows(store, ["masses.1", "energy"]) == [(None, None)] * 4
    status, _, error = chaincor("plot", path, "-o", tmp_path / "a.png")
    assert (status, "nothing is left to draw" in error) == (2, True)


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
