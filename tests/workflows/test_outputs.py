"""Test that outputs of a collision replace only its own earlier files."""

import os

import numpy as np
import pytest

from chaincor import Store, check_table, find_job, to_pandas, write_job
from chaincor.analysis.atomic_write import written_aside
from chaincor.analysis.output_paths import judge_output
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide

BY_LAMMPS = Scene(potential="harmonic", particles=5, velocity=0.1)
IN_HOUSE = BY_LAMMPS.replace(engine="reference")


@pytest.mark.parametrize(("scene", "key"), [(BY_LAMMPS, "dump"), (IN_HOUSE, "arrays")])
def test_the_same_run_replaces_its_file_and_no_other_kind(tmp_path, scene, key):
    path = tmp_path / "out"
    path.touch()  # nothing is lost if an empty file is replaced
    collide(scene.replace(**{key: path}))
    first = path.read_bytes()
    collide(scene.replace(**{key: path}, velocity=0.2))
    assert path.read_bytes() != first
    path.write_text("particles = 5\n")
    with pytest.raises(InputError, match="holds something else"):
        collide(scene.replace(**{key: path}))
    assert path.read_text() == "particles = 5\n"


def test_two_outputs_are_two_files(tmp_path):
    with pytest.raises(InputError, match="dump and arrays have the same path"):
        collide(BY_LAMMPS.replace(dump=tmp_path / "out", arrays=tmp_path / "out"))
    assert not list(tmp_path.iterdir())


def test_a_saved_job_is_replaced_by_the_same_collision_alone(tmp_path):
    kept = BY_LAMMPS.replace(save=tmp_path)
    collide(kept)
    collide(kept.replace(tolerance=1e-7))
    files = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(InputError, match=r"files of something else \(in\.chain, "):
        collide(kept.replace(particles=6))
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == files


def test_a_scene_of_ones_own_is_not_replaced_by_that_of_a_job(tmp_path):
    (tmp_path / "scene.toml").write_text("# not a scene yet\n")
    with pytest.raises(InputError, match=r"files of something else \(scene\.toml\)"):
        collide(BY_LAMMPS.replace(save=tmp_path))
    assert (tmp_path / "scene.toml").read_text() == "# not a scene yet\n"


@pytest.mark.parametrize(
    ("name", "other", "own"),
    [
        ("a.gif", b"\0\0\0\x20ftypisom", b"GIF89a"),
        ("a.mp4", b"GIF89a", b"\0\0\0\x20ftypisom"),
    ],
)
def test_films_are_distinguished(tmp_path, name, other, own):
    path = tmp_path / name
    judge_output(path, path.suffix)
    path.write_bytes(own)
    judge_output(path, path.suffix)
    path.write_bytes(other)
    with pytest.raises(InputError, match="holds something else"):
        judge_output(path, path.suffix)


@pytest.mark.parametrize(
    ("kind", "own"),
    [
        ("dump", b"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: ATOMS id x vx\n1 0 0\n"),
        ("arrays", b"PK\x03\x04" + bytes(26) + b"word/document.xml"),
        ("xyz", b"2\nProperties=species:S:1:pos:R:3\nAr 0 0 0\nAr 1 0 0\n"),
        ("results", b"potential,energy\n1,2\n"),
        (".html", b"<!doctype html>\n<title>My page</title>\n"),
        (".png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR photo"),
        (".pdf", b"%PDF-1.5\n%\xbf\xf7\xa2\xfe\n1 0 obj\n"),
        (".svg", b'<?xml version="1.0"?>\n<svg xmlns="http://www.w3.org/2000/svg"/>\n'),
    ],
)
def test_a_file_of_ones_own_in_the_same_format_stays(tmp_path, kind, own):
    path = tmp_path / "own"
    path.write_bytes(own)
    with pytest.raises(InputError, match="holds something else"):
        judge_output(path, kind)


@pytest.mark.parametrize("path", [True, 3, b"a", "a\0b", np.array(2), None, object()])
@pytest.mark.parametrize(
    "function",
    [
        check_table,
        find_job,
        to_pandas,
        Store,
        lambda path: write_job(BY_LAMMPS, path, plain=True),
        lambda path: collide([], store=path or 5),
    ],
)
def test_what_is_no_path_is_refused(function, path):
    with pytest.raises(InputError, match=r"is .*\. Give a path"):
        function(path)


@pytest.mark.parametrize("command", [("show",), ("store", "merge"), ("collect", ".", "-o")])
def test_a_store_whose_name_is_too_long_is_bad_input(tmp_path, chaincor, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "manifest.csv").write_text("folder,refusal\nnone,no job\n")
    Store("s.sqlite").close()
    status, out, err = chaincor(*command, "x" * 300, *(["s.sqlite"] if "merge" in command else []))
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "Give another path" in err


@pytest.mark.parametrize("limit", [10**400, float("nan"), True, "1", None])
def test_a_time_limit_is_a_number(limit):
    with pytest.raises(InputError, match=r"the time limit is .*Give a number"):
        collide(IN_HOUSE, most_seconds=limit)


def test_a_device_is_no_file_to_be_replaced(tmp_path):
    # Otherwise, root would replace /dev/null by a file.
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="because it is a device"), written_aside(pipe):
        pass
    with pytest.raises(InputError, match="because it is a device"):
        collide(IN_HOUSE.replace(arrays=pipe))
    assert not pipe.is_file()
