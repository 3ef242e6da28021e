"""Check texts and paths that users give to functions in Python."""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import shown


def texts_given(name: str, values: Any) -> tuple[str, ...]:
    """Return one text or several as a tuple; raise InputError for any other object."""
    if isinstance(values, str):
        return (values,)
    if isinstance(values, Iterable) and not isinstance(values, bytes | Mapping):
        return tuple(text_given(name, value) for value in values)
    raise InputError(f"{name} is {shown(values)}. Give a text or a list of texts")


def text_given(name: str, value: Any) -> str:
    """Return `value` if it is a text; raise InputError for any other object."""
    if not isinstance(value, str):
        raise InputError(f"{name} is {shown(value)}. Give a text")
    return value


def path_given(name: str, value: Any) -> Path:
    """Return a path; raise InputError if `value` is no path."""
    given = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(given, str) or "\0" in given:
        raise InputError(f"{name} is {shown(value)}. Give a path")
    return Path(given)
