"""
A loop that another process compiles while this one compiles another.

Numba compiles one loop at a time in a process. A first collision needs two: the one that takes
longer is compiled here, and the other meanwhile by a process that keeps it on disk and ends.
"""

import contextlib
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

from chaincor.workflows.engines.in_house.loops.cores import own_cores

# What the other process runs. It finds modules where this one does, and nowhere else.
_PROGRAM = """
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
function, arguments = pickle.load(sys.stdin.buffer)
function(*arguments)
"""
# It started first and has less to do: if it is late by so many seconds, something holds it up.
_PATIENCE = 10.0

# Set while a loop is compiled: what shows how long a run takes says so.
COMPILING = threading.Event()

_START: ContextVar[Callable[[], None] | None] = ContextVar("_START", default=None)


@contextlib.contextmanager
def meanwhile(function: Callable, *arguments: Any) -> Iterator[None]:
    """
    Have another process call a function if a loop is compiled within the block.

    Nothing depends on whether it succeeds, or is tried at all: not on a single core, nor in worker
    processes, which are as many as there are cores. The function, of a module, loads or compiles
    loops, so that they are kept on disk after the block; its arguments are pickled.
    """
    helpers: list[subprocess.Popen] = []

    def start() -> None:
        if not helpers and own_cores() > 1:
            helpers.extend(_started(function, arguments))

    token = _START.set(start)
    try:
        yield
        with a_loop_is_compiled() if helpers else contextlib.nullcontext():
            for helper in helpers:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    helper.wait(_PATIENCE)
    finally:
        _START.reset(token)
        for helper in helpers:
            helper.kill()
            helper.wait()


@contextlib.contextmanager
def a_loop_is_compiled() -> Iterator[None]:
    """Start what is to be done meanwhile, if anything is, and say that a loop is compiled."""
    start = _START.get()
    if start is not None:
        start()
    COMPILING.set()
    try:
        yield
    finally:
        COMPILING.clear()


def _started(function: Callable, arguments: tuple) -> list[subprocess.Popen]:
    """Return the process that calls a function; none where that is not possible."""
    try:
        task = pickle.dumps(sys.path) + pickle.dumps((function, arguments))
        helper = subprocess.Popen(
            [sys.executable, "-P", "-c", _PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except (OSError, ValueError, TypeError, AttributeError, pickle.PicklingError):
        return []
    assert helper.stdin is not None
    with contextlib.suppress(OSError), helper.stdin:
        helper.stdin.write(task)
    return [helper]
