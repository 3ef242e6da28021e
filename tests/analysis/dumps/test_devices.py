"""Test that devices and pipes, whose contents may never end, are refused at once."""

import os
import shutil
import sys

import pytest

from tests.extremes.materials import materials

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such files")


@pytest.fixture(params=["zero", "pipe"])
def endless(request, tmp_path):
    """Return a path whose contents never end."""
    if request.param == "zero":
        return "/dev/zero"
    os.mkfifo(tmp_path / "pipe")
    return str(tmp_path / "pipe")


@pytest.fixture
def job(tmp_path):
    """Return the folder of a job that has run and left its dump."""
    folder = tmp_path / "job"
    folder.mkdir()
    for name, content in materials().job.items():
        (folder / name).write_bytes(content)
    return folder


@pytest.mark.parametrize("option", ["--dump", "--data"])
def test_a_device_is_no_file_of_a_job(chaincor, endless, job, option):
    status, out, err = chaincor("analyze", str(job), option, endless)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert "device" in err or "no plain file" in err


@pytest.mark.parametrize("suffix", ["", ".csv", ".npz"])
def test_a_device_is_no_result_of_another_program(chaincor, endless, tmp_path, suffix):
    place = tmp_path / f"result{suffix}"
    place.symlink_to(endless)
    status, _, err = chaincor("validate", "--against", str(place), "--particles", "3")
    assert status == 2
    assert err.count("\n") == 1


@pytest.mark.parametrize("name", ["log.lammps", "manifest.csv"])
def test_a_device_in_a_grid_is_no_log_or_manifest(chaincor, endless, job, tmp_path, name):
    grid = tmp_path / "grid"
    point = grid / "0001"
    point.mkdir(parents=True)
    for scene in ("asked.toml", "scene.toml"):
        shutil.copy(job / "scene.toml", point / scene)
    (grid / "manifest.csv").write_text("number,folder,particles,refusal\n1,0001,3,\n")
    place = grid / name if name == "manifest.csv" else point / name
    place.unlink(missing_ok=True)
    place.symlink_to(endless)
    status, out, err = chaincor("collect", str(grid), "-o", str(tmp_path / "s.sqlite"))
    assert status in (1, 2)
    assert "Traceback" not in err
    assert "it is no plain file" in out + err or "cannot be read" in out + err or "has no" in err
