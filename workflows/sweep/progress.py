"""The progress bar of a sweep: rate and time left on a terminal, nothing elsewhere."""

import contextlib
from collections.abc import Callable, Iterator

# Called after every collision with what it was expected to cost.
Advance = Callable[[float], None]


@contextlib.contextmanager
def progress_bar(wanted: bool, points: int, seconds: float) -> Iterator[Advance]:
    """
    Show how far a sweep is; yields what to tell the expected cost of each collision done.

    The bar measures expected seconds: the longest come first, and a bar of counts would promise too
    late an end.
    """
    if not wanted or points == 0:
        yield lambda _cost: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
    from rich.progress import TimeRemainingColumn as TimeLeft

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _cost: None
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
