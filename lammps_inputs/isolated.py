"""Separate processes with limits, for functions that may crash, hang or fill the memory."""

import atexit
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import IO, Any

from chaincor.lammps_inputs.errors import ChaincorError, one_line

# The new process searches for modules in the same folders as this process.
_PROGRAM = """
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
from chaincor.lammps_inputs.isolated import serve
serve()
"""
# Largest ratio of elapsed time to processor time. On a busy machine a process gets a small share of
# a core.
_WALL_TIME = 30.0
_LENGTH_BYTES = 8


class IsolatedError(Exception):
    """Error of a function that exceeded a limit or crashed; the message is the reason."""


class Isolated:
    """
    Function that runs in another process. This process also serves further calls.

    The function must belong to a module. Arguments and results are pickled. If the function raises
    a ChaincorError, the call raises this error. Any other failure raises IsolatedError with the
    reason: a crash, more than `seconds` of processor time, or more than `megabytes` of memory.
    """

    def __init__(self, function: Callable, *, seconds: int, megabytes: int) -> None:
        self._function, self._seconds, self._megabytes = function, seconds, megabytes
        self._process: subprocess.Popen | None = None
        self._owner = 0
        self._lock = threading.Lock()

    def __call__(self, *given: Any) -> Any:
        """Call the function in the other process."""
        with self._lock:
            process = self._started()
            timer = threading.Timer(_WALL_TIME * self._seconds, process.kill)
            timer.daemon = True
            timer.start()
            try:
                answer = self._ask(process, given)
            except BaseException:
                self._stop()
                raise
            finally:
                timer.cancel()
        kind, value = answer
        if kind == "raised":
            raise value
        if kind == "failed":
            raise IsolatedError(value)
        return value

    def _ask(self, process: subprocess.Popen, given: tuple) -> tuple[str, Any]:
        request = (self._function, given, self._seconds, self._megabytes)
        to, back = process.stdin, process.stdout
        assert to is not None
        assert back is not None
        try:
            _send(to, request)
            return _receive(back)
        except (OSError, EOFError, pickle.UnpicklingError):
            process.kill()
            raise IsolatedError(self._cause(process.wait())) from None

    def _cause(self, status: int) -> str:
        if -status in (getattr(signal, "SIGXCPU", 0), getattr(signal, "SIGKILL", 0)):
            return f"it takes more than {self._seconds} s"
        if status < 0:
            return f"the library that reads it crashed ({signal.Signals(-status).name})"
        return f"it ended with status {status}"

    def _started(self) -> subprocess.Popen:
        """Return the process; after a fork, which copies the parent's pipes, start another one."""
        if self._process is not None and self._owner == os.getpid():
            if self._process.poll() is None:
                return self._process
            self._stop()
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self._owner = os.getpid()
        atexit.register(self._stop)
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.write(pickle.dumps(sys.path))
        return self._process

    def _stop(self) -> None:
        process, self._process = self._process, None
        if process is None or self._owner != os.getpid():
            return
        process.kill()
        with suppress(OSError, ValueError):
            process.communicate(timeout=10.0)


def _send(stream: IO[bytes], value: Any) -> None:
    content = pickle.dumps(value)
    stream.write(len(content).to_bytes(_LENGTH_BYTES, "little") + content)
    stream.flush()


def _receive(stream: IO[bytes]) -> Any:
    head = stream.read(_LENGTH_BYTES)
    content = stream.read(int.from_bytes(head, "little"))
    if not content:
        raise EOFError
    return pickle.loads(content)


def serve() -> None:
    """Serve the calls of the parent process until the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of libraries must not mix with the results
    while True:
        try:
            function, given, seconds, megabytes = _receive(sys.stdin.buffer)
        except EOFError:
            return
        _limit(seconds, megabytes)
        try:
            answer: tuple[str, Any] = ("returned", function(*given))
        except ChaincorError as error:
            answer = ("raised", error)
        except MemoryError:
            answer = ("failed", f"it needs more than {megabytes} MB of memory")
        except Exception as error:
            answer = ("failed", one_line(error)[:200] or type(error).__name__)
        _send(answers, answer)


def _limit(seconds: int, megabytes: int) -> None:
    try:
        import resource
    except ImportError:  # Windows has no such limits; only the time is limited there
        return
    used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    _, most = resource.getrlimit(resource.RLIMIT_CPU)
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CPU, (int(used) + 1 + seconds, most))
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (megabytes * 2**20, most))
