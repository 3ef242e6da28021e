"""Test that outputs of a collision replace only its own earlier files."""

import os

import pytest

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


def test_a_device_is_no_file_to_be_replaced(tmp_path):
    # Otherwise, root would replace /dev/null by a file.
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="because it is a device"), written_aside(pipe):
        pass
    with pytest.raises(InputError, match="because it is a device"):
        collide(IN_HOUSE.replace(arrays=pipe))
    assert not pipe.is_file()
