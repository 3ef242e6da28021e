"""What is asked of a run: thermo keywords, computes and variables, and what of them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.ladders.series import standard_error
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.errors import RunError
from chaincor.workflows.scripts.observable import Observed, check_pattern

# What is asked for without a word.
ALL = ("etotal:drift", "etotal:fluctuation", "temp", "pe", "press")
KINDS = ("mean", "last", "drift", "fluctuation")
# The share of the run, at its end, that means are taken over.
SHARE = 0.5
# Fewer samples tell neither a mean's error nor a drift.
LEAST_SAMPLES = 8
_QUANTITY = re.compile(r"(?P<what>[cfv]_\w+(\[\d+\])*|[a-z][a-z0-9]*)(:(?P<kind>\w+))?", re.ASCII)


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

    times: NDArray[np.float64]  #: Physical times; of shape (S,).
    values: dict[str, NDArray[np.float64]]  #: By quantity; of shape (S,).

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
