"""The progress bar of a study: on a terminal, nothing elsewhere."""

import contextlib
from collections.abc import Iterator

from chaincor.workflows.tradeoff.study import Progress


@contextlib.contextmanager
def study_progress() -> Iterator[Progress]:
    """Show how far a study is; yields what to tell a part's name and the fraction done."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as ProgressBar

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _part, _done: None
        return
    columns = (TextColumn("{task.description:<16}"), BarColumn(), TimeElapsedColumn())
    with ProgressBar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=1.0)

        def show(part: str, done: float) -> None:
            bar.update(task, description=part, completed=done)

        yield show
