"""Read and check the values of ``--vary`` and ``--fix``."""

import math
import re
from dataclasses import replace
from itertools import product

from chaincor.analysis.ladders.verdict import LEAST_RUNGS
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.ladder import Ladder

_MOST_RUNGS, _MOST_FIXED, _MOST_RANKS = 40, 100, 64
# A ladder shows a convergence order only if its ends differ by at least this factor.
_LEAST_SPAN = 2.0
# If both ends are whole numbers of at least this size, all values are whole numbers.
_LEAST_COUNT = 100
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}", re.ASCII)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
# Values of a switch are given as a range of at most three whole numbers, or as a list.
_SWITCH = re.compile(
    r"(?P<name>\w+)=(?:(?P<low>\d{1,3}):(?P<high>\d{1,3}):(?P<count>[23])"
    r"|(?P<each>\d{1,3}(?:,\d{1,3})+))",
    re.ASCII,
)


def read_ladder(text: str) -> Ladder:
    """
    Read ``NAME=FROM:TO:COUNT``, where FROM is the coarse end and TO the fine end.

    Raise InputError for other text.
    """
    remedy = "Give NAME=FROM:TO:COUNT, coarse end first, such as timestep=0.01:0.0005:8"
    name, equals, rest = text.partition("=")
    parts = rest.split(":")
    if not equals or len(parts) != 3:
        raise InputError(f"--vary is {text!r}. {remedy}")
    _check_name(name, "--vary")
    coarse, fine = (_read_number(part, "--vary") for part in parts[:2])
    if not re.fullmatch(r"\d{1,3}", parts[2], re.ASCII):
        raise InputError(f"--vary asks for {parts[2]!r} values. {remedy}")
    rungs = int(parts[2])
    if not LEAST_RUNGS <= rungs <= _MOST_RUNGS:
        raise InputError(
            f"--vary asks for {rungs} values. Give {LEAST_RUNGS} to {_MOST_RUNGS}: fewer "
            "values show no order"
        )
    if coarse <= 0.0 or fine <= 0.0 or max(coarse, fine) / min(coarse, fine) < _LEAST_SPAN:
        raise InputError(
            f"--vary goes from {parts[0]} to {parts[1]}. Give positive values that differ "
            f"by a factor of at least {_LEAST_SPAN:g}"
        )
    whole = all(part.isdecimal() and int(part) >= _LEAST_COUNT for part in parts[:2])
    return Ladder(name, coarse, fine, rungs, whole)


def in_whole_numbers(ladder: Ladder) -> Ladder:
    """
    Return a ladder with its values restricted to whole numbers.

    Raise InputError if the ends are not whole numbers, or if the ladder has more rungs than there
    are whole numbers between the ends.
    """
    counts = replace(ladder, counts=True)
    values = {counts.value(rung, 0, 1) for rung in range(ladder.rungs)}
    if not (ladder.coarse.is_integer() and ladder.fine.is_integer()):
        raise InputError(
            f"--vary goes from {ladder.coarse:g} to {ladder.fine:g}, but {ladder.name} "
            "takes whole numbers. Give two whole numbers"
        )
    if len(values) < ladder.rungs:
        raise InputError(
            f"--vary asks for {ladder.rungs} values of {ladder.name}, but only {len(values)} "
            f"differ after rounding to whole numbers. Ask for {len(values)} or fewer, or widen the "
            "range"
        )
    return counts


def read_switch(vary: str) -> tuple[str, ...] | None:
    """Return the values in ``NAME=0:1:2`` or ``NAME=0,1``; None for other text."""
    found = _SWITCH.fullmatch(vary)
    if found is None:
        return None
    if found["each"] is not None:
        values = [int(word) for word in found["each"].split(",")]
    else:
        low, high, steps = int(found["low"]), int(found["high"]), int(found["count"]) - 1
        values = [low + round(k * (high - low) / steps) for k in range(steps + 1)]
    _check_name(found["name"], "--vary")
    if len(set(values)) < len(values):
        raise InputError(
            f"--vary is {vary!r}. Give each value of the switch once: {found['name']}=0,1"
        )
    return tuple(map(str, values))


def read_fixed(texts: tuple[str, ...]) -> list[dict[str, str]]:
    """
    Read options ``NAME=VALUE,VALUE``, and return all combinations of their values as text.

    Raise InputError for other text, or if a variable is named twice.
    """
    names: dict[str, list[str]] = {}
    for text in texts:
        name, equals, rest = text.partition("=")
        if not equals or not rest:
            raise InputError(f"--fix is {text!r}. Give NAME=VALUE,VALUE, such as rows=1000,10000")
        _check_name(name, "--fix")
        if name in names:
            raise InputError(f"--fix names {name!r} twice. Join the values")
        names[name] = rest.split(",")
        for value in names[name]:
            _read_number(value, "--fix")
    found = [dict(zip(names, each, strict=True)) for each in product(*names.values())]
    if len(found) > _MOST_FIXED:
        raise InputError(
            f"--fix makes {len(found)} ladders. Give fewer values, for at most {_MOST_FIXED}"
        )
    return found


def read_ranks(vary: str) -> tuple[int, ...]:
    """Read ``ranks=1,2,4``; raise InputError for other text."""
    text = vary.partition("=")[2]
    if not re.fullmatch(r"\d{1,2}(,\d{1,2})+", text, re.ASCII):
        raise InputError(f"--vary is {vary!r}. Give at least two numbers of processes: ranks=1,2,4")
    ranks = tuple(int(word) for word in text.split(","))
    if not all(1 <= each <= _MOST_RANKS for each in ranks) or len(set(ranks)) < len(ranks):
        raise InputError(f"--vary is {vary!r}. Give numbers from 1 to {_MOST_RANKS}, each once")
    return ranks


def _check_name(name: str, option: str) -> None:
    if not _NAME.fullmatch(name):
        raise InputError(
            f"{option} names the variable {name!r}. Use letters, digits and underscores, "
            "such as timestep"
        )


def _read_number(text: str, option: str) -> float:
    if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
        raise InputError(f"{option} holds {text!r}. Give a number, such as 0.01 or 1e-3")
    return float(text)
