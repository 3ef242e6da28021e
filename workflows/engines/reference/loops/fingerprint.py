"""Compute the fingerprint of a function, which changes with its code and everything it uses."""

from collections.abc import Callable
from hashlib import sha256
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np


def fingerprint(function: Callable) -> str:
    """
    Return the fingerprint of a plain function.

    Functions with the same code have the same fingerprint, wherever they are defined. A function
    may use modules, numbers, classes, NumPy functions and plain functions. Raises TypeError if the
    function uses any other object, because changes of this object could not be detected.
    """
    parts: list[str] = []
    _describe(function, parts, set())
    return sha256("\n".join(parts).encode()).hexdigest()


def has_print(function: FunctionType) -> bool:
    """Return whether `fingerprint` detects all changes of a user's function."""
    try:
        fingerprint(function)
    except (TypeError, ValueError):  # ValueError: an unbound name in the closure
        return False
    return True


# Modules whose contents do not change. A fingerprint contains only their names; of other modules,
# it describes all objects that the function uses.
_LASTING = {"math", "numpy"}


def _describe(value: Any, parts: list[str], seen: set[Any]) -> None:
    """Append a description of a value and of everything that it uses."""
    if isinstance(value, FunctionType):
        if id(value) in seen:
            return
        seen.add(id(value))
        code = value.__code__
        defaults = (*(value.__defaults__ or ()), *(value.__kwdefaults__ or {}).values())
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        _describe_code(code, value.__globals__, parts, seen)
        for used in (*defaults, *cells):
            _describe(used, parts, seen)
    elif isinstance(value, type):
        parts.append(f"{value.__module__}.{value.__qualname__}{getattr(value, '_fields', '')}")
    elif isinstance(value, ModuleType) and value.__name__ in _LASTING:
        parts.append(value.__name__)
    elif value is None or isinstance(value, int | float | str | np.generic):
        parts.append(repr(value))
    elif isinstance(value, np.ufunc | BuiltinFunctionType):
        parts.append(value.__name__)
    elif isinstance(value, tuple):
        for member in value:
            _describe(member, parts, seen)
    else:
        raise TypeError(f"a compiled loop uses {value!r}. Use functions, numbers or classes")


def _describe_code(code: CodeType, names: dict, parts: list[str], seen: set[Any]) -> None:
    parts.append(f"{code.co_code.hex()}{code.co_names}{code.co_varnames}{code.co_freevars}")
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            _describe_code(constant, names, parts, seen)
        else:
            parts.append(repr(constant))
    _describe_names(code.co_names, names, parts, seen)


def _describe_names(used: tuple[str, ...], known: dict, parts: list[str], seen: set[Any]) -> None:
    for name in used:
        # The names include names of attributes. It is harmless if an attribute has the name of a
        # global variable.
        if name not in known:
            continue
        parts.append(name)
        value = known[name]
        if isinstance(value, ModuleType) and value.__name__ not in _LASTING:
            if (id(value), used) not in seen:
                seen.add((id(value), used))
                _describe_names(used, vars(value), parts, seen)
        else:
            _describe(value, parts, seen)
