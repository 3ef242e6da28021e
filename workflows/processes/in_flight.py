"""Tasks handed to an executor a few at a time, so that stopping drops what is not begun."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from itertools import islice
from typing import Any


def as_they_end(
    executor: Executor, function: Callable[[Any], Any], arguments: Iterable[Any], in_flight: int
) -> Iterator[tuple[int, Future]]:
    """
    Yield the number of each call, counted from 0, and its future as soon as it has ended.

    At most `in_flight` calls are handed out at a time.
    """
    numbered = enumerate(arguments)
    pending: dict[Future, int] = {}
    while True:
        for number, argument in islice(numbered, in_flight - len(pending)):
            pending[executor.submit(function, argument)] = number
        if not pending:
            return
        for future in wait(pending, return_when=FIRST_COMPLETED).done:
            yield pending.pop(future), future
