"""Write each result of a long study to a CSV table as soon as it is computed."""

import csv
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def growing_table(
    path: Path, header: Sequence[str]
) -> Iterator[tuple[list[list[str]], Callable[[Iterable[Sequence[Any]]], None]]]:
    """Yield the rows of a table, and a function that writes further rows to the file at once."""
    with path.open("a+", newline="") as file:
        file.seek(0)
        known = list(csv.reader(file))
        writer = csv.writer(file, lineterminator="\n")
        if not known:
            writer.writerow(header)

        def add(rows: Iterable[Sequence[Any]]) -> None:
            writer.writerows(rows)
            file.flush()

        yield known, add
