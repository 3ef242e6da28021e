"""Files of numbers that a scene names: read whole, if they are files that come to an end."""

from pathlib import Path

# So many bytes are some for each of the most particles.
_LARGEST = 1_000_000_000


def read_small_file(path: Path) -> str:
    """
    Return the text of a file.

    OSError or ValueError, with the reason, where it cannot be read, is no plain file (a device or a
    pipe may never end), is larger than the longest chain could need, or is not UTF-8.
    """
    refuse_endless(path)
    return path.read_text(encoding="utf-8-sig")


def refuse_endless(path: Path) -> None:
    """Raise ValueError, with the reason, where a file may never end; OSError if there is none."""
    if path.exists() and not path.is_file():
        raise ValueError("it is a folder" if path.is_dir() else "it is no plain file")
    if path.stat().st_size > _LARGEST:
        raise ValueError("it is larger than the longest chain needs")
