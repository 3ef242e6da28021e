"""The progress bar of a study: on a terminal; elsewhere a line a minute."""

import contextlib
from collections.abc import Callable, Iterator

from chaincor.workflows.durations import LineAMinute


@contextlib.contextmanager
def study_progress() -> Iterator[Callable[[str, float], None]]:
    """Show how far a study is; yields what to tell a part's name and the fraction done."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as ProgressBar

    console = Console(stderr=True)
    if not console.is_terminal:
        line = LineAMinute()
        yield lambda part, done: line.tell(f"{part}, {100.0 * done:.0f} % done")
        return
    columns = (TextColumn("{task.description:<16}"), BarColumn(), TimeElapsedColumn())
    with ProgressBar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=1.0)

        def show(part: str, done: float) -> None:
            bar.update(task, description=part, completed=done)

        yield show
