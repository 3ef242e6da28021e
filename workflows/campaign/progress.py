"""How far work is: a bar on a terminal and in a notebook, a line a minute elsewhere."""

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from chaincor.analysis.showing.notebook import in_notebook, session_bar
from chaincor.workflows.durations import LINE_SECONDS, LineAMinute, format_duration
from chaincor.workflows.engines.in_house.loops.beside import COMPILING

if TYPE_CHECKING:
    from rich.console import Console

# Called after every collision with what it was expected to cost.
Advance = Callable[[float], None]
# What is over sooner needs no word.
_QUIET_SECONDS = 2.0
_REFRESH_SECONDS = 0.25


@contextlib.contextmanager
def progress_bar(wanted: bool, points: int, seconds: float) -> Iterator[Advance]:
    """
    Show how far many collisions are; yields what to tell the expected cost of each collision done.

    The bar measures expected seconds: the longest come first, and a bar of counts would promise too
    late an end.
    """
    if not wanted or points == 0:
        yield lambda _cost: None
        return
    done, spent = 0, 0.0

    def counted(show: Callable[[int, float], None]) -> Advance:
        def advance(cost: float) -> None:
            nonlocal done, spent
            done, spent = done + 1, spent + cost
            show(done, min(spent / seconds, 1.0) if seconds > 0.0 else done / points)

        return advance

    if in_notebook():
        yield counted(_notebook_bar(points))
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
    from rich.progress import TimeRemainingColumn as TimeLeft

    console = Console(stderr=True)
    if not _moves(console):
        line = LineAMinute()
        yield counted(
            lambda number, share: line.tell(
                f"{number} of {points} collisions, {100.0 * share:.0f} % of the work, done"
            )
        )
        return
    columns = (
        TextColumn("{task.fields[done]}/{task.fields[points]}"),
        BarColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeLeft(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=1.0, done=0, points=points, rate="")

        def show(number: int, share: float) -> None:
            elapsed = bar.tasks[0].elapsed or 0.0
            rate = f"{number / elapsed:.2g}/s" if elapsed > 0.0 else ""
            bar.update(task, completed=share, done=number, rate=rate)

        yield counted(show)


def _notebook_bar(points: int) -> Callable[[int, float], None]:
    """Show a bar that stays, with the time taken, when all is done."""
    started, bar = time.monotonic(), session_bar(points)

    def show(done: int, share: float) -> None:
        elapsed, left = time.monotonic() - started, ""
        if share > 0.0 and done < points:
            left = f", about {format_duration(elapsed * (1.0 - share) / share)} left"
        words = f"{done} of {points} collisions in {format_duration(elapsed)}{left}"
        # All the work may be done before the last collision is.
        bar(points if done == points else min(points * share, 0.999 * points), words)

    return show


@contextlib.contextmanager
def show_elapsed(expected: float, *, at_least: bool = False) -> Iterator[None]:
    """
    Show the time that has passed, and the time expected, while a collision runs.

    Nothing is shown for the first two seconds, and where standard error is no terminal a line a
    minute. One that is interrupted leaves no number: that is said, with what was expected.

    Parameters
    ----------
    expected : float
        Seconds.
    at_least : bool
        Whether it may take several times as long.
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
    started, line = time.monotonic(), LineAMinute()
    if done.wait(_QUIET_SECONDS):
        return
    # Most runs are over before these would have been imported.
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

    console = Console(stderr=True)
    if not _moves(console):
        while not done.wait(LINE_SECONDS):
            late = time.monotonic() - started > expected
            words = f"longer than the {format_duration(expected)}" if late else known
            line.tell(f"running, {words} expected,")
        return
    # The bar is short, so that the words beside it stay whole on 80 columns.
    columns = (SpinnerColumn(), BarColumn(10), TextColumn("{task.description}"))
    with Progress(*columns, console=console, transient=True, auto_refresh=False) as bar:
        task, compiled = bar.add_task("", total=expected), 0.0
        while True:
            elapsed = time.monotonic() - started
            begin = format_duration(elapsed)
            if COMPILING.is_set():
                elapsed, compiled = 0.0, elapsed
                words = f"{begin}, compiling loops, as the first run of a kind of bond does"
            else:
                elapsed -= compiled
                words = _told(elapsed, expected, known, begin)
            bar.update(task, completed=min(elapsed, expected), description=words)
            bar.refresh()
            if done.wait(_REFRESH_SECONDS):
                return


def _told(elapsed: float, expected: float, known: str, begin: str) -> str:
    if elapsed <= expected:
        return f"{begin}, {known} expected"
    if expected < _QUIET_SECONDS:
        # What takes long is to begin.
        return f"{begin}, of which the collision itself needs about {format_duration(expected)}"
    return f"{begin}, {format_duration(expected)} were expected; how much longer is not known"


def _moves(console: "Console") -> bool:
    """Return whether lines can be written over: not in a file, nor where IPython runs a program."""
    return console.is_terminal and not console.is_dumb_terminal
