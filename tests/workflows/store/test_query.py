"""Test merging, querying and exporting stores."""

import contextlib
import sys

import numpy as np
import pytest
from rocrate.rocrate import ROCrate

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import MissingLibraryError, StoreError
from chaincor.workflows.research_object import METADATA_FILE
from chaincor.workflows.store.export import export_crate, export_store, to_pandas
from chaincor.workflows.store.merge import merge_stores
from chaincor.workflows.store.query import count_rows, query_rows
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.schema import PLAIN_COLUMNS

SCENE = Scene(potential="lj", particles=10, speed=0.4, tolerance=1e-6)


def test_merging_keeps_the_tighter_result_with_its_arrays(tmp_path, make_attempt, make_failure):
    other = SCENE.replace(speed=0.5)
    paths = [tmp_path / f"{name}.sqlite" for name in "abc"]
    with Store(paths[0]) as store:
        store.record([make_attempt(SCENE, 0.51), make_failure(other)])
    with Store(paths[1]) as store:
        store.record([make_attempt(SCENE.replace(tolerance=1e-8), 0.52)], arrays=True)
        store.record([make_attempt(other, 0.53)])
    for order in ((0, 1), (1, 0)):
        target = tmp_path / f"merged{order}.sqlite"
        assert merge_stores(target, [paths[k] for k in order]).rows == 2
        with Store(target) as store:
            assert store.get(SCENE, arrays=True).restitution == 0.52
            assert store.get(SCENE, arrays=True).arrays["contact_times"][1] == 0.52
            assert store.get(other).restitution == 0.53
            assert store.find(other).failure is None
            assert store.get(SCENE).result["versions"]["python"]


def test_merging_says_how_many_rows_were_added_replaced_and_kept(tmp_path, make_attempt, chaincor):
    target, source = tmp_path / "a.sqlite", tmp_path / "b.sqlite"
    speeds = [SCENE.replace(speed=0.1 * k) for k in range(1, 5)]
    with Store(target) as store:
        store.record([make_attempt(speeds[0]), make_attempt(speeds[1].replace(tolerance=1e-8))])
        store.record([make_attempt(speeds[2])])
    with Store(source) as store:
        store.record([make_attempt(speeds[0].replace(tolerance=1e-8)), make_attempt(speeds[1])])
        store.record([make_attempt(speeds[2]), make_attempt(speeds[3])])
    status, out, _ = chaincor("store", "merge", target, source)
    assert status == 0
    said = "4 rows (1 added, 1 replaced by better ones, 1 equal, 1 kept as better ones)"
    assert out.strip() == f"{target}: {said}"


def test_merging_twice_changes_nothing(tmp_path, make_attempt):
    source, target = tmp_path / "a.sqlite", tmp_path / "b.sqlite"
    with Store(source) as store:
        store.record([make_attempt(SCENE)], arrays=True)
    merge_stores(target, [source])
    before = target.read_bytes()
    merged = merge_stores(target, [source])
    assert merged == (1, 0, 0, 1, 0)
    with Store(target) as store:
        assert store.find(SCENE).columns["tries"] == 1
    assert len(target.read_bytes()) == len(before)


def test_merging_into_itself_is_refused(tmp_path):
    Store(tmp_path / "a.sqlite").close()
    with pytest.raises(StoreError, match="itself"):
        merge_stores(tmp_path / "a.sqlite", [tmp_path / "a.sqlite"])


def test_questions_with_conditions_and_order(store, make_attempt, make_failure):
    scenes = [Scene(potential=p, speed=s) for p in ("lj", "toda") for s in (0.1, 0.2, 0.3)]
    store.record([make_attempt(scene) for scene in scenes] + [make_failure(Scene(potential="log"))])
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


@pytest.mark.parametrize("condition", ["speed<0,15", "speed>fast", "particles!=ten", "speed<nan"])
def test_a_column_of_numbers_is_compared_with_numbers_only(store, make_attempt, condition):
    # In SQLite, a word is greater than all numbers. Each of these conditions would select every row
    # or no row.
    store.record([make_attempt(SCENE)])
    with pytest.raises(StoreError, match="Give a number"):
        count_rows(store, [condition])


def test_words_and_flags_are_compared_as_they_are_written(store, make_attempt):
    store.record([make_attempt(SCENE)])
    # Text columns are compared as text. As a number, the year would become text such as '1000.0',
    # which sorts after the dates of this year.
    (year,) = {row[0][:4] for row in query_rows(store, ["finished"])}
    for condition in (f"finished>{year}", f"finished>={year}", "host!=2e3", "tolerance_met=true"):
        assert count_rows(store, [condition]) == 1, condition
    assert count_rows(store, [f"finished<{year}"]) == 0
    assert count_rows(store, ["tolerance_met=FALSE"]) == 0


def test_exports_hold_every_row_exactly(store, tmp_path, make_attempt, make_failure):
    pandas = pytest.importorskip("pandas")
    scenes = [Scene(potential="lj", speed=0.1 * k) for k in range(1, 8)]
    store.record([make_attempt(s, 1.0 / (3 + k)) for k, s in enumerate(scenes)])
    store.record([make_failure(Scene(potential="log"))])
    export_store(store, tmp_path / "a.csv")
    export_store(store, tmp_path / "a.parquet")
    direct = to_pandas(store)
    # pandas before version 3 reads numbers with an error in the last digit.
    from_csv = pandas.read_csv(tmp_path / "a.csv", dtype={"restitution": str})
    from_csv["restitution"] = from_csv["restitution"].map(float)
    from_parquet = pandas.read_parquet(tmp_path / "a.parquet")
    assert list(direct.columns) == list(PLAIN_COLUMNS)
    for frame in (
        direct,
        from_csv,
        from_parquet,
        to_pandas(str(store.path)),
        to_pandas(store.path),
    ):
        assert frame["restitution"].dropna().to_list() == [1.0 / (3 + k) for k in range(7)]
        assert frame["failure"].notna().sum() == 1
    with pytest.raises(StoreError, match="nowhere"):
        to_pandas(tmp_path / "nowhere.sqlite")
    with pytest.raises(StoreError, match=r"\.csv or \.parquet"):
        export_store(store, tmp_path / "a.txt")


def test_a_crate_says_what_it_holds_and_what_made_it(tmp_path, make_attempt):
    with Store(tmp_path / "a.sqlite") as store:
        store.record([make_attempt(SCENE)])
        for _ in range(2):  # an earlier export is replaced
            assert export_crate(store, tmp_path / "crate") == 1
    crate = ROCrate(tmp_path / "crate")
    (table,) = crate.data_entities
    header, _row = (tmp_path / "crate" / table.id).read_text().splitlines()
    columns = {e["name"]: e["description"] for e in crate.get_by_type("PropertyValue")}
    assert list(columns) == header.split(",")
    assert "ratio of the final to the initial kinetic energy" in columns["restitution"]
    software = {e["name"]: e["softwareVersion"] for e in crate.get_by_type("SoftwareApplication")}
    assert software["numpy"] == np.__version__
    (computation,) = crate.get_by_type("CreateAction")
    assert computation["result"] == table


def test_the_crate_of_something_else_stays(tmp_path, make_attempt):
    (tmp_path / METADATA_FILE).write_text("{}")
    with Store(tmp_path / "a.sqlite") as store, pytest.raises(InputError, match="of other data"):
        export_crate(store, tmp_path)
    assert (tmp_path / METADATA_FILE).read_text() == "{}"


def test_a_crate_without_the_library_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rocrate.rocrate", None)
    with (
        Store(tmp_path / "a.sqlite") as store,
        pytest.raises(MissingLibraryError, match=r"pip install chaincor\[crate\]"),
    ):
        export_crate(store, tmp_path / "crate")
    assert not (tmp_path / "crate").exists()


def test_many_rows_are_asked_in_a_moment(store, make_attempt):
    # The test counts SQLite's instructions instead of measuring time. To find a row costs the same
    # among four thousand rows as among four hundred. A sorted list of all n rows costs n log n.
    scenes = [
        Scene(potential="lj", particles=n, speed=0.001 * k)
        for n in range(10, 30)
        for k in range(1, 201)
    ]
    one = make_attempt(scenes[0])
    columns = ["particles", "speed", "restitution"]
    counts = []
    for part in (scenes[:400], scenes[400:]):
        # Every row has the same result, because only the number of rows matters here.
        store.record([(scene, one.row) for scene in part])
        with _instructions(store) as alone:
            assert store.standings(scenes[:1])[0].answers(scenes[0])
        with _instructions(store) as whole:
            assert len(query_rows(store, columns, order=["speed"])) == len(store)
        counts.append((len(alone), len(whole) / len(store)))
    (alone_few, each_few), (alone_many, each_many) = counts
    # An index may be a page deeper; log 4000 / log 400 is 1.4.
    assert alone_many <= alone_few + 10
    assert each_many < 1.5 * each_few


@contextlib.contextmanager
def _instructions(store):
    """Yield a list that grows by one with each instruction of SQLite's virtual machine."""
    done = []
    store.connection.set_progress_handler(lambda: done.append(None), 1)
    yield done
    store.connection.set_progress_handler(None, 0)
