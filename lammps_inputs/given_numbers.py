"""Numbers that are handed over: in words, or by callers in Python, refused if senseless."""

import math
import operator
from typing import Any

from chaincor.lammps_inputs.errors import InputError


def whole_number_given(name: str, value: Any, least: int = 1, most: int | None = None) -> int:
    """Return a whole number of at least and at most so much; InputError for anything else."""
    try:
        number = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = None
    if number is None or number < least or (most is not None and number > most):
        span = f"{least} or more" if most is None else f"from {least} to {most}"
        raise InputError(f"{name} is {shown(value)}; expected a whole number, {span}")
    return number


def positive_number_given(name: str, value: Any) -> float:
    """Return a positive finite number; InputError for anything else."""
    try:
        number = math.nan if isinstance(value, bool | str | bytes) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not 0.0 < number < math.inf:
        raise InputError(f"{name} is {shown(value)}; expected a positive finite number")
    return number


def number_in(word: str) -> float | None:
    """Return the number that a word is; None where it is none."""
    try:
        return float(word)
    except ValueError:
        return None


def last_digit(word: str) -> float:
    """Return one unit of the last digit that a number is written with."""
    mantissa, _, exponent = word.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(f"1e{int(exponent or 0) - decimals}")


def shown(value: Any) -> str:
    """Return what a value says of itself, in one line of 60 characters, whatever it is."""
    try:
        return " ".join(repr(value).split())[:60]
    except Exception:  # some objects cannot say what they are
        return f"an object of type {type(value).__name__}"
