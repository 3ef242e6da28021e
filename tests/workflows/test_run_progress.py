"""What a run shows on a terminal while it takes long."""

import time

from chaincor.workflows import run_progress
from chaincor.workflows.run_progress import show_elapsed


def test_a_long_run_shows_how_long_it_takes(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal, for rich
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(run_progress, "_QUIET_SECONDS", 0.0)
    shown = ""
    deadline = time.monotonic() + 60.0
    with show_elapsed(7200.0):
        while "of about 2.0 h" not in shown and time.monotonic() < deadline:
            time.sleep(0.05)
            shown += capsys.readouterr().err
    assert "of about 2.0 h" in shown


def test_nothing_is_shown_elsewhere(capsys, monkeypatch):
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setattr(run_progress, "_QUIET_SECONDS", 0.0)
    with show_elapsed(7200.0):
        time.sleep(0.3)
    assert capsys.readouterr().err == ""
