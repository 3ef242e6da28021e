"""Show the progress of work, by a bar on a terminal or in a notebook, or by a line per minute."""

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from chaincor.analysis.showing.notebook import in_notebook, session_bar
from chaincor.workflows.durations import format_duration
from chaincor.workflows.engines.reference.loops.processes import COMPILING

# Function that is called after every few collisions with their expected cost and their number.
PointProgress = Callable[[float, int], None]
# Progress is shown only if the work is expected to take longer than this.
_QUIET_SECONDS = 2.0
_REFRESH_SECONDS = 0.25
# Seconds between two lines of progress in a log.
_LINE_SECONDS = 60.0


class LineEveryMinute:
    """Writer of one progress line per minute to standard error, for logs."""

    def __init__(self, seconds: float = _LINE_SECONDS) -> None:
        self._seconds = seconds
        self._started = self._last = time.monotonic()

    def tell(self, text: str) -> None:
        """Write a line with the elapsed time if a minute has passed since the last line."""
        now = time.monotonic()
        if now - self._last < self._seconds:
            return
        self._last = now
        elapsed = format_duration(now - self._started)
        print(f"chaincor: {text} after {elapsed}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def _bar_or_line(
    line: LineEveryMinute,
    columns: Callable[[Any], Sequence[Any]],
    first: str = "",
    auto_refresh: bool = True,
) -> Iterator[Callable[..., None]]:
    """
    Show a bar on a terminal, or lines in a file or in IPython.

    The yielded function takes the finished fraction, the texts of bar and line, and the fields of
    the columns. `columns` creates columns from ``rich.progress``, which short runs do not import.
    """
    from rich import progress
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal or console.is_dumb_terminal:
        yield lambda _done, _text, message, **_: line.tell(message)
        return
    with progress.Progress(
        *columns(progress), console=console, transient=True, auto_refresh=auto_refresh
    ) as bar:
        task = bar.add_task(first, total=1.0, rate="")

        def show(done: float, text: str, _time_text: str, **fields: Any) -> None:
            bar.update(task, completed=done, description=text, refresh=not auto_refresh, **fields)

        yield show


@contextlib.contextmanager
def study_progress() -> Iterator[Callable[[str, float], None]]:
    """
    Show the progress of a study.

    The yielded function takes the name of the current part and the finished fraction.
    """
    with _bar_or_line(
        LineEveryMinute(),
        lambda rich: (
            rich.TextColumn("{task.description:<16}"),
            rich.BarColumn(),
            rich.TimeElapsedColumn(),
        ),
    ) as show:
        yield lambda part, done: show(done, part, f"{part}, {100.0 * done:.0f} % done")


@contextlib.contextmanager
def reading_progress(file: Path) -> Iterator[Callable[[int], None] | None]:
    """Show the progress of reading a file; the yielded function takes the position in the file."""
    size = file.stat().st_size if file.exists() else 0
    if size == 0:
        yield None
        return
    with _bar_or_line(
        LineEveryMinute(),
        lambda rich: (
            rich.TextColumn("reading {task.description}"),
            rich.BarColumn(),
            rich.TimeRemainingColumn(),
        ),
    ) as show:

        def at(position: int) -> None:
            place = f"{position / 1e6:.1f} of {size / 1e6:.1f} MB of {file.name}"
            show(position / size, place, f"{place} read")

        yield at


@contextlib.contextmanager
def progress_bar(wanted: bool, points: int, seconds: float) -> Iterator[PointProgress]:
    """
    Show the progress of many collisions.

    The yielded function takes the expected seconds and the number of finished collisions.

    The bar measures expected seconds. The longest collisions come first, so a bar that counts
    collisions would predict too late an end.
    """
    if not wanted or points == 0:
        yield lambda _cost, _number: None
        return
    number, spent, started = 0, 0.0, time.monotonic()
    show: Callable[[float], None]

    def advance(cost: float, finished: int) -> None:
        nonlocal number, spent
        number, spent = number + finished, spent + cost
        show(min(spent / seconds, 1.0) if seconds > 0.0 else number / points)

    if in_notebook():
        stays = session_bar(points)

        def show(share: float) -> None:
            elapsed, left = time.monotonic() - started, ""
            if share > 0.0 and number < points:
                left = f", about {format_duration(elapsed * (1.0 - share) / share)} left"
            words = f"{number} of {points} collisions in {format_duration(elapsed)}{left}"
            # The finished fraction is an estimate, which may reach 1 before the last collision
            # ends.
            stays(points if number == points else min(points * share, 0.999 * points), words)

        yield advance
        return
    with _bar_or_line(
        LineEveryMinute(),
        lambda rich: (
            rich.TextColumn("{task.description}"),
            rich.BarColumn(),
            rich.TextColumn("{task.fields[rate]}"),
            rich.TimeElapsedColumn(),
            rich.TextColumn("left"),
            rich.TimeRemainingColumn(),
        ),
        f"0/{points}",
    ) as bar:

        def show(share: float) -> None:
            rate = number / max(time.monotonic() - started, 1e-9)
            message = f"{number} of {points} collisions, {100.0 * share:.0f} % of the work, done"
            bar(share, f"{number}/{points}", message, rate=f"{rate:.2g}/s")

        yield advance


@contextlib.contextmanager
def show_elapsed(expected: float, *, at_least: bool = False) -> Iterator[None]:
    """
    Show the elapsed time and the expected time while a collision runs.

    Nothing is shown in the first two seconds. Without a terminal, a line is shown each minute. If
    the user interrupts the collision, there is no result, and the message gives the `expected`
    seconds. `at_least` means that the collision may take several times as long.
    """
    done, started = threading.Event(), time.monotonic()
    known = format_duration(expected)
    known = f"at least {known}, perhaps several times that" if at_least else f"about {known}"
    thread = threading.Thread(target=_show_elapsed, args=(expected, known, done), daemon=True)
    thread.start()
    try:
        yield
    except KeyboardInterrupt:
        done.set()
        thread.join()
        elapsed = format_duration(time.monotonic() - started)
        print(
            f"chaincor: no number yet after {elapsed} (expected: {known}): a "
            "larger tolerance or fewer particles take less",
            file=sys.stderr,
            flush=True,
        )
        raise
    finally:
        done.set()
        thread.join()


def _show_elapsed(expected: float, known: str, done: threading.Event) -> None:
    started, line, compiled = time.monotonic(), LineEveryMinute(), 0.0
    if done.wait(_QUIET_SECONDS):
        return
    with _bar_or_line(
        line,
        # The bar is short, so that bar and text fit into 80 columns.
        lambda rich: (
            rich.SpinnerColumn(),
            rich.BarColumn(10),
            rich.TextColumn("{task.description}"),
        ),
        auto_refresh=False,
    ) as show:
        while True:
            elapsed = time.monotonic() - started
            late = f"longer than the {format_duration(expected)}" if elapsed > expected else known
            begin = format_duration(elapsed)
            if COMPILING.is_set():
                elapsed, compiled = 0.0, elapsed
                words = f"{begin}, compiling loops, as the first run of a kind of bond does"
            else:
                elapsed -= compiled
                words = _time_text(elapsed, expected, known, begin)
            show(min(elapsed / expected, 1.0), words, f"running, {late} expected,")
            if done.wait(_REFRESH_SECONDS):
                return


def _time_text(elapsed: float, expected: float, known: str, begin: str) -> str:
    if elapsed <= expected:
        return f"{begin}, {known} expected"
    if expected < _QUIET_SECONDS:
        # Most of this time is the start of the program instead of the collision.
        return f"{begin}, of which the collision itself needs about {format_duration(expected)}"
    return f"{begin}, {format_duration(expected)} were expected; how much longer is not known"
