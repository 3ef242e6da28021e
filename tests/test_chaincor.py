"""Test that every public name exists, and that other files of our folders' names do no harm."""

import subprocess
import sys

import pytest

import chaincor


@pytest.mark.parametrize("name", chaincor.__all__)
def test_each_name_leads_to_its_definition(name):
    assert getattr(chaincor, name).__name__ == name
    assert name in dir(chaincor)


def test_a_name_that_is_not_there_is_named():
    with pytest.raises(AttributeError, match="no attribute 'colide'"):
        chaincor.colide  # noqa: B018


def test_python_m_chaincor_is_the_command_line():
    done = subprocess.run(
        [sys.executable, "-m", "chaincor", "--help"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "tradeoff" in done.stdout
    assert done.stdout.startswith("Usage: chaincor ")


# The user's script is in a folder with files that have the names of our folders.
_SCRIPT = """
import analysis, lammps_inputs, workflows
from chaincor import Scene, collide
result = collide(Scene(particles=5, speed=0.4, engine="reference"))
print(analysis.MINE, lammps_inputs.MINE, workflows.MINE, result.contacts)
"""


def test_a_script_beside_an_analysis_of_its_own(tmp_path):
    for name in ("analysis", "lammps_inputs", "workflows"):
        (tmp_path / f"{name}.py").write_text("MINE = 'mine'\n")
    (tmp_path / "script.py").write_text(_SCRIPT)
    done = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[:3] == ["mine"] * 3
    assert int(done.stdout.split()[3]) > 0
