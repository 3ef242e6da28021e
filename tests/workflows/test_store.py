"""The results store: one row a collision, the tighter result stays, whole rows only."""

import contextlib
import os
import shutil
import sqlite3
import subprocess
import threading
import time

import numpy as np
import pytest

from lammps_inputs.errors import SceneError
from lammps_inputs.potentials import LennardJones
from lammps_inputs.scene import Scene
from workflows import store_connection
from workflows.attempt import Attempt, Failure
from workflows.collision import collide
from workflows.errors import StoreError, StoreWriteError
from workflows.store import Store
from workflows.store_export import export_store, to_pandas
from workflows.store_merge import merge_stores
from workflows.store_query import count_rows, query_rows
from workflows.store_schema import MIGRATIONS, PLAIN_COLUMNS, SCHEMA_VERSION

SCENE = Scene(potential="lj", particles=10, speed=0.4, tolerance=1e-6)
FAILURE = Failure("CrossingError", "particles would cross", stands=True)


def failed(scene, failure=FAILURE):
    return Attempt(scene, None, failure, "there")


@pytest.fixture
def store(tmp_path):
    with Store(tmp_path / "results.sqlite") as opened:
        yield opened


# ---- one row ------------------------------------------------------------------------------------


def test_a_result_comes_back_as_it_was(store):
    scene = Scene(potential="harmonic", particles=5, engine="reference")
    collision = collide(scene)
    store.record([Attempt(scene, collision, None, "here")], arrays=True)
    found = store.get(scene, arrays=True)
    assert found.result == collision.to_dict()
    assert found.restitution == collision.restitution
    for name, array in collision.arrays().items():
        np.testing.assert_array_equal(found.arrays[name], array)
    assert (found.host, found.tries, found.failure) == ("here", 1, None)


def test_arrays_are_kept_only_on_request(store, make_attempt):
    store.record([make_attempt(SCENE)])
    assert store.get(SCENE).arrays == {}
    assert store.get(SCENE, arrays=True) is None
    store.record([make_attempt(SCENE)], arrays=True)
    assert "contact_times" in store.get(SCENE, arrays=True).arrays


def test_the_speed_is_kept_as_it_was_given(store, make_attempt):
    # 0.1 v*/v* is not 0.1 to the last bit for every bond; a heat map needs equal speeds equal.
    scenes = [Scene(potential=p, speed=s) for p in ("lj", "toda", "log") for s in (0.1, 0.3, 0.7)]
    store.record([make_attempt(scene) for scene in scenes])
    assert {row[0] for row in query_rows(store, ["speed"])} == {0.1, 0.3, 0.7}


def test_a_potential_without_a_name_of_its_own_is_refused(store):
    with pytest.raises(SceneError, match="Python object"):
        store.get(Scene(potential=LennardJones(), particles=5))


# ---- which result stays -------------------------------------------------------------------------


def test_a_tighter_result_supersedes_and_a_looser_one_does_not(store, make_attempt):
    tight, loose = SCENE.replace(tolerance=1e-8), SCENE.replace(tolerance=1e-4)
    store.record([make_attempt(SCENE, 0.51)])
    assert store.get(tight) is None
    assert store.get(loose).restitution == 0.51
    store.record([make_attempt(tight, 0.52)])
    store.record([make_attempt(loose, 0.53)])
    assert [store.get(s).restitution for s in (tight, SCENE, loose)] == [0.52] * 3
    assert len(store) == 1


def test_an_error_bar_below_the_tolerance_answers(store, make_attempt):
    store.record([make_attempt(SCENE, error=1e-9)])
    assert store.get(SCENE.replace(tolerance=1e-8)) is not None
    assert store.get(SCENE.replace(tolerance=1e-10)) is None


def test_a_tolerance_that_was_not_met_is_not_tried_again(store, make_attempt):
    store.record([make_attempt(SCENE, error=1e-3)])
    assert store.get(SCENE) is not None


def test_explicit_numerics_are_rows_of_their_own(store, make_attempt):
    plain = Scene(potential="lj", particles=10, speed=0.4, scheme="verlet", error=False)
    store.record([make_attempt(SCENE), make_attempt(plain)])
    assert len(store) == 2
    assert store.get(plain) is not None
    assert store.get(plain.replace(error=True)) is None, "it has no error bar"


def test_the_first_of_two_equal_results_stays_unless_asked(store, make_attempt):
    store.record([make_attempt(SCENE, 0.51)])
    store.record([make_attempt(SCENE, 0.52)])
    assert store.get(SCENE).restitution == 0.51
    store.record([make_attempt(SCENE, 0.53)], replace=True)
    assert (store.get(SCENE).restitution, store.get(SCENE).tries) == (0.53, 2)


def test_arrays_stay_those_of_the_result(store, make_attempt):
    tight = SCENE.replace(tolerance=1e-8)
    store.record([make_attempt(SCENE, 0.51)], arrays=True)
    store.record([make_attempt(tight, 0.52)])  # arrays not asked for this time
    assert store.get(tight, arrays=True).arrays["contact_times"][1] == 0.52
    store.record([make_attempt(SCENE, 0.53)], arrays=True)
    assert store.get(SCENE, arrays=True).arrays["contact_times"][1] == 0.52


def test_a_failure_is_recorded_but_never_replaces_a_result(store, make_attempt):
    tight = SCENE.replace(tolerance=1e-8)
    store.record([failed(SCENE)])
    assert store.get(SCENE) is None
    assert store.find(SCENE).failure == FAILURE
    store.record([make_attempt(SCENE, 0.51)])
    assert store.find(SCENE).failure is None
    store.record([failed(tight)])
    assert (store.get(SCENE).restitution, store.find(tight).failure) == (0.51, FAILURE)
    assert store.find(SCENE).tries == 3


def test_a_failure_stands_for_the_same_and_tighter_tolerances(store):
    store.record([failed(SCENE)])
    standing = store.standing(SCENE)
    assert standing.would_fail(SCENE)
    assert standing.would_fail(SCENE.replace(tolerance=1e-8))
    assert not standing.would_fail(SCENE.replace(tolerance=1e-4))
    store.record([failed(SCENE, Failure("WorkerDiedError", "killed", stands=False))])
    assert not store.standing(SCENE).would_fail(SCENE)


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
    monkeypatch.setattr(store_connection, "SCHEMA_VERSION", len(newer))
    with pytest.raises(StoreError, match="older schema"):
        Store(path, read_only=True)
    with Store(path) as store:
        assert store.get(SCENE).restitution == 0.51
        assert store.select("SELECT colour FROM collisions")[1] == [(None,)]


def test_a_migration_that_fails_changes_nothing(tmp_path, monkeypatch):
    path = tmp_path / "old.sqlite"
    Store(path).close()
    broken = (*MIGRATIONS, ("ALTER TABLE collisions ADD COLUMN colour TEXT", "nonsense"))
    with monkeypatch.context() as patch:
        patch.setattr(store_connection, "MIGRATIONS", broken)
        patch.setattr(store_connection, "SCHEMA_VERSION", len(broken))
        with pytest.raises(sqlite3.OperationalError):
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


@pytest.fixture
def small_disk(tmp_path):
    """Return the folder of a file system of 300 kB; only the administrator can make one."""
    folder = tmp_path / "small"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", str(folder)]
    if shutil.which("mount") is None or os.geteuid() != 0:
        pytest.skip("needs the right to mount a small file system")
    if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("no small file system can be mounted here")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


def test_a_full_disk_is_one_clear_error_and_loses_nothing(small_disk, make_attempt):
    path = small_disk / "results.sqlite"
    scenes = [SCENE.replace(speed=0.001 * k) for k in range(1, 400)]
    written = 0
    with Store(path) as store:
        with pytest.raises(StoreWriteError, match="make room"):  # noqa: PT012
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
        except Exception as error:  # shown by the main thread
            errors.append(error)

    # The parts overlap by half: rows that both write must be there once.
    threads = [threading.Thread(target=write, args=(first,)) for first in (1, 31)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    with Store(path) as store:
        assert len(store) == 90


def test_a_lock_that_does_not_end_is_named(tmp_path, monkeypatch, make_attempt):
    monkeypatch.setattr(store_connection, "LOCK_SECONDS", 0.1)
    path = tmp_path / "results.sqlite"
    with Store(path) as store, contextlib.closing(sqlite3.connect(path)) as other:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(StoreWriteError, match="locked"):
            store.record([make_attempt(SCENE)])


def test_a_failed_transaction_writes_no_row_of_its_batch(store, make_attempt):
    good = make_attempt(SCENE)
    bad = Attempt(Scene(potential=LennardJones()), good.collision, None, "here")
    with pytest.raises(SceneError):
        store.record([good, bad])
    assert len(store) == 0


# ---- merging, asking, exporting -----------------------------------------------------------------


def test_merging_keeps_the_tighter_result_with_its_arrays(tmp_path, make_attempt):
    other = SCENE.replace(speed=0.5)
    paths = [tmp_path / f"{name}.sqlite" for name in "abc"]
    with Store(paths[0]) as store:
        store.record([make_attempt(SCENE, 0.51), failed(other)])
    with Store(paths[1]) as store:
        store.record([make_attempt(SCENE.replace(tolerance=1e-8), 0.52)], arrays=True)
        store.record([make_attempt(other, 0.53)])
    for order in ((0, 1), (1, 0)):
        target = tmp_path / f"merged{order}.sqlite"
        assert merge_stores(target, [paths[k] for k in order]) == 2
        with Store(target) as store:
            assert store.get(SCENE, arrays=True).restitution == 0.52
            assert store.get(SCENE, arrays=True).arrays["contact_times"][1] == 0.52
            assert store.get(other).restitution == 0.53
            assert store.find(other).failure is None
            assert store.get(SCENE).result["versions"]["python"]


def test_merging_twice_changes_nothing(tmp_path, make_attempt):
    source, target = tmp_path / "a.sqlite", tmp_path / "b.sqlite"
    with Store(source) as store:
        store.record([make_attempt(SCENE)], arrays=True)
    merge_stores(target, [source])
    before = target.read_bytes()
    assert merge_stores(target, [source]) == 1
    with Store(target) as store:
        assert store.find(SCENE).tries == 1
    assert len(target.read_bytes()) == len(before)


def test_merging_into_itself_is_refused(tmp_path):
    Store(tmp_path / "a.sqlite").close()
    with pytest.raises(StoreError, match="itself"):
        merge_stores(tmp_path / "a.sqlite", [tmp_path / "a.sqlite"])


def test_questions_with_conditions_and_order(store, make_attempt):
    scenes = [Scene(potential=p, speed=s) for p in ("lj", "toda") for s in (0.1, 0.2, 0.3)]
    store.record([make_attempt(scene) for scene in scenes] + [failed(Scene(potential="log"))])
    rows = query_rows(
        store,
        ["potential", "speed"],
        where=["speed>=0.2", "failure="],
        order=["potential", "-speed"],
    )
    assert rows == [("lj", 0.3), ("lj", 0.2), ("toda", 0.3), ("toda", 0.2)]
    assert count_rows(store, ["failure!="]) == 1
    assert count_rows(store, ["potential = toda", "speed < 0.3"]) == 2
    for wrong in ("nonsense", "colour=red", "speed<"):
        with pytest.raises(StoreError):
            count_rows(store, [wrong])
    with pytest.raises(StoreError, match="no column"):
        query_rows(store, ["speed; DROP TABLE collisions"])


def test_exports_hold_every_row_exactly(store, tmp_path, make_attempt):
    pandas = pytest.importorskip("pandas")
    scenes = [Scene(potential="lj", speed=0.1 * k) for k in range(1, 8)]
    store.record([make_attempt(s, 1.0 / (3 + k)) for k, s in enumerate(scenes)])
    store.record([failed(Scene(potential="log"))])
    export_store(store, tmp_path / "a.csv")
    export_store(store, tmp_path / "a.parquet")
    direct = to_pandas(store)
    from_csv = pandas.read_csv(tmp_path / "a.csv")
    from_parquet = pandas.read_parquet(tmp_path / "a.parquet")
    assert list(direct.columns) == list(PLAIN_COLUMNS)
    for frame in (direct, from_csv, from_parquet):
        assert frame["restitution"].dropna().to_list() == [1.0 / (3 + k) for k in range(7)]
        assert frame["failure"].notna().sum() == 1
    with pytest.raises(StoreError, match=r"\.csv or \.parquet"):
        export_store(store, tmp_path / "a.txt")


@pytest.mark.slow
def test_many_rows_are_asked_in_a_moment(store, make_attempt):
    scenes = [
        Scene(potential="lj", particles=n, speed=0.001 * k)
        for n in range(10, 30)
        for k in range(1, 1001)
    ]
    one = make_attempt(scenes[0])
    # The same result under every key: only the numbers of rows matter here.
    store.record([Attempt(scene, one.collision, None, "here") for scene in scenes])
    started = time.process_time()
    assert all(store.standing(scene).answers(scene) for scene in scenes)
    resumed = time.process_time()
    assert len(query_rows(store, ["particles", "speed", "restitution"], order=["speed"])) == 20_000
    asked = time.process_time()
    # A hundred thousand must take "a few seconds"; measured 1.5 s and 0.3 s for them on one core.
    # A fifth of them, and ten times as long for a busy machine.
    assert resumed - started < 3.0
    assert asked - resumed < 0.6
