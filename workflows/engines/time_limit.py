"""How long a collision, and a compiled loop, may take before Python runs again and asks."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from chaincor.workflows.durations import format_duration
from chaincor.workflows.errors import CostError

# What a loop does before Python runs again, which alone sees Ctrl-C and signals: bond forces, or as
# much work: 0.02 to 0.2 s by the force, and no call in between for collisions of short chains.
# Nothing else depends on it: loops go on where they stopped, to the last bit.
WORK_AT_ONCE = 20_000_000
# Collisions may take somewhat longer than was said, and loops may have to be compiled first.
_LONGER, _COMPILING = 1.2, 5.0


def steps_at_once(work: int) -> int:
    """Return how many steps, one at least, of some work in bond forces a loop may take at once."""
    return max(1, WORK_AT_ONCE // max(1, work))


@dataclass
class TimeLimit:
    """Until when a collision may be worked on."""

    allowed: float = math.inf  #: Seconds that were said.
    end: float = math.inf  #: By the clock of ``time.monotonic``.
    was_short: bool = False  #: Whether something was left undone for it.

    @property
    def left(self) -> float:
        """Seconds that are left."""
        return self.end - time.monotonic()


_current: ContextVar[TimeLimit] = ContextVar("time_limit", default=TimeLimit())  # noqa: B039


def time_limit() -> TimeLimit:
    """Return the limit of the collision that is worked on; endless where none was set."""
    return _current.get()


@contextmanager
def limited_to(seconds: float) -> Iterator[None]:
    """Let what is worked on within take so many seconds, about."""
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
    """Raise CostError where a collision has taken longer than it may."""
    limit = _current.get()
    if limit.end < time.monotonic():
        limit.was_short = True
        raise CostError(
            f"the collision was stopped after the {format_duration(limit.allowed)} that it may "
            "take, about, with no result yet; expected less: take fewer particles, a larger "
            "tolerance or a lower speed, or allow more (--most-hours, or most_seconds in Python)"
        )
