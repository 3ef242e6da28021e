"""Files of numbers that a scene names: read whole, if they are files that come to an end."""

from pathlib import Path

# So many bytes are some for each of the most particles.
_LARGEST = 1_000_000_000
_TOO_LARGE = "it is larger than the longest chain needs"


def read_small_file(path: Path, largest: int = _LARGEST, pipes: bool = False) -> str:
    """
    Return the text of a file of at most `largest` bytes, with or without a byte order mark.

    With `pipes` one such as a shell's ``<(...)`` is read until it ends. OSError or ValueError, with
    the reason, where it cannot be read, is no plain file otherwise (a device or a pipe may never
    end), is larger than that, or is not UTF-8.
    """
    if not (pipes and path.is_fifo()):
        refuse_endless(path, largest)
    with path.open("rb") as file:
        content = file.read(largest + 1)
    if len(content) > largest:
        raise ValueError(_TOO_LARGE)
    return content.decode("utf-8-sig").replace("\r\n", "\n")


def why_unreadable(error: OSError | ValueError) -> str:
    """Return the reason that a file could not be read, from what reading it raised."""
    if isinstance(error, OSError):
        return error.strerror or type(error).__name__
    return str(error) if type(error) is ValueError else type(error).__name__


def refuse_endless(path: Path, largest: int = _LARGEST) -> None:
    """Raise ValueError, with the reason, where a file may never end; OSError if there is none."""
    if path.exists() and not path.is_file():
        raise ValueError("it is a folder" if path.is_dir() else "it is no plain file")
    if path.stat().st_size > largest:
        raise ValueError(_TOO_LARGE)
