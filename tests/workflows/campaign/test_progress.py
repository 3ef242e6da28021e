"""What a run shows on a terminal while it takes long."""

import contextlib
import time

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows import durations
from chaincor.workflows.accuracy.expected_cost import expected_seconds
from chaincor.workflows.campaign import progress
from chaincor.workflows.campaign.progress import show_elapsed
from chaincor.workflows.cli import main


def test_a_long_run_shows_how_long_it_takes(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal, for rich
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(progress, "_QUIET_SECONDS", 0.0)
    shown = ""
    deadline = time.monotonic() + 60.0
    with show_elapsed(7200.0):
        while "of about 2.0 h" not in shown and time.monotonic() < deadline:
            time.sleep(0.05)
            shown += capsys.readouterr().err
    assert "of about 2.0 h" in shown


def test_nothing_is_shown_elsewhere(capsys, monkeypatch):
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setattr(progress, "_QUIET_SECONDS", 0.0)
    with show_elapsed(7200.0):
        time.sleep(0.3)
    assert capsys.readouterr().err == ""


def test_elsewhere_it_writes_a_line_a_minute(capsys):
    line = durations.LineAMinute(seconds=0.0)
    line.tell("3 of 4 done")
    assert capsys.readouterr().err.startswith("chaincor: 3 of 4 done after ")
    line = durations.LineAMinute()
    line.tell("3 of 4 done")
    assert capsys.readouterr().err == ""


def test_a_sweep_tells_a_log_how_far_it_is(capsys, monkeypatch):
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setattr(progress, "LineAMinute", lambda: durations.LineAMinute(seconds=0.0))
    with progress.progress_bar(True, points=4, seconds=10.0) as advance:
        advance(2.0)
        advance(3.0)
    first, second = capsys.readouterr().err.splitlines()
    assert "1 of 4 collisions, 20 % of the work" in first
    assert "2 of 4 collisions, 50 % of the work" in second


def test_the_command_shows_what_its_scene_is_expected_to_take(capsys, monkeypatch):
    told = []

    @contextlib.contextmanager
    def note(expected):
        told.append(expected)
        yield
        told.append("over")

    monkeypatch.setattr(progress, "show_elapsed", note)
    with pytest.raises(SystemExit) as leave:
        main(["run", "--potential", "harmonic", "--particles", "3", "--engine", "reference"])
    assert leave.value.code == 0
    scene = Scene(potential="harmonic", particles=3, engine="reference")
    assert told == [expected_seconds(scene), "over"]
