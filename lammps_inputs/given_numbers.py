"""Check numbers that users give as text or as Python objects."""

import math
import operator
from typing import Any

from chaincor.lammps_inputs.errors import InputError


def whole_number_given(name: str, value: Any, least: int = 1, most: int | None = None) -> int:
    """Return a whole number within bounds; raise InputError for all other values."""
    try:
        number = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = None
    if number is None or number < least or (most is not None and number > most):
        span = f"{least} or more" if most is None else f"from {least} to {most}"
        raise InputError(f"{name} is {shown(value)}. Give a whole number, {span}")
    return number


def positive_number_given(name: str, value: Any) -> float:
    """Return a positive finite number; raise InputError for all other values."""
    try:
        number = math.nan if isinstance(value, bool | str | bytes) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not 0.0 < number < math.inf:
        raise InputError(f"{name} is {shown(value)}. Give a positive finite number")
    return number


def numbers_given(name: str, values: Any) -> tuple[float, ...]:
    """Return a sequence of numbers; raise InputError for any other object and for NaN."""
    try:
        given = list(values)
        # `float` accepts texts and truth values, which are no numbers here.
        texts = any(isinstance(value, bool | str | bytes) for value in [values, *given])
        numbers = [math.nan] if texts else [float(value) for value in given]
    except (TypeError, ValueError, OverflowError):
        numbers = [math.nan]
    if any(math.isnan(number) for number in numbers):
        raise InputError(f"{name} is {shown(values)}. Give a list of numbers")
    return tuple(numbers)


def number_in(word: str) -> float | None:
    """Return the number that a word states; None if the word is not a number."""
    try:
        return float(word)
    except ValueError:
        return None


def last_digit(word: str) -> float:
    """Return one unit of the last written digit of a number."""
    mantissa, _, exponent = word.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(f"1e{int(exponent or 0) - decimals}")


def shown(value: Any, most: int = 60) -> str:
    """Return the representation of any value in one line of at most `most` characters."""
    try:
        return " ".join(repr(value).split())[:most]
    except Exception:  # `repr` of an object may raise any error
        return f"an object of type {type(value).__name__}"
