"""How far a run is: a bar on a terminal, a line a minute elsewhere."""

import contextlib
import threading
import time
from collections.abc import Iterator

from chaincor.workflows.durations import LINE_SECONDS, LineAMinute, format_duration

# What is over sooner needs no word.
_QUIET_SECONDS = 2.0
_REFRESH_SECONDS = 0.25


@contextlib.contextmanager
def show_elapsed(expected: float) -> Iterator[None]:
    """
    Show the time that has passed, and the time expected, while something runs.

    Nothing is shown for the first two seconds, and where standard error is no terminal a line a
    minute.
    """
    done = threading.Event()
    thread = threading.Thread(target=_show, args=(expected, done), daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def _show(expected: float, done: threading.Event) -> None:
    started, line = time.monotonic(), LineAMinute()
    if done.wait(_QUIET_SECONDS):
        return
    # Most runs are over before these would have been imported.
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        while not done.wait(LINE_SECONDS):
            late = time.monotonic() - started > expected
            known = "longer than" if late else "about"
            line.tell(f"running, {known} the {format_duration(expected)} that were expected,")
        return
    columns = (SpinnerColumn(), BarColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, transient=True, auto_refresh=False) as bar:
        task = bar.add_task("", total=expected)
        while True:
            elapsed = time.monotonic() - started
            bar.update(task, completed=min(elapsed, expected), description=_told(elapsed, expected))
            bar.refresh()
            if done.wait(_REFRESH_SECONDS):
                return


def _told(elapsed: float, expected: float) -> str:
    if elapsed <= expected:
        return f"{format_duration(elapsed)} of about {format_duration(expected)}; Ctrl-C stops it"
    return (
        f"{format_duration(elapsed)}, longer than the {format_duration(expected)} expected: steps "
        "are being refined, and how much longer that takes is not known; Ctrl-C stops it"
    )
