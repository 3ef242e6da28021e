"""Read small files that a scene names, and refuse files that may never end."""

from pathlib import Path

from chaincor.lammps_inputs.errors import InputError

# Largest size of a file, in bytes. The longest chain has several bytes per particle.
_LARGEST = 1_000_000_000
_TOO_LARGE = "it is larger than the longest chain needs"


def read_small_file(path: Path, largest: int = _LARGEST, pipes: bool = False) -> str:
    """
    Return the text of a file of at most `largest` bytes, with or without a byte order mark.

    With `pipes`, a pipe such as a shell's ``<(...)`` is read until it ends. Otherwise the file must
    be a regular file, because a device or a pipe may never end. Raises OSError or ValueError, with
    the reason, if the file cannot be read, is not a regular file, is too large, or is not UTF-8.
    """
    if not (pipes and path.is_fifo()):
        refuse_endless(path, largest)
    with path.open("rb") as file:
        content = file.read(largest + 1)
    if len(content) > largest:
        raise ValueError(_TOO_LARGE)
    return content.decode("utf-8-sig").replace("\r\n", "\n")


def why_unreadable(error: OSError | ValueError) -> str:
    """Return why a file is unreadable, from the raised error."""
    if isinstance(error, OSError):
        return error.strerror or type(error).__name__
    return str(error) if type(error) is ValueError else type(error).__name__


def refuse_endless(path: Path, largest: int = _LARGEST) -> None:
    """Raise ValueError if a file may never end, or OSError if it is missing."""
    if path.exists() and not path.is_file():
        raise ValueError("it is a folder" if path.is_dir() else "it is no plain file")
    if path.stat().st_size > largest:
        raise ValueError(_TOO_LARGE)


def refuse_device(path: Path) -> None:
    """Raise InputError for a device or a pipe, which may never end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise InputError(f"{str(path)!r} is a device or a pipe. Give a plain file")
