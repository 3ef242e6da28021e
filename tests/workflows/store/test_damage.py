"""A damaged store is refused in one line by every command that reads it; none replaces a file."""

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
        key = HURT.collision_sha256
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


@pytest.mark.parametrize("damage", ["scene = '{'", "details = NULL"])
def test_a_row_that_cannot_be_read_back_is_named(store_path, damage):
    _hurt(store_path, damage)
    with Store(store_path) as store:
        with pytest.raises(StoreError, match=HURT.collision_sha256):
            store.find(HURT)
        # Where a smaller error is asked than it has, it is not read, but computed again.
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
