"""What one process compiles, others that need it wait for, and then load."""

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

# Three times the slowest loop on a machine with four processes on a core; after that the other is
# taken to be stopped.
_PATIENCE = 120.0
_LOOK_AGAIN = 0.05


@contextmanager
def one_process(folder: Path, name: str) -> Iterator[None]:
    """
    Let one process at a time into the block, of those that keep loops in one folder.

    Several that start together, as workers do, would each compile the same loops. Nothing but time
    depends on it: where the system has no locks, or the other takes too long, nobody waits.

    Parameters
    ----------
    folder : Path
        Where loops are kept.
    name : str
        What is compiled; other names do not wait for it.
    """
    file = None
    with suppress(ImportError, OSError):
        import fcntl  # not on Windows

        folder.mkdir(parents=True, exist_ok=True)
        # A byte of one file for each name; processes that end, however they do, give theirs back.
        file = (folder / "compiling.lock").open("ab")
        _wait(fcntl, file, int(sha256(name.encode()).hexdigest()[:8], 16))
    try:
        yield
    finally:
        if file is not None:
            file.close()


def _wait(fcntl: Any, file: Any, place: int) -> None:
    give_up = time.monotonic() + _PATIENCE
    while time.monotonic() < give_up:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
        except (BlockingIOError, PermissionError):
            time.sleep(_LOOK_AGAIN)
        else:
            return
