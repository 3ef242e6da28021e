"""Test the progress display of a long run on a terminal."""

import contextlib
import time
from functools import partial

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.plan import plan
from chaincor.workflows.campaign import progress
from chaincor.workflows.campaign.progress import show_elapsed
from chaincor.workflows.engines.reference.loops.processes import COMPILING, compiling_loop


def test_a_long_run_shows_how_long_it_takes(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal, for rich
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(progress, "_QUIET_SECONDS", 0.0)
    shown = ""
    deadline = time.monotonic() + 60.0
    with show_elapsed(7200.0):
        while "about 2.0 h expected" not in shown and time.monotonic() < deadline:
            time.sleep(0.05)
            shown += capsys.readouterr().err
    assert "about 2.0 h expected" in shown


def test_a_first_run_says_that_it_compiles(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(progress, "_QUIET_SECONDS", 0.0)
    shown = ""
    deadline = time.monotonic() + 60.0
    with compiling_loop(), show_elapsed(0.01):
        while "compiling loops" not in shown and time.monotonic() < deadline:
            time.sleep(0.05)
            shown += capsys.readouterr().err
    assert "compiling loops, as the first run of a kind of bond does" in shown
    assert "were expected" not in shown
    assert not COMPILING.is_set()


def test_what_is_known_of_a_long_run():
    printed = progress._time_text
    long = "at least 110 s, perhaps several times that"
    assert printed(30.0, 113.0, long, "30 s") == f"30 s, {long} expected"
    late = "3.3 min, 110 s were expected; how much longer is not known"
    assert printed(200.0, 113.0, long, "3.3 min") == late
    short = "4 s, of which the collision itself needs about 0.03 s"
    assert printed(4.0, 0.03, "about 0.03 s", "4 s") == short


def test_a_run_that_is_stopped_says_what_is_known(capsys, monkeypatch):
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    with pytest.raises(KeyboardInterrupt), show_elapsed(113.0, at_least=True):
        raise KeyboardInterrupt
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("chaincor: no number yet after ")
    assert "(expected: at least 110 s, perhaps several times that): a larger tolerance" in line


def test_nothing_is_shown_elsewhere(capsys, monkeypatch):
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setattr(progress, "_QUIET_SECONDS", 0.0)
    with show_elapsed(7200.0):
        time.sleep(0.3)
    assert capsys.readouterr().err == ""


def test_elsewhere_it_writes_a_line_a_minute(capsys):
    line = progress.LineEveryMinute(seconds=0.0)
    line.tell("3 of 4 done")
    assert capsys.readouterr().err.startswith("chaincor: 3 of 4 done after ")
    line = progress.LineEveryMinute()
    line.tell("3 of 4 done")
    assert capsys.readouterr().err == ""


def test_a_sweep_tells_a_log_how_far_it_is(capsys, monkeypatch):
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setattr(progress, "LineEveryMinute", partial(progress.LineEveryMinute, seconds=0.0))
    with progress.progress_bar(True, points=4, seconds=10.0) as advance:
        advance(2.0, 1)
        advance(3.0, 1)
    first, second = capsys.readouterr().err.splitlines()
    assert "1 of 4 collisions, 20 % of the work" in first
    assert "2 of 4 collisions, 50 % of the work" in second


def test_the_command_shows_what_its_scene_is_expected_to_take(chaincor, monkeypatch):
    printed = []

    @contextlib.contextmanager
    def note(expected, at_least):
        printed.extend((expected, at_least))
        yield
        printed.append("over")

    monkeypatch.setattr(progress, "show_elapsed", note)
    command = ("run", "--potential", "harmonic", "--particles", "3", "--engine", "reference")
    assert chaincor(*command)[0] == 0
    scene = Scene(potential="harmonic", particles=3, engine="reference")
    assert printed == [plan(scene).seconds, False, "over"]
    # Estimates from measured times have no range; longer chains may take several times as long.
    assert plan(Scene(particles=5000, speed=0.4, tolerance=1e-3)).may_take_longer
    assert not plan(Scene(particles=500)).may_take_longer
