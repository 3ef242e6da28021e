"""Escape control characters and formulas in text for terminals and spreadsheets."""

import unicodedata
from typing import Any

# Characters in these Unicode categories move the cursor, change colours, or reverse the direction
# of text.
_CONTROLS = ("Cc", "Cf", "Cs", "Zl", "Zp")
# A spreadsheet treats a cell that begins with one of these characters as a formula.
_FORMULAS = ("=", "+", "-", "@", "\t", "\r")


def printable(text: str, keep: str = "") -> str:
    r"""
    Return a text with its control characters escaped, as in ``\x1b``.

    Characters in `keep` are not escaped.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c in keep or not _is_control(c) else _escaped(c) for c in text)


def _is_control(character: str) -> bool:
    return not character.isprintable() and unicodedata.category(character) in _CONTROLS


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def csv_cell(value: Any) -> Any:
    """Return the value of a CSV cell; text that looks like a formula gets ``'`` in front."""
    if isinstance(value, str) and value.startswith(_FORMULAS):
        return f"'{value}"
    return value
