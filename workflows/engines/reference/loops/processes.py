"""
What processes have to do with each other: which cores are whose, and who compiles a loop.

What one process compiles, others that need it wait for, and then load. Numba compiles one loop at a
time in a process, and a first collision needs two: the one that takes longer is compiled here, and
the other meanwhile by a process that keeps it on disk and ends.
"""

import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from contextvars import ContextVar
from hashlib import sha256
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

from chaincor.workflows.versions import cores_allowed

# What the other process runs. It finds modules where this one does, and nowhere else.
_PROGRAM = """
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
function, arguments = pickle.load(sys.stdin.buffer)
function(*arguments)
"""
# It started first and has less to do: if it is late by so many seconds, something holds it up.
_HELPER_TIMEOUT = 10.0

# Set while a loop is compiled: what shows how long a run takes says so.
COMPILING = threading.Event()

_START: ContextVar[Callable[[], None] | None] = ContextVar("_START", default=None)

# Seconds after which the other process that compiles a loop is taken to be stopped: three times the
# slowest loop on a machine with four processes on a core.
_LOCK_TIMEOUT = 120.0
_LOCK_INTERVAL = 0.05


def cores() -> int:
    """Return how many cores one collision may use: its own, ``OMP_NUM_THREADS`` at most."""
    found = own_cores()
    wanted = os.environ.get("OMP_NUM_THREADS", "")
    return max(1, min(found, int(wanted))) if wanted.isdecimal() else found


def own_cores() -> int:
    """
    Return how many cores are this process's own.

    One in worker processes, and in threads that somebody else started: there, collisions are
    carried out side by side. Elsewhere all that it may use.
    """
    if parent_process() is not None or threading.current_thread() is not threading.main_thread():
        return 1
    return cores_allowed()


@contextmanager
def one_process(folder: Path, name: str) -> Iterator[None]:
    """
    Let one process at a time into the block, of those that keep loops in one folder.

    Several that start together, as workers do, would each compile the same loops. Other names do
    not wait. Nothing but time depends on it: where the system has no locks, or the other takes too
    long, nobody waits.
    """
    file = None
    with suppress(ImportError, OSError):
        import fcntl  # not on Windows

        folder.mkdir(parents=True, exist_ok=True)
        # A byte of one file for each name; processes that end, however they do, give theirs back.
        file = (folder / "compiling.lock").open("ab")
        _wait(fcntl, file, int(sha256(name.encode()).hexdigest()[:8], 16))
    try:
        yield
    finally:
        if file is not None:
            file.close()


def _wait(fcntl: Any, file: Any, place: int) -> None:
    give_up = time.monotonic() + _LOCK_TIMEOUT
    while time.monotonic() < give_up:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
        except (BlockingIOError, PermissionError):
            time.sleep(_LOCK_INTERVAL)
        else:
            return


@contextmanager
def compile_in_background(function: Callable, *arguments: Any) -> Iterator[None]:
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
        with a_loop_is_compiled() if helpers else nullcontext():
            for helper in helpers:
                with suppress(subprocess.TimeoutExpired):
                    helper.wait(_HELPER_TIMEOUT)
    finally:
        _START.reset(token)
        for helper in helpers:
            helper.kill()
            helper.wait()


@contextmanager
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
    with suppress(OSError), helper.stdin:
        helper.stdin.write(task)
    return [helper]
