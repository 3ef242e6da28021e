"""Test several stores that are read as one: shards, copies, and common rows."""

import shutil

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.export import export_store, to_pandas
from chaincor.workflows.store.merge import merge_stores
from chaincor.workflows.store.query import count_rows, query_rows
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.store_set import find_stores, open_stores

SCENES = [Scene(potential=p, speed=0.1 * k) for p in ("lj", "toda") for k in range(1, 7)]
COLUMNS = ("potential", "speed", "restitution", "tolerance", "tolerance_met", "failure")


@pytest.fixture
def shards(tmp_path, make_attempt, make_failure):
    """Return three shards of 12 collisions, the last of which failed."""
    folder = tmp_path / "s.shards"
    folder.mkdir()
    attempts = [make_attempt(scene, 0.5 + 0.01 * k) for k, scene in enumerate(SCENES[:-1])]
    attempts.append(make_failure(SCENES[-1]))
    for part in range(3):
        with Store(folder / f"{part + 1}-of-3.sqlite") as store:
            store.record(attempts[part::3])
    return folder


def merged(tmp_path, paths):
    target = tmp_path / "merged.sqlite"
    target.unlink(missing_ok=True)
    merge_stores(target, find_stores(paths))
    return target


@pytest.mark.parametrize(
    ("where", "order", "limit"),
    [
        ((), ("potential", "speed"), None),
        ((), ("-restitution",), 3),
        ((), ("restitution",), 5),
        (("speed>0.25", "potential=toda"), ("-potential", "speed"), None),
        (("failure!=",), (), None),
        (("restitution>2",), ("speed",), 1),
    ],
)
def test_shards_are_read_as_their_merged_store_is(tmp_path, shards, where, order, limit):
    with Store(merged(tmp_path, [shards])) as store, open_stores([shards]) as several:
        asked = {"where": where, "order": order, "limit": limit}
        assert query_rows(several, COLUMNS, **asked) == query_rows(store, COLUMNS, **asked)
        assert count_rows(several, where) == count_rows(store, where)


def test_a_row_of_several_stores_is_that_of_a_merge(tmp_path, shards, make_attempt):
    better = make_attempt(SCENES[0].replace(tolerance=1e-9), 0.7, 1e-10)
    worse = make_attempt(SCENES[1].replace(tolerance=1e-9), 0.8, 1e-2)
    with Store(tmp_path / "other.sqlite") as other:
        other.record([better, worse, make_attempt(SCENES[-1], 0.9)])
    paths = [tmp_path / "other.sqlite", shards]
    order = ("potential", "speed")
    with Store(merged(tmp_path, paths)) as store, open_stores(paths) as several:
        expected = query_rows(store, COLUMNS, order=order)
        assert query_rows(several, COLUMNS, order=order) == expected
        assert count_rows(several) == len(SCENES)
        assert count_rows(several, ["failure!="]) == 0
        # A limit counts the rows that are read, not the hidden ones.
        assert query_rows(several, COLUMNS, order=order, limit=2) == expected[:2]


def test_a_copy_of_a_store_adds_nothing(tmp_path, shards):
    for path in find_stores([shards]):
        shutil.copy(path, shards / f"copy-{path.name}")
    with open_stores([shards]) as several:
        assert count_rows(several) == len(SCENES)


def test_shards_are_exported_as_their_merged_store_is(tmp_path, shards):
    with open_stores([shards]) as several:
        assert export_store(several, tmp_path / "a.csv") == len(SCENES)
        assert export_store(several, tmp_path / "parts.csv", 5) == len(SCENES)
    with Store(merged(tmp_path, [shards])) as store:
        export_store(store, tmp_path / "b.csv")
    whole = (tmp_path / "a.csv").read_text()
    assert whole == (tmp_path / "b.csv").read_text()
    parts = [path.read_text().splitlines() for path in sorted((tmp_path / "parts.csv").iterdir())]
    assert [len(part) - 1 for part in parts] == [5, 5, 2]
    head, *rows = whole.splitlines()
    assert [line for part in parts for line in part[1:]] == rows
    assert {part[0] for part in parts} == {head}


def test_parts_of_parquet_hold_the_rows_of_the_data_frame(tmp_path, shards):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    with open_stores([shards]) as several:
        export_store(several, tmp_path / "parts.parquet", 5)
    frame = to_pandas(shards)
    read = pandas.read_parquet(tmp_path / "parts.parquet")
    assert list(read.columns) == list(frame.columns)
    for name in frame.columns:
        values = [
            list(table[name].astype(object).where(table[name].notna(), None))
            for table in (read, frame)
        ]
        assert values[0] == values[1], name


def test_an_export_in_parts_needs_a_new_folder(chaincor, tmp_path, shards):
    (tmp_path / "a.csv").mkdir()
    status, out, err = chaincor(
        "store", "export", shards, tmp_path / "a.csv", "--rows-per-file", "5"
    )
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "exists. Give a new folder" in err


def test_commands_read_shards(chaincor, tmp_path, shards):
    status, out, _ = chaincor("show", shards, "--limit", "2")
    assert (status, out.splitlines()[-1]) == (0, "2 of 12 rows; --limit 0 shows all")
    one, two, three = find_stores([shards])
    status, out, _ = chaincor("show", one, two, three, "--limit", "2")
    assert (status, out.splitlines()[-1]) == (0, "2 of 12 rows; --limit 0 shows all")
    assert chaincor("plot", shards)[:2] == (0, f"{tmp_path / 's.png'}\n")
    target = tmp_path / "all.sqlite"
    status, out, _ = chaincor("store", "merge", target, shards)
    assert status == 0
    assert out.startswith(f"{target}: 12 rows (12 added, 0 replaced by better ones")


def test_a_folder_without_stores_is_named(tmp_path):
    with pytest.raises(StoreError, match=r"has no store \*\.sqlite\. Give a folder of shards"):
        find_stores([tmp_path])
