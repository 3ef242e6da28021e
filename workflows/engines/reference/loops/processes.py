"""
Decide which cores each process may use, and which process compiles a loop.

If one process compiles a loop, others that need it wait and then load it. Numba compiles one loop
at a time in a process, and a first collision needs two. This process compiles the loop that takes
longer. A helper process compiles the other at the same time, keeps it on disk and ends.
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

from chaincor.workflows.engines.time_limit import check_time
from chaincor.workflows.versions import cores_allowed

# The helper process runs this program, with the module search path of this process.
_PROGRAM = """
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
function, arguments = pickle.load(sys.stdin.buffer)
function(*arguments)
"""
# The parent process waits this many seconds for the helper. The helper started first and has less
# to do, so a later helper must have been delayed.
_HELPER_TIMEOUT = 10.0

# This event is set while a loop is compiled, so that displays of the running time can say so.
COMPILING = threading.Event()

_START: ContextVar[Callable[[], None] | None] = ContextVar("_START", default=None)

# After this many seconds the process that holds the lock is assumed to have stopped. The slowest
# loop takes a third of this time on a machine with four processes per core.
_LOCK_TIMEOUT = 120.0
_LOCK_INTERVAL = 0.05


def cores() -> int:
    """Return the number of cores for one collision: its own, at most ``OMP_NUM_THREADS``."""
    found = own_cores()
    wanted = os.environ.get("OMP_NUM_THREADS", "")
    return max(1, min(found, int(wanted))) if wanted.isdecimal() else found


def own_cores() -> int:
    """
    Return the number of cores that belong to this process.

    The number is one in worker processes and in all threads but the main thread, because collisions
    run side by side there. Otherwise it is the number of cores that the process may use.
    """
    if parent_process() is not None or threading.current_thread() is not threading.main_thread():
        return 1
    return cores_allowed()


@contextmanager
def one_process(folder: Path, name: str) -> Iterator[None]:
    """
    Allow one process at a time into the block, for each name in a folder of loops.

    Several workers that start together would otherwise each compile the same loops. Other names do
    not wait. Only time depends on the lock: if the system has no locks, or if the other process
    takes too long, nobody waits.
    """
    file = None
    with suppress(ImportError, OSError):
        import fcntl  # not on Windows

        folder.mkdir(parents=True, exist_ok=True)
        # Each name locks one byte of the file; the system releases the locks of processes that end.
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
        check_time()
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
        except (BlockingIOError, PermissionError):
            time.sleep(_LOCK_INTERVAL)
        else:
            return


@contextmanager
def compile_in_background(function: Callable, *arguments: Any) -> Iterator[None]:
    """
    Call a function in another process if a loop is compiled within the block.

    No result depends on whether this succeeds or is tried. It is not tried on a single core, or in
    worker processes, because these already use all cores. The function, defined in a module, loads
    or compiles loops, which are on disk after the block. Its arguments are pickled.
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
    """Start the helper process, if there is one, and mark that a loop is compiled."""
    start = _START.get()
    if start is not None:
        start()
    COMPILING.set()
    try:
        yield
    finally:
        COMPILING.clear()


def _started(function: Callable, arguments: tuple) -> list[subprocess.Popen]:
    """Return the process that calls a function; an empty list if it cannot be started."""
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
