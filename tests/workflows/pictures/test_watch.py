"""Test that `run --watch` shows the collision in a terminal and nowhere else."""

import io

import pytest
from rich.console import Console

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.pictures import watch as watching
from chaincor.workflows.pictures.recording import follow_to_the_end


def test_the_headings_count_contacts_and_end_with_the_restitution():
    scene = Scene(particles=6, speed=0.4, engine="reference")
    result = collide(scene)
    outcome = follow_to_the_end(result)
    headings = [m.plain.splitlines()[0].split() for m in watching.moments(scene, outcome, 60)]
    contacts = [int(words[4]) for words in headings]
    assert contacts == sorted(contacts)
    assert contacts[-1] == result.contacts
    # The motion has a tolerance of 1e-6; eta is shown to a tenth of a per cent.
    assert float(headings[-1][6]) == pytest.approx(100.0 * result.restitution, abs=0.06)


def test_it_draws_in_a_terminal(chaincor, monkeypatch):
    monkeypatch.setattr(watching, "_SECONDS", 0.2)
    monkeypatch.setattr(watching, "find_terminal", lambda: console)
    drawn = io.StringIO()
    console = Console(file=drawn, force_terminal=True, width=70)
    status, out, err = chaincor("run", "--particles", "5", "--engine", "reference", "--watch")
    assert status == 0, err
    # In 0.2 s, three pictures are drawn, and the last is drawn again. A busy machine skips some
    # pictures.
    assert 1 <= drawn.getvalue().count("contacts") <= 4
    assert "restitution" in out


def test_without_a_terminal_nothing_runs(chaincor, monkeypatch):
    monkeypatch.setattr("chaincor.workflows.collision.collide", None)  # calling it would raise
    status, _, err = chaincor("run", "--watch")
    assert status == 2
    assert "--animate" in err
