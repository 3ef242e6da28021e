"""What is varied: names and values of LAMMPS variables, and the ladder of values."""

import math
import re
from dataclasses import dataclass
from itertools import product

from chaincor.analysis.ladders.verdict import LEAST_COLUMNS, LEAST_RUNGS
from chaincor.lammps_inputs.errors import InputError

MOST_RUNGS, MOST_PHASES, MOST_FIXED, _MOST_RANKS = 40, 100, 100, 64
# A ladder of less says nothing of an order.
_LEAST_SPAN = 2.0
# Nearby values of one rung lie within this share of it on either side.
PHASE_WIDTH = 0.02
# Variables are counts, and rounded, where both ends are whole numbers of this size at least.
_LEAST_COUNT = 100
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}", re.ASCII)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)


@dataclass(frozen=True)
class Ladder:
    """Values of one variable, from coarse to fine in equal ratios."""

    name: str  #: The LAMMPS variable.
    #: Its ends.
    coarse: float
    fine: float  #: See ``coarse``.
    rungs: int  #: How many values.
    counts: bool  #: Whether they are whole numbers.

    def value(self, rung: int, phase: int, phases: int) -> float:
        """
        Return the value of one run.

        Phase 0 is the rung itself. The others lie around it by multiples of the golden ratio, which
        fill the width evenly and never share a phase of the step.
        """
        share = rung / (self.rungs - 1)
        value = self.coarse ** (1.0 - share) * self.fine**share
        if phase > 0:
            place = ((rung * phases + phase) * _GOLDEN) % 1.0
            value *= 1.0 + PHASE_WIDTH * (2.0 * place - 1.0)
        elif rung in (0, self.rungs - 1):
            value = self.fine if rung else self.coarse
        return float(round(value)) if self.counts else float(f"{value:.6g}")

    def text(self, value: float) -> str:
        """Return a value as it is given to LAMMPS."""
        return str(int(value)) if self.counts else repr(value)

    def step(self, value: float) -> float:
        """Return what shrinks towards the fine end: the value, or its inverse where it grows."""
        return value if self.fine < self.coarse else 1.0 / value


# What is tried of a script's own step where nobody says what: so many times it, to so many.
_OWN_COARSE, _OWN_RUNGS = 2.0, 4


def ladder_around(step: float, coarser: float = _OWN_COARSE) -> Ladder:
    """Return the ladder of steps around a script's own, each half of the one before."""
    coarse = coarser * step
    return Ladder("timestep", coarse, coarse * 0.5 ** (_OWN_RUNGS - 1), _OWN_RUNGS, False)


def read_ladder(text: str) -> Ladder:
    """
    Read ``NAME=FROM:TO:COUNT``, FROM the coarse end and TO the fine one.

    Raises InputError where it is anything else.
    """
    expected = "expected NAME=FROM:TO:COUNT, coarse end first, such as timestep=0.01:0.0005:8"
    name, equals, rest = text.partition("=")
    parts = rest.split(":")
    if not equals or len(parts) != 3:
        raise InputError(f"--vary is {text!r}; {expected}")
    check_name(name, "--vary")
    coarse, fine = (read_number(part, "--vary") for part in parts[:2])
    if not re.fullmatch(r"\d{1,3}", parts[2], re.ASCII):
        raise InputError(f"--vary counts {parts[2]!r} values; {expected}")
    rungs = int(parts[2])
    if not LEAST_RUNGS <= rungs <= MOST_RUNGS:
        raise InputError(
            f"--vary counts {rungs} values; expected {LEAST_RUNGS} to {MOST_RUNGS}: with fewer, no "
            "order can be told"
        )
    if coarse <= 0.0 or fine <= 0.0 or max(coarse, fine) / min(coarse, fine) < _LEAST_SPAN:
        raise InputError(
            f"--vary goes from {parts[0]} to {parts[1]}; expected positive values, a factor of "
            f"{_LEAST_SPAN:g} apart at least"
        )
    whole = all(part.isdecimal() and int(part) >= _LEAST_COUNT for part in parts[:2])
    return Ladder(name, coarse, fine, rungs, whole)


def read_fixed(texts: tuple[str, ...]) -> list[dict[str, str]]:
    """
    Read ``NAME=VALUE,VALUE`` options: returns every combination, as text for LAMMPS.

    Raises InputError where they are anything else, or name a variable twice.
    """
    names: dict[str, list[str]] = {}
    for text in texts:
        name, equals, rest = text.partition("=")
        if not equals or not rest:
            raise InputError(
                f"--fix is {text!r}; expected NAME=VALUE,VALUE, such as rows=1000,10000"
            )
        check_name(name, "--fix")
        if name in names:
            raise InputError(f"--fix names {name!r} twice; expected each once: join the values")
        values = rest.split(",")
        for value in values:
            read_number(value, "--fix")
        names[name] = values
    found = [dict(zip(names, each, strict=True)) for each in product(*names.values())]
    if len(found) > MOST_FIXED:
        raise InputError(
            f"--fix makes {len(found)} ladders; expected {MOST_FIXED} at most: give fewer values"
        )
    return found


def read_ranks(vary: str) -> tuple[int, ...]:
    """Read ``ranks=1,2,4``; raises InputError for anything else."""
    text = vary.partition("=")[2]
    if not re.fullmatch(r"\d{1,2}(,\d{1,2})+", text, re.ASCII):
        raise InputError(f"--vary is {vary!r}; expected two numbers of processes: ranks=1,2,4")
    ranks = tuple(int(word) for word in text.split(","))
    if not all(1 <= each <= _MOST_RANKS for each in ranks) or len(set(ranks)) < len(ranks):
        raise InputError(f"--vary is {vary!r}; expected numbers from 1 to {_MOST_RANKS}, each once")
    return ranks


def check_name(name: str, option: str) -> None:
    """Raise InputError unless a name is one that LAMMPS variables can have."""
    if not _NAME.fullmatch(name):
        raise InputError(
            f"{option} names the variable {name!r}; expected letters, digits and underscores, such "
            "as timestep"
        )


def read_number(text: str, option: str) -> float:
    """Return a plain number; raises InputError for anything else."""
    if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
        raise InputError(f"{option} holds {text!r}; expected a number, such as 0.01 or 1e-3")
    return float(text)


def check_phases(phases: int, option: str) -> None:
    """Raise InputError where runs of a rung are too few to tell scatter, or too many."""
    if not LEAST_COLUMNS <= phases <= MOST_PHASES:
        raise InputError(
            f"{option} is {phases}; expected {LEAST_COLUMNS} to {MOST_PHASES} runs a rung: with "
            "fewer, no scatter can be told"
        )
