"""Test a loop that another process compiles at the same time."""

import os

import numpy as np
import pytest

from chaincor.workflows.engines.reference.compile import LoopCompiler
from chaincor.workflows.engines.reference.loops import processes
from chaincor.workflows.engines.reference.loops.cached_kernels import CachedKernel


def add(values):
    total = 0.0
    for i in range(values.shape[0]):
        total += values[i]
    return total


def add_squares(values):
    total = 0.0
    for i in range(values.shape[0]):
        total += values[i] * values[i]
    return total


def loop(function):
    return LoopCompiler("a", keep=True).compile(function)


def run_squares(marker):
    """Compile or load a loop, and record this in a file."""
    loop(add_squares)(np.ones(3))
    marker.write_text(str(os.getpid()))


def fail():
    raise ValueError("nothing may depend on this")


@pytest.fixture(autouse=True)
def two_cores(tmp_path, monkeypatch):
    monkeypatch.setattr(processes, "own_cores", lambda: 2)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))


@pytest.mark.slow
def test_what_another_process_compiled_meanwhile_is_loaded(tmp_path, monkeypatch):
    monkeypatch.setattr(processes, "_HELPER_TIMEOUT", 600.0)  # however busy the machine is
    marker = tmp_path / "marker"
    with processes.compile_in_background(run_squares, marker):
        here = loop(add)
        assert here(np.arange(4.0)) == 6.0
    assert here.compiled == 1
    assert int(marker.read_text()) != os.getpid()
    there = loop(add_squares)
    assert there(np.arange(4.0)) == 14.0
    assert there.compiled == 0


def test_compiling_a_loop_is_reported_and_loading_is_not(monkeypatch):
    printed = []
    compiled = CachedKernel._compile

    def noted(self, arguments):
        printed.append(processes.COMPILING.is_set())
        return compiled(self, arguments)

    monkeypatch.setattr(CachedKernel, "_compile", noted)
    for _ in range(2):
        loop(add)(np.arange(4.0))
        printed.append(processes.COMPILING.is_set())
    assert printed == [True, False, False]


def test_no_process_is_started_where_nothing_is_compiled(tmp_path, monkeypatch):
    loop(add)(np.ones(3))

    def refuse(*_):
        raise AssertionError("a process was asked for")

    monkeypatch.setattr(processes, "_started", refuse)
    with processes.compile_in_background(run_squares, tmp_path / "marker"):
        assert loop(add)(np.ones(3)) == 3.0


def test_nor_on_a_single_core(tmp_path, monkeypatch):
    monkeypatch.setattr(processes, "own_cores", lambda: 1)
    with processes.compile_in_background(run_squares, tmp_path / "marker"):
        loop(add)(np.ones(3))
    assert not (tmp_path / "marker").exists()


@pytest.mark.parametrize("late", [False, True])
def test_nothing_depends_on_whether_it_succeeds(tmp_path, monkeypatch, late):
    if late:
        monkeypatch.setattr(processes, "_HELPER_TIMEOUT", 0.0)
    with processes.compile_in_background(
        *((run_squares, tmp_path / "marker") if late else (fail,))
    ):
        assert loop(add)(np.ones(3)) == 3.0
    with processes.compile_in_background(lambda: None):  # which another process cannot receive
        assert loop(add_squares)(np.ones(3)) == 3.0
