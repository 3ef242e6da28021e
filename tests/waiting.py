"""
Wait for an event; fail only if it takes so long that the program must hang.

Even a busy machine needs far less than these times, so that its speed decides no test.
"""

import contextlib
import signal
import time
from collections.abc import Callable, Iterator

HANGS = 600.0
# This is processor time of this process alone.
PROCESSOR_HANGS = 300.0


class HangError(BaseException):
    """Something takes so long that it may never end; a program's own handlers do not catch this."""


def wait_until(happens: Callable[[], object], meanwhile: Callable[[], object] = bool) -> None:
    """Wait until `happens` returns true; call `meanwhile`, which may raise, after each attempt."""
    deadline = time.monotonic() + HANGS
    while not happens():
        meanwhile()
        if time.monotonic() > deadline:
            raise HangError
        time.sleep(0.02)


@contextlib.contextmanager
def must_end(seconds: float = PROCESSOR_HANGS) -> Iterator[None]:
    """Raise HangError if the block takes more processor time; only for the main thread."""

    def ring(_number: int, _frame: object) -> None:
        raise HangError

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
