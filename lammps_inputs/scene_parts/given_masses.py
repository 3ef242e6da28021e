"""Read masses that users give as a number, a list, a text, or a file."""

from pathlib import Path
from typing import Any

import numpy as np

from chaincor.lammps_inputs.small_file import read_small_file, why_unreadable

_MASSES = "numbers with commas between them, such as 1,2, or a file of numbers"


def read_masses(value: Any) -> Any:
    """
    Return masses as a list, from a number, a text such as ``1,2``, or a file of numbers.

    Raises ValueError, with one line, if a text is neither a list nor a readable file.
    """
    parts = value if isinstance(value, list | tuple) else [value]
    if any(isinstance(part, bool) for part in parts):
        raise ValueError("expected masses, such as 1,2")
    if isinstance(value, set | frozenset):
        raise ValueError("a set has no order. Give a list of masses, such as [1, 2]")
    if isinstance(value, int | float):
        return [value]
    if isinstance(value, np.ndarray):
        return value.ravel().tolist()
    if not isinstance(value, str | Path):
        return value
    if isinstance(value, str) and (masses := masses_in(value)) is not None:
        return masses
    try:
        words = read_small_file(Path(value)).replace(",", " ").split()
    except (OSError, ValueError) as error:
        raise ValueError(
            f"expected {_MASSES}. The file of this name cannot be read: {why_unreadable(error)}"
        ) from None
    if not words:
        raise ValueError(f"the file is empty. Give {_MASSES}")
    try:
        return [float(word) for word in words]
    except ValueError:
        wrong = next(word for word in words if masses_in(word) is None)
        raise ValueError(f"the file holds {wrong[:40]!a}. Give {_MASSES}") from None


def masses_in(text: str) -> list[float] | None:
    """Return the masses in a text such as ``1,2``; None for other texts."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        return None
