"""Read which quantities the user requests, and search for printed numbers."""

import json
import math
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chaincor.analysis.dumps.printed import end_of
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import last_digit, number_in
from chaincor.workflows.errors import RunError

# These quantities are studied by default if the script has no thermostat.
ALL = ("etotal:drift", "etotal:fluctuation", "temp", "pe", "press")
KINDS = ("mean", "last", "drift", "fluctuation")
# These thermo keywords are energies, in the unit of `ke`.
_ENERGIES = (
    *("etotal", "econserve", "ecouple", "pe", "ke", "evdwl", "ecoul", "epair", "ebond", "eangle"),
    *("edihed", "eimp", "emol", "elong", "etail", "enthalpy"),
)
_QUANTITY = re.compile(r"(?P<what>[cfv]_\w+(\[\d+\])*|[a-z][a-z0-9]*)(:(?P<kind>\w+))?", re.ASCII)
# The search for a pattern may take very long or fill the memory. The search therefore runs in a
# separate process, for at most this number of seconds.
PATTERN_SECONDS = 10.0
_LONGEST_PATTERN = 1000
# Only the last match counts, so only the end of a long output is searched.
_MOST_BYTES = 8_000_000
_PROGRAM = """
import json, re, sys
try:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30))
except (ImportError, ValueError, OSError):
    pass
asked = json.load(sys.stdin)
try:
    pattern = re.compile(asked["pattern"], re.MULTILINE)
except (re.error, OverflowError, RecursionError, MemoryError) as error:
    print(json.dumps({"wrong": str(error) or type(error).__name__}))
    sys.exit()
last = None
for last in pattern.finditer(asked["text"]):
    pass
print(json.dumps({"groups": pattern.groups, "found": None if last is None else last.groups()[:1]}))
"""


@dataclass(frozen=True)
class ObservedNumber:
    """Value of a quantity in one run."""

    value: float  #: Value of the quantity.
    unit: float = 0.0  #: Unit of the last printed digit; 0 for sampled quantities.
    #: Standard error of a mean, from the samples of this run; inf if the samples are too few, nan
    #: if the quantity is not a mean.
    error: float = math.nan
    independent: float = math.nan  #: Number of independent samples in a mean.


@dataclass(frozen=True)
class Quantity:
    """Quantity that is computed from the samples of a run."""

    what: (
        str  #: Name of the quantity in LAMMPS's formulas: ``etotal``, ``c_1``, ``c_1[2]``, ``v_x``.
    )
    #: ``mean`` over the second half of the run, ``last`` value, ``drift`` or ``fluctuation``. A
    #: line is fitted to the samples of the whole run. The drift is its slope times the length of
    #: the run, and the fluctuation is the standard deviation about the line.
    kind: str

    @property
    def is_energy_change(self) -> bool:
        """Whether this is the drift or fluctuation of an energy."""
        return self.what in _ENERGIES and self.kind in ("drift", "fluctuation")

    def __str__(self) -> str:
        return f"{self.what}:{self.kind}"


@dataclass(frozen=True)
class RequestedNumbers:
    """Quantities that a study reads from each run."""

    #: Regular expression for a number that the script prints; None without such a number.
    pattern: str | None
    quantities: tuple[Quantity, ...]  #: Quantities that are sampled during the run.

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all requested quantities, with the pattern first."""
        return (*([] if self.pattern is None else [self.pattern]), *map(str, self.quantities))

    @property
    def sampled(self) -> tuple[str, ...]:
        """Names of the sampled quantities, and the kinetic energy if a tolerance needs it."""
        scale = ["ke"] if any(each.is_energy_change for each in self.quantities) else []
        return tuple(dict.fromkeys([*(each.what for each in self.quantities), *scale]))


def read_quantity(text: str) -> Quantity:
    """Read ``KEYWORD`` or ``KEYWORD:KIND``; raise InputError for other text."""
    found = _QUANTITY.fullmatch(text)
    kind = found["kind"] or "mean" if found else ""
    if not found or kind not in KINDS:
        raise InputError(
            f"the quantity is {text!r}. Give a thermo keyword, compute or variable, such as "
            f"etotal, c_1[2] or v_x, and add one of :{', :'.join(KINDS)} if needed"
        )
    return Quantity(found["what"], kind)


def read_asked(
    quantities: Sequence[str], observable: str | None, default: Sequence[str] = ALL
) -> RequestedNumbers:
    """
    Read the requested quantities; raise InputError if one is invalid or given twice.

    `default` are the quantities if neither quantities nor a pattern is given.
    """
    if observable is not None:
        check_pattern(observable)
    texts = tuple(quantities) if quantities or observable is not None else default
    asked = RequestedNumbers(observable, tuple(read_quantity(text) for text in texts))
    if len(set(asked.names)) < len(asked.names):
        raise InputError(f"{' '.join(texts)} contains a quantity twice. Give each quantity once")
    return asked


def check_pattern(pattern: str) -> None:
    """Raise InputError if a pattern is not a regular expression with one group."""
    if len(pattern) > _LONGEST_PATTERN:
        raise InputError(
            f"--observable has {len(pattern)} characters. Use at most {_LONGEST_PATTERN}"
        )
    answer = _search(pattern, "")
    if answer is None:
        raise InputError(
            f"compiling --observable {pattern!r} takes longer than "
            f"{PATTERN_SECONDS:g} s or more than 1 GB of memory. Use a simple "
            "pattern, such as 'restitution = (\\S+)'"
        )
    if "wrong" in answer:
        raise InputError(
            f"--observable {pattern!r} is no regular expression "
            f"({answer['wrong']}). Use one such as 'restitution = (\\S+)'"
        )
    if answer["groups"] != 1:
        raise InputError(
            f"--observable {pattern!r} has {answer['groups']} groups. Put one pair of "
            "brackets around the number ('restitution = (\\S+)'), and write other brackets "
            "as (?:...)"
        )


def find_observable(pattern: str, output: Path) -> ObservedNumber:
    """
    Return the number in the last match of a pattern in a script's output.

    Raise RunError if nothing matches, if the match is no finite number, or if the search takes too
    long.
    """
    answer = _search(pattern, end_of(output, _MOST_BYTES))
    if answer is None:
        raise RunError(
            f"the search for {pattern!r} takes longer than {PATTERN_SECONDS:g} s or "
            "more than 1 GB of memory. Use a pattern without nested repetition"
        )
    if answer.get("found") is None:
        raise RunError(
            f"no printed line matches {pattern!r}. Correct the pattern, or print "
            "the number in the script"
        )
    return read_observed(pattern, answer["found"][0])


def read_observed(pattern: str, text: str | None) -> ObservedNumber:
    """Convert matched text to a number and the unit of its last digit."""
    shown = (text or "").strip(" \t,;()[]\"'")
    value = number_in(shown)
    if value is None:
        raise RunError(
            f"{pattern!r} matches {(text or '')[:60]!r}, which is no number. Put the "
            "brackets around the number only"
        )
    if not math.isfinite(value):
        raise RunError(f"the script prints {text!r} for {pattern!r}. Print a finite number")
    return ObservedNumber(value, last_digit(shown))


def _search(pattern: str, text: str) -> dict[str, Any] | None:
    """Search in a separate process; return None if the search had to be stopped."""
    try:
        done = subprocess.run(
            [sys.executable, "-I", "-S", "-c", _PROGRAM],
            input=json.dumps({"pattern": pattern, "text": text}),
            capture_output=True,
            text=True,
            timeout=PATTERN_SECONDS,
            check=False,
        )
        return dict(json.loads(done.stdout))
    except (subprocess.TimeoutExpired, ValueError):
        return None
