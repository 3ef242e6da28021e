"""
Wait for an event: a test goes on as soon as it occurs, and fails by the clock only if it hangs.

No machine is so busy that it needs these seconds; how fast it is decides nothing.
"""

import contextlib
import signal
import time
from collections.abc import Callable, Iterator

HANGS = 600.0
# The time is that of this process alone, whatever else the machine does.
PROCESSOR_HANGS = 300.0


class HangError(BaseException):
    """Something takes so long that it may never end; no handler of a program's catches it."""


def wait_until(happens: Callable[[], object], meanwhile: Callable[[], object] = bool) -> None:
    """Wait for something; `meanwhile` is called again and again, and may raise."""
    deadline = time.monotonic() + HANGS
    while not happens():
        meanwhile()
        if time.monotonic() > deadline:
            raise HangError
        time.sleep(0.02)


@contextlib.contextmanager
def must_end(seconds: float = PROCESSOR_HANGS) -> Iterator[None]:
    """Raise HangError in what takes more processor time; in the main thread only."""

    def ring(_number: int, _frame: object) -> None:
        raise HangError

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
