"""Limit the time of a collision, and the time that a compiled loop runs before it returns."""

import ctypes
import math
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from chaincor.workflows.durations import format_duration
from chaincor.workflows.errors import CostError

# A compiled loop evaluates at most this number of bond forces before it returns to Python, which
# can then react to Ctrl-C and signals. These evaluations take 0.02 to 0.2 s, depending on the
# force; a short chain needs one call for its collision. No result depends on this limit, because
# loops continue exactly where they stopped.
WORK_AT_ONCE = 20_000_000
# Collisions may take _LONGER times the estimated time, plus _COMPILING seconds to compile loops.
_LONGER, _COMPILING = 1.2, 5.0


def steps_at_once(work: int) -> int:
    """Return the number of steps (at least one) in a call; `work` is the bond forces in a step."""
    return max(1, WORK_AT_ONCE // max(1, work))


@dataclass
class TimeLimit:
    """Limit on the time of a collision."""

    allowed: float = math.inf  #: Allowed time in seconds.
    end: float = math.inf  #: Time of the clock ``time.monotonic`` at which the limit ends.
    was_short: bool = False  #: Whether the limit stopped some work.

    @property
    def left(self) -> float:
        """Remaining seconds."""
        return self.end - time.monotonic()


_current: ContextVar[TimeLimit] = ContextVar("time_limit", default=TimeLimit())  # noqa: B039


def time_limit() -> TimeLimit:
    """Return the limit of the present collision; infinite if none was set."""
    return _current.get()


@contextmanager
def limited_to(seconds: float) -> Iterator[None]:
    """Limit the code within the ``with`` block to about this number of seconds."""
    token = _current.set(
        TimeLimit(seconds, time.monotonic() + _LONGER * seconds + _COMPILING)
        if seconds < math.inf
        else TimeLimit()
    )
    try:
        yield
    finally:
        _current.reset(token)


def check_time() -> None:
    """Raise CostError if the collision has exceeded its time limit."""
    limit = _current.get()
    if limit.end < time.monotonic():
        limit.was_short = True
        raise CostError(
            f"the collision was stopped after about {format_duration(limit.allowed)}, its "
            "time limit, without a result. Take fewer particles, a larger tolerance or a "
            "lower speed, or allow more (--most-hours, or most_seconds in Python)"
        )


class _OutOfTime(BaseException):
    """Exception that ends a collision at its time limit; libraries do not catch it."""


@contextmanager
def stopped_at_limit() -> Iterator[None]:
    """
    Stop Python code within the ``with`` block at the time limit; raises CostError.

    The block contains code that cannot call :func:`check_time`, for example the compiler of loops.
    The code stops between two instructions of Python.
    """
    check_time()
    limit = _current.get()
    if limit.end == math.inf:
        yield
        return
    thread = ctypes.c_ulong(threading.get_ident())
    finished, lock = threading.Event(), threading.Lock()

    def stop() -> None:
        # Callbacks of the compiler swallow the exception; therefore it is raised again each second.
        wait = limit.left
        while not finished.wait(min(wait, threading.TIMEOUT_MAX)):
            with lock:
                if not finished.is_set():
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, ctypes.py_object(_OutOfTime))
            wait = 1.0

    def report(unraisable: "sys.UnraisableHookArgs") -> None:
        if not issubclass(unraisable.exc_type, _OutOfTime):
            hook(unraisable)

    hook, sys.unraisablehook = sys.unraisablehook, report
    threading.Thread(target=stop, daemon=True).start()
    try:
        try:
            yield
        finally:
            with lock:
                finished.set()
            # Withdraw an exception that was already sent; it would be raised after the block.
            ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, None)
            sys.unraisablehook = hook
    except _OutOfTime:
        check_time()
        raise
