"""No command writes over what it reads, or over what is none of its own."""

import os

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
    with pytest.raises(InputError, match=r"--output is '.*', .*which this command reads"):
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
    for _ in range(2):  # its own it replaces
        assert run() == (0, "")


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
        assert "which this command reads" in err
