"""What is asked of a run, numbers that it prints or that are sampled, and how that is read."""

import json
import math
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from chaincor.analysis.dumps.printed import end_of
from chaincor.analysis.ladders.series import standard_error
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import last_digit, number_in
from chaincor.workflows.errors import RunError

# What is asked for without a word.
ALL = ("etotal:drift", "etotal:fluctuation", "temp", "pe", "press")
KINDS = ("mean", "last", "drift", "fluctuation")
# The share of the run, at its end, that means are taken over.
SHARE = 0.5
# Fewer samples tell neither a mean's error nor a drift.
LEAST_SAMPLES = 8
_QUANTITY = re.compile(r"(?P<what>[cfv]_\w+(\[\d+\])*|[a-z][a-z0-9]*)(:(?P<kind>\w+))?", re.ASCII)
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


@dataclass(frozen=True)
class Quantity:
    """A number of a run."""

    what: str  #: As LAMMPS's formulas name it: ``etotal``, ``c_1``, ``c_1[2]``, ``v_x``.
    #: ``mean`` over the end of the run, ``last`` value, ``drift`` (slope of the line through the
    #: samples, times their span) or ``fluctuation`` (standard deviation about that line).
    kind: str

    def __str__(self) -> str:
        return f"{self.what}:{self.kind}"


@dataclass(frozen=True)
class Asked:
    """What is read from a run."""

    pattern: str | None  #: Regular expression of a number that the script prints.
    quantities: tuple[Quantity, ...]  #: Numbers that are sampled.

    @property
    def names(self) -> tuple[str, ...]:
        """The numbers, by name."""
        return (*([] if self.pattern is None else [self.pattern]), *map(str, self.quantities))

    @property
    def sampled(self) -> tuple[str, ...]:
        """What is sampled, each once."""
        return tuple(dict.fromkeys(each.what for each in self.quantities))


@dataclass(frozen=True)
class Samples:
    """What was sampled in a run."""

    times: Array  #: Physical times, up to its end; of shape (S,).
    values: dict[str, Array]  #: By quantity; of shape (S,).

    @property
    def end(self) -> float:
        """The time at which the run ended."""
        return float(self.times[-1])

    def number(self, quantity: Quantity) -> Observed:
        """Return a number of the run, a mean with the standard error of a correlated series."""
        all_values = self.values[quantity.what]
        if quantity.kind == "last":
            return Observed(float(all_values[-1]))
        times = self.times - self.times[0]
        start = (1.0 - SHARE) * times[-1]
        # Times are sums of steps, and rounded.
        inside = times > start + 1e-9 * times[-1]
        values = np.concatenate([[np.interp(start, times, all_values)], all_values[inside]])
        times = np.concatenate([[start], times[inside]])
        # Integrals by the trapezoidal rule: samples lie elsewhere at another step.
        halves = 0.5 * np.diff(times)
        weights = np.append(halves, 0.0) + np.append(0.0, halves)
        weights /= weights.sum()
        mean = float(weights @ values)
        if quantity.kind == "mean":
            return Observed(mean, error=standard_error(values))
        from_middle = times - weights @ times
        slope = float((weights * from_middle) @ values / (weights @ from_middle**2))
        if quantity.kind == "drift":
            return Observed(slope * float(np.ptp(times)))
        return Observed(float(np.sqrt(weights @ (values - mean - slope * from_middle) ** 2)))


def read_quantity(text: str) -> Quantity:
    """Read ``KEYWORD`` or ``KEYWORD:KIND``; raises InputError for anything else."""
    found = _QUANTITY.fullmatch(text)
    kind = found["kind"] or "mean" if found else ""
    if not found or kind not in KINDS:
        raise InputError(
            f"the quantity is {text!r}; expected a thermo keyword, compute or variable, such as "
            f"etotal, c_1[2] or v_x, and one of :{', :'.join(KINDS)} behind it or nothing"
        )
    return Quantity(found["what"], kind)


def read_asked(quantities: Sequence[str], observable: str | None) -> Asked:
    """Read what is asked for; raises InputError where it makes no sense, or is given twice."""
    if observable is not None:
        check_pattern(observable)
    texts = tuple(quantities) if quantities or observable is not None else ALL
    asked = Asked(observable, tuple(read_quantity(text) for text in texts))
    if len(set(asked.names)) < len(asked.names):
        raise InputError(f"a quantity is given twice in {' '.join(texts)}; expected each once")
    return asked


def read_samples(path: Path, quantities: tuple[str, ...]) -> Samples:
    """
    Read what a run sampled: time and quantities, a line each.

    Times that begin again, after ``clear``, go on from where they were. Raises RunError where
    nothing, too little or no finite number was sampled.
    """
    if not path.is_file():
        raise RunError(
            "nothing was sampled: no 'run' of the script took place while what is asked for was "
            "defined; expected a script that runs, and computes, fixes and variables of it"
        )
    rows = []
    for line in path.read_text("utf-8").splitlines():
        words = line.split()
        if len(words) == 1 + len(quantities):
            rows.append([float(word) for word in words])
    data = np.array(rows).reshape(-1, 1 + len(quantities))
    if len(data) < LEAST_SAMPLES:
        raise RunError(
            f"only {len(data)} samples were taken; expected runs of {LEAST_SAMPLES} steps at least"
        )
    for what, column in zip(quantities, data.T[1:], strict=True):
        if not np.all(np.isfinite(column)):
            raise RunError(f"{what} is {column[~np.isfinite(column)][0]} in the run")
    steps = np.diff(data[:, 0])
    times = data[0, 0] + np.concatenate([[0.0], np.cumsum(np.where(steps > 0.0, steps, 0.0))])
    # Each run begins with the sample that the one before ended with.
    kept = np.concatenate([[True], np.diff(times) > 0.0])
    values = {what: data[kept, k] for k, what in enumerate(quantities, 1)}
    return Samples(times[kept], values)


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
    answer = _search(pattern, end_of(output, _MOST_BYTES))
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
    shown = (text or "").strip(" \t,;()[]\"'")
    value = number_in(shown)
    if value is None:
        raise RunError(
            f"{pattern!r} matches {(text or '')[:60]!r}, which is no number; expected the "
            "brackets around the number alone"
        )
    if not math.isfinite(value):
        raise RunError(f"the script prints {text!r} for {pattern!r}; expected a finite number")
    return Observed(value, last_digit(shown))


def _search(pattern: str, text: str) -> dict[str, Any] | None:
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
        return dict(json.loads(done.stdout))
    except (subprocess.TimeoutExpired, ValueError):
        return None


class Frames(NamedTuple):
    """The positions that a run wrote with its samples."""

    times: Array  #: Of shape (S,).
    positions: Array  #: Of shape (S, N, 3); nan beyond the particles of a frame.
    #: The distance of neighbours: that of as many particles on a simple cubic lattice.
    spacing: float


def read_frames(path: Path) -> Frames:
    """Read the positions of a run; raises InputError where there are none."""
    lines = path.read_text("utf-8").splitlines() if path.is_file() else []
    if not lines:
        raise InputError("the script wrote no positions; expected a 'run' with particles")
    times: list[float] = []
    frames: list[Array] = []
    at = 0
    while at < len(lines):
        # Time, step, number of particles, box, and positions, each below a line that names it.
        count, first = int(lines[at + 5]), at + 11
        times.append(float(lines[at + 1]))
        edges = [[float(x) for x in line.split()] for line in lines[at + 7 : at + 10]]
        rows = [line.split() for line in lines[first : first + count]]
        frames.append(np.array(rows, dtype=float).reshape(-1, 4)[:, 1:])
        at = first + count
    spacing = (math.prod(edge[1] - edge[0] for edge in edges) / max(count, 1)) ** (1.0 / 3.0)
    most = max(len(frame) for frame in frames)
    padded = [np.pad(f, ((0, most - len(f)), (0, 0)), constant_values=np.nan) for f in frames]
    return Frames(np.array(times), np.array(padded), spacing)
