"""
Decide how many cores each process may use, and which process compiles a loop.

While one process compiles a loop, other processes that need this loop wait, and then load it. Numba
compiles only one loop at a time in a process, but a first collision needs two loops. This process
compiles the loop that takes longer. At the same time, a helper process compiles the second loop,
writes it to disk and ends.
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

# The helper process runs this program, with the module search path of the parent process.
_PROGRAM = """
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
function, arguments = pickle.load(sys.stdin.buffer)
function(*arguments)
"""
# When its own work is done, the parent process waits this many seconds for the helper. The helper
# has less to do; if it needs more time, it has been delayed.
_HELPER_TIMEOUT = 10.0

# This event is set while a loop is compiled; progress displays report the compilation.
COMPILING = threading.Event()

_START: ContextVar[Callable[[], None] | None] = ContextVar("_START", default=None)

# After this many seconds, the process that has the lock is assumed to have stopped. With four
# processes per core, compiling the slowest loop takes a third of this time.
_LOCK_TIMEOUT = 120.0
_LOCK_INTERVAL = 0.05


def cores() -> int:
    """Return the number of cores for one collision, at most ``OMP_NUM_THREADS``."""
    found = own_cores()
    wanted = os.environ.get("OMP_NUM_THREADS", "")
    return max(1, min(found, int(wanted))) if wanted.isdecimal() else found


def own_cores() -> int:
    """
    Return the number of cores that this thread may use.

    The number is one in worker processes and in all threads except the main thread, because these
    processes and threads run collisions side by side. In the main thread of the main process, it is
    the number of cores that the process may use.
    """
    if parent_process() is not None or threading.current_thread() is not threading.main_thread():
        return 1
    return cores_allowed()


@contextmanager
def one_process(folder: Path, name: str) -> Iterator[None]:
    """
    Let only one process at a time run the ``with`` block for a name in a folder of loops.

    Without this lock, several workers that start together would each compile the same loops. Blocks
    for other names do not wait. Only the time depends on the lock: if the system has no locks, or
    if the other process takes too long, no process waits.
    """
    file = None
    with suppress(ImportError, OSError):
        import fcntl  # not on Windows

        folder.mkdir(parents=True, exist_ok=True)
        # Each name locks one byte of the file. The system releases the lock when its process ends.
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
    Call a function in a helper process if a loop is compiled within the ``with`` block.

    The function loads or compiles loops, which are on disk after the block. It must be defined in a
    module, and its arguments must be picklable. No helper is started on a single core, or in worker
    processes, which already use all cores. No result depends on whether a helper is started or
    succeeds.
    """
    helpers: list[subprocess.Popen] = []

    def start() -> None:
        if not helpers and own_cores() > 1:
            helpers.extend(_started(function, arguments))

    token = _START.set(start)
    try:
        yield
        with compiling_loop() if helpers else nullcontext():
            for helper in helpers:
                with suppress(subprocess.TimeoutExpired):
                    helper.wait(_HELPER_TIMEOUT)
    finally:
        _START.reset(token)
        for helper in helpers:
            helper.kill()
            helper.wait()


@contextmanager
def compiling_loop() -> Iterator[None]:
    """Start the helper process, if one is wanted, and set `COMPILING` within the ``with`` block."""
    start = _START.get()
    if start is not None:
        start()
    COMPILING.set()
    try:
        yield
    finally:
        COMPILING.clear()


def _started(function: Callable, arguments: tuple) -> list[subprocess.Popen]:
    """Start a process that calls a function; return an empty list if this is impossible."""
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
