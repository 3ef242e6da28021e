"""How far many collisions are: a bar on a terminal and in a notebook, a line a minute elsewhere."""

import contextlib
import time
from collections.abc import Callable, Iterator

from chaincor.analysis.showing.notebook import in_notebook
from chaincor.workflows.durations import LineAMinute, format_duration

# Called after every collision with what it was expected to cost.
Advance = Callable[[float], None]
# A notebook keeps every message that it is sent.
_NOTEBOOK_SECONDS = 0.3


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
    if in_notebook():
        yield _notebook_bar(points, seconds)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
    from rich.progress import TimeRemainingColumn as TimeLeft

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _line_a_minute(points, seconds)
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
        task = bar.add_task("", total=seconds, done=0, points=points, rate="")

        def advance(cost: float) -> None:
            done = bar.tasks[0].fields["done"] + 1
            elapsed = bar.tasks[0].elapsed or 0.0
            rate = f"{done / elapsed:.2g}/s" if elapsed > 0.0 else ""
            bar.update(task, advance=cost, done=done, rate=rate)

        yield advance


def _line_a_minute(points: int, seconds: float) -> Advance:
    """Write to a log: standard error that is no terminal."""
    line, done, spent = LineAMinute(), 0, 0.0

    def advance(cost: float) -> None:
        nonlocal done, spent
        done, spent = done + 1, spent + cost
        share = 100.0 * min(spent / seconds, 1.0) if seconds > 0.0 else 100.0
        line.tell(f"{done} of {points} collisions, {share:.0f} % of the work, done")

    return advance


def _notebook_bar(points: int, seconds: float) -> Advance:
    """Show a bar that needs no widgets; it stays, with the time taken, when all is done."""
    from IPython.display import HTML, display

    started = time.monotonic()
    handle = display(HTML(f"{points} collisions"), display_id=True)
    done, share, shown = 0, 0.0, 0.0

    def advance(cost: float) -> None:
        nonlocal done, share, shown
        done += 1
        share = min(share + cost / seconds, 1.0) if seconds > 0.0 else done / points
        now = time.monotonic()
        if done < points and now < shown + _NOTEBOOK_SECONDS:
            return
        shown = now
        elapsed = now - started
        left = (
            f", about {format_duration(elapsed * (1.0 - share) / share)} left"
            if share > 0.0
            else ""
        )
        handle.update(
            HTML(
                f'<progress value="{done if done == points else points * share:.4g}" '
                f'max="{points}"></progress> {done} of {points} collisions in '
                f"{format_duration(elapsed)}{'' if done == points else left}"
            )
        )

    return advance
