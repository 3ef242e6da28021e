"""Test the first cell of a lesson: a new folder, and a shell that finds commands."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.lessons import begin, prepared
from chaincor.workflows.lessons import begin as begin_function


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys.modules[begin_function.__module__], "_home", [])
    for name in ("PATH", "LD_LIBRARY_PATH"):
        monkeypatch.setenv(name, os.environ.get(name, os.defpath))
    return tmp_path


def test_a_cell_run_again_goes_no_deeper_and_overwrites_nothing(home):
    begin("1_lesson")
    assert Path.cwd() == home / "1_lesson_files"
    begin("1_lesson")  # the folder is empty
    assert Path.cwd() == home / "1_lesson_files"
    Path("mine").write_text("1")
    begin("1_lesson")
    # Texts of lessons name this folder, which always belongs to the last run.
    assert Path.cwd() == home / "1_lesson_files"
    assert not list(Path.cwd().iterdir())
    assert (home / "1_lesson_files_earlier" / "mine").read_text() == "1"
    Path("mine").write_text("2")
    begin("1_lesson")
    assert (home / "1_lesson_files_earlier" / "mine").read_text() == "1"
    assert (home / "1_lesson_files_earlier_2" / "mine").read_text() == "2"


def test_the_shell_finds_chaincor_and_lmp(home, monkeypatch):
    monkeypatch.setenv("PATH", os.defpath)
    monkeypatch.setenv("LD_LIBRARY_PATH", "/elsewhere")
    monkeypatch.setenv("FORCE_COLOR", "1")
    begin("1_lesson")
    begin("1_lesson")
    assert os.environ["PATH"].split(os.pathsep).count(str(Path(sys.executable).parent)) == 1
    assert shutil.which("chaincor")
    assert "FORCE_COLOR" not in os.environ
    assert "/elsewhere" in os.environ["LD_LIBRARY_PATH"]
    done = subprocess.run(["lmp", "-help"], capture_output=True, text=True, check=False)
    assert "Large-scale" in done.stdout


def test_a_file_in_the_way(home):
    (home / "1_lesson_files").write_text("in the way")
    with pytest.raises(InputError, match="Open the notebook in a folder where you can write"):
        begin("1_lesson")


def test_there_is_no_such_data():
    with pytest.raises(InputError, match=r"Use one of cor_curves\.csv"):
        prepared("curve.csv")
