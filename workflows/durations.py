"""Times as people read them, and lines that tell them to a log."""

import sys
import time

# Between two lines in the log of a batch job.
LINE_SECONDS = 60.0
# Ten thousand years, of which digits say nothing.
_TOO_LONG = 3e11


class LineAMinute:
    """Lines on standard error, the first after a minute: for logs, where a bar is no use."""

    def __init__(self, seconds: float = LINE_SECONDS) -> None:
        self._seconds = seconds
        self._started = self._last = time.monotonic()

    def tell(self, text: str) -> None:
        """Write a line with the time that has passed, unless the last one is too young."""
        now = time.monotonic()
        if now - self._last < self._seconds:
            return
        self._last = now
        elapsed = format_duration(now - self._started)
        print(f"chaincor: {text} after {elapsed}", file=sys.stderr, flush=True)


def format_duration(seconds: float) -> str:
    """Format a time for people, in the largest unit of which it holds two."""
    if seconds >= _TOO_LONG:
        return f"{seconds / 86400.0:.1g} days"
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{float(f'{seconds:.2g}'):g} s"
