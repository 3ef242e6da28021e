"""The number that a script prints, found by the user's own pattern."""

import json
import math
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.errors import RunError

# A pattern may take ages, or fill the memory: it is tried in a process of its own.
PATTERN_SECONDS = 10.0
_LONGEST_PATTERN = 1000
# The last match counts: of an endless output its end is enough.
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
class Observed:
    """A number of a run."""

    value: float  #: The number.
    unit: float = 0.0  #: Unit of its last digit, where a script printed it; 0 for what is sampled.
    #: Standard error of a mean, as this run alone tells it; nan for what is none.
    error: float = math.nan


def check_pattern(pattern: str) -> None:
    """Raise InputError unless a pattern is a regular expression with one group."""
    if len(pattern) > _LONGEST_PATTERN:
        raise InputError(
            f"--observable has {len(pattern)} letters; expected {_LONGEST_PATTERN} at most"
        )
    answer = _search(pattern, "")
    if answer is None:
        raise InputError(
            f"--observable {pattern!r} takes longer than {PATTERN_SECONDS:g} s or more memory than "
            "1 GB by itself; expected a simple pattern, such as 'restitution = (\\S+)'"
        )
    if "wrong" in answer:
        raise InputError(
            f"--observable {pattern!r} is no regular expression: {answer['wrong']}; expected one "
            "such as 'restitution = (\\S+)'"
        )
    if answer["groups"] != 1:
        raise InputError(
            f"--observable {pattern!r} has {answer['groups']} groups; expected one pair of "
            "brackets, around the number: 'restitution = (\\S+)'; other brackets as (?:...)"
        )


def find_observable(pattern: str, output: Path) -> Observed:
    """
    Return the last number in a script's output that a pattern matches.

    Raises RunError where nothing matches, what matches is no finite number, or the search takes
    too long.
    """
    with output.open("rb") as file:
        file.seek(max(0, output.stat().st_size - _MOST_BYTES))
        text = file.read().decode("utf-8", "replace")
    answer = _search(pattern, text)
    if answer is None:
        raise RunError(
            f"the search for {pattern!r} takes longer than {PATTERN_SECONDS:g} s or more memory "
            "than 1 GB; expected a pattern without nested repetition"
        )
    if answer.get("found") is None:
        raise RunError(f"the script prints nothing that {pattern!r} matches")
    return read_observed(pattern, answer["found"][0])


def read_observed(pattern: str, text: str | None) -> Observed:
    """Turn matched text into a number and the unit of its last digit."""
    try:
        value = float((text or "").strip(" \t,;()[]\"'"))
    except ValueError:
        value = math.nan
        if (text or "").strip().lower().lstrip("+-") not in ("nan", "inf"):
            raise RunError(
                f"{pattern!r} matches {(text or '')[:60]!r}, which is no number; expected the "
                "brackets around the number alone"
            ) from None
    if not math.isfinite(value):
        raise RunError(f"the script prints {text!r} for {pattern!r}; expected a finite number")
    digits = (text or "").strip(" \t,;()[]\"'").lower()
    mantissa, _, exponent = digits.partition("e")
    decimals = len(mantissa.partition(".")[2])
    return Observed(value, 10.0 ** (int(exponent or 0) - decimals))


def _search(pattern: str, text: str) -> dict | None:
    """Compile and search in a process of its own; None where it had to be stopped."""
    try:
        done = subprocess.run(
            [sys.executable, "-I", "-S", "-c", _PROGRAM],
            input=json.dumps({"pattern": pattern, "text": text}),
            capture_output=True,
            text=True,
            timeout=PATTERN_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None
    try:
        answer: dict = json.loads(done.stdout)
    except ValueError:
        return None
    return answer
