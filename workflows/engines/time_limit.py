"""Limit the time of a collision, and the time that a compiled loop runs before it returns."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from chaincor.workflows.durations import format_duration
from chaincor.workflows.errors import CostError

# A compiled loop evaluates at most this number of bond forces before it returns to Python, which
# can then react to Ctrl-C and signals. These evaluations take 0.02 to 0.2 s, depending on the
# force. The whole collision of a short chain fits into one call. No result depends on this limit,
# because a loop continues exactly where it stopped.
WORK_AT_ONCE = 20_000_000
# A collision is stopped after _LONGER times the allowed time, plus _COMPILING seconds to compile
# loops.
_LONGER, _COMPILING = 1.2, 5.0


def steps_at_once(work: int) -> int:
    """Return the number of steps (at least one) in a call; `work` is the bond forces in a step."""
    return max(1, WORK_AT_ONCE // max(1, work))


@dataclass
class TimeLimit:
    """Limit on the time of a collision."""

    allowed: float = math.inf  #: Allowed time in seconds.
    end: float = math.inf  #: Time of the clock ``time.monotonic`` at which the work is stopped.
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
    """Exception that ends a compilation at the time limit; Numba does not catch it."""


@contextmanager
def compiling_to_limit() -> Iterator[None]:
    """
    Stop Numba's compiler within the ``with`` block at the time limit; raises CostError.

    The compiler stops between two of its passes. An exception at any other point would leave it in
    a state in which it cannot compile the same functions again.
    """
    check_time()
    from numba.core import event

    class Clock(event.Listener):
        def on_start(self, event: object) -> None:
            if time_limit().left < 0.0:
                raise _OutOfTime

        def on_end(self, event: object) -> None:
            pass

    try:
        with event.install_listener("numba:run_pass", Clock()):
            yield
    except _OutOfTime:
        check_time()
        raise
