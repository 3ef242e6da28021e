"""Test that no command overwrites its inputs or files of others."""

import os
import re

import numpy as np
import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.outputs import refuse_overwriting_inputs
from chaincor.workflows.store.results_store import Store


@pytest.mark.parametrize("link", [os.link, os.symlink, None])
def test_an_input_is_refused_as_output_under_any_name(tmp_path, link):
    read, written = tmp_path / "read", tmp_path / "written"
    read.write_text("mine")
    for fine in (tmp_path / "new", tmp_path / "no folder" / "new"):
        refuse_overwriting_inputs(fine, [read, tmp_path / "not there"], "--output")
    if link is None:
        written = tmp_path / "." / ".." / tmp_path.name / "read"
    else:
        link(read, written)
    with pytest.raises(InputError, match=r"--output is '.*', .*which is an input of this command"):
        refuse_overwriting_inputs(written, [tmp_path / "not there", read], "--output")


@pytest.mark.parametrize(
    ("command", "name"),
    [
        (("plot", "STORE", "-o", "OTHER"), "a.png"),
        (("plot", "STORE", "-o", "OTHER"), "a.svg"),
        (("store", "export", "STORE", "OTHER"), "a.csv"),
        (("store", "export", "STORE", "OTHER"), "a.parquet"),
        (("explore", "-o", "OTHER"), "scene.json"),
    ],
)
def test_files_of_another_kind_stay(tmp_path, chaincor, make_attempt, command, name):
    from chaincor.lammps_inputs.scene import Scene

    store, other = tmp_path / "s.sqlite", tmp_path / name
    with Store(store) as opened:
        opened.record([make_attempt(Scene(particles=n)) for n in (2, 3)])
    places = {"STORE": store, "OTHER": other}

    def run():
        status, _, err = chaincor(*(places.get(word, word) for word in command))
        return status, err

    other.write_text("mine")
    status, error = run()
    assert (status, error.count("\n"), other.read_text()) == (2, 1, "mine")
    assert "holds something else" in error
    other.unlink()
    for _ in range(2):  # a command replaces its own output
        assert run() == (0, "")


THROUGH = "nodir/../../me/.bashrc"


@pytest.mark.parametrize("through", [THROUGH, "link/.bashrc", "here/../../me/.bashrc"])
@pytest.mark.parametrize(
    "command",
    [
        ("run", "--particles", "2", "--engine", "lammps", "--dump"),
        ("run", "--particles", "2", "--engine", "reference", "--arrays"),
        ("explore", "-o"),
    ],
)
def test_a_path_through_other_folders_replaces_nothing(
    tmp_path, chaincor, monkeypatch, command, through
):
    (tmp_path / "me").mkdir()
    own, here = tmp_path / "me" / ".bashrc", tmp_path / "here"
    own.write_text("mine")
    here.mkdir()
    (here / "link").symlink_to(tmp_path / "me")
    (here / "here").mkdir()
    monkeypatch.chdir(here)
    status, out, err = chaincor(*command, through)
    assert (status, out, err.count("\n"), own.read_text()) == (2, "", 1, "mine")
    assert "holds something else" in err
    assert not (here / "nodir").exists()


def test_a_store_is_not_exported_through_a_missing_folder(tmp_path, chaincor, monkeypatch):
    Store(tmp_path / "s.sqlite").close()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.csv").write_text("x,y\n1,2\n")
    status, out, err = chaincor("store", "export", "s.sqlite", "nodir/../own.csv")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert (tmp_path / "own.csv").read_text() == "x,y\n1,2\n"


@pytest.mark.parametrize(
    ("command", "name"),
    [
        (("table", "t.table", "--write", "nodir/../mine/own"), "own"),
        (("lessons", "-o", "nodir/../mine"), "1_first_collision.ipynb"),
        (("inputs", "--particles", "2", "-o", "nodir/../mine"), "in.chain"),
        (("inputs", "sweep.toml", "-o", "nodir/../mine"), "manifest.csv"),
    ],
)
def test_new_files_replace_nothing_through_a_missing_folder(
    tmp_path, chaincor, monkeypatch, command, name
):
    monkeypatch.chdir(tmp_path)
    lengths = np.linspace(0.9, 1.1, 21)
    rows = [f"{n} {r:.17g} {(r - 1) ** 2:.17g} {2 - 2 * r:.17g}" for n, r in enumerate(lengths, 1)]
    (tmp_path / "t.table").write_text("T\nN 21\n\n" + "\n".join(rows) + "\n")
    (tmp_path / "sweep.toml").write_text("[axes]\nparticles = [2]\n")
    (tmp_path / "mine").mkdir()
    own = tmp_path / "mine" / name
    own.write_text("mine")
    status, _, err = chaincor(*command)
    assert (status, err.count("\n"), own.read_text()) == (2, 1, "mine")
    assert re.search(rf"{name}'?( exists)? already", err)
    assert [path.name for path in (tmp_path / "mine").iterdir()] == [name]


@pytest.mark.parametrize("written", [".", "nodir/..", "link"])
def test_a_scene_of_ones_own_is_not_replaced_by_the_job_of_its_run(
    tmp_path, chaincor, monkeypatch, written
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "link").symlink_to(tmp_path)
    own = tmp_path / "scene.toml"
    own.write_text("# mine\nparticles = 2\n")
    status, out, err = chaincor("run", "scene.toml", "--save", written)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert {path.name for path in tmp_path.iterdir()} == {"link", "scene.toml"}
    assert own.read_text() == "# mine\nparticles = 2\n"


def test_a_saved_job_that_was_edited_stays(tmp_path, chaincor):
    job = tmp_path / "job"
    run = ("run", "--potential", "harmonic", "--particles", "2", "--velocity", "0.1", "--save", job)
    assert chaincor(*run)[0] == 0
    assert chaincor(*run)[0] == 0
    # LAMMPS replaces its log whenever the job is run.
    (job / "log.lammps").write_text("LAMMPS\n")
    assert chaincor(*run)[0] == 0
    edited = (job / "in.chain").read_text() + "# mine\n"
    (job / "in.chain").write_text(edited)
    status, out, err = chaincor(*run)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert (job / "in.chain").read_text() == edited


@pytest.mark.parametrize(
    ("command", "name"),
    [
        (("timestep", "SCRIPT", "etotal:drift", "-o", "DIR"), "runs.csv"),
        (("tradeoff", "--particles", "2", "--quick", "-o", "DIR"), "error_budget.csv"),
    ],
)
def test_a_report_replaces_no_table_of_ones_own(tmp_path, chaincor, command, name):
    script = tmp_path / "in.script"
    script.write_text("units lj\n")
    own = tmp_path / name
    own.write_text("mine")
    places = {"SCRIPT": script, "DIR": tmp_path}
    status, out, err = chaincor(*(places.get(word, word) for word in command))
    assert (status, out, err.count("\n"), own.read_text()) == (2, "", 1, "mine")
    assert f"holds files of something else ({name})" in err


@pytest.mark.parametrize("command", [("plot",), ("store", "export")])
@pytest.mark.parametrize("suffix", [".png", ".csv"])
def test_the_store_itself_stays(tmp_path, chaincor, command, suffix):
    store = tmp_path / f"s{suffix}"
    Store(store).close()
    before = store.read_bytes()
    target = [] if command == ("plot",) else [store]
    status, _, err = chaincor(*command, store, *target)
    assert (status, store.read_bytes()) == (2, before)
    if (command == ("plot",)) == (suffix == ".png"):
        assert "which is an input of this command" in err


def test_a_file_in_place_of_the_folder_of_jobs_is_refused_before_the_store(
    tmp_path, chaincor, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text("[axes]\nparticles = [2]\n")
    (tmp_path / "mine").write_text("mine")
    status, out, err = chaincor("sweep", "s.toml", "--workers", "1", "--keep-jobs", "mine")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "is a file. Give another path" in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "s.toml"]
