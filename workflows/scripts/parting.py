"""
Whether a difference is a bug, chaos or statistics: runs on other processes, or with a last digit.

Two runs that differ in roundings alone stay together until chaos has made these visible: their
distance grows as exp(lambda t). In a crystal it does not. What differs at once is set up otherwise.
"""

import math
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.script_run import Runner, ScriptRun

# Of the distance between neighbours: runs have parted when they differ by this much.
PARTED = 0.01
# What differs by more in the first tenth of a run was no rounding.
_AT_ONCE, _EARLY = 1e-6, 0.1
# A coordinate's last digit, as a share of the box.
_LAST_DIGIT = 1e-15
# Growth is fitted between roundings and what is visible.
_GROWN_FROM = 1e3
_SURE = 3.0


@dataclass(frozen=True)
class Comparison:
    """A run beside the script's own."""

    what: str  #: What it did otherwise.
    #: ``same``: not a digit differs; ``together``: roundings stay invisible; ``chaos``: they grow
    #: until the runs have parted; ``at once``: no rounding does that.
    kind: str
    parted: float | None  #: Physical time at which the runs had parted.
    growth: float | None  #: lambda, the rate at which the distance grew.
    #: Root-mean-square distance between the runs' particles, in distances of neighbours, at times
    #: of shape (S,).
    times: Array
    distances: Array  #: See ``times``.
    #: By name: the script's own number, the difference, and the standard error of that, nan where
    #: it is not known.
    numbers: dict[str, tuple[float, float, float]]

    def agrees(self, name: str) -> bool | None:
        """Return whether a number's difference is within three standard errors; None: not known."""
        _, difference, error = self.numbers[name]
        if difference == 0.0:
            return True
        return None if not math.isfinite(error) else abs(difference) <= _SURE * error


def compare_runs(runner: Runner, ranks: tuple[int, ...]) -> tuple[Comparison, ...]:
    """Compare runs on numbers of processes with the first; without any, with a last digit moved."""
    if ranks:
        mpi = _launcher(runner.lmp)
        runs = [
            _run(replace(runner, lmp=f"{mpi} -n {k} {runner.lmp}"), f"{k} processes") for k in ranks
        ]
        names = [f"{k} processes instead of {ranks[0]}" for k in ranks[1:]]
    else:
        runs = [_run(runner, "as it stands"), _run(runner, "last digit changed", _LAST_DIGIT)]
        names = ["last digit of the coordinates"]
    return tuple(_compare(name, runs[0], run) for name, run in zip(names, runs[1:], strict=True))


def _launcher(lmp: str) -> str:
    """Return the command that starts copies of LAMMPS: of its own folder, or of the PATH."""
    beside = str(Path(lmp.split()[0]).parent)
    found = next(
        (path for where in (beside, None) for name in ("mpiexec", "mpirun")
         if (path := shutil.which(name, path=where))),
        None,
    )  # fmt: skip
    if found is None:
        raise InputError(
            "there is no mpiexec beside LAMMPS or on the PATH; expected MPI: pip install mpich"
        )
    return found


def _run(runner: Runner, name: str, shaken: float = 0.0) -> ScriptRun:
    run = runner.run(name, Change(shaken=shaken, frames=True))
    if run.failure:
        raise runner.error(f"with {name}", run.failure)
    return run


def _compare(what: str, first: ScriptRun, second: ScriptRun) -> Comparison:
    """Say how the distance of two runs grew, and what became of the numbers."""
    assert first.frames is not None
    assert second.frames is not None
    (times, here, spacing), there = first.frames, second.frames.positions
    count, particles = map(min, zip(here.shape[:2], there.shape[:2], strict=True))
    apart = here[:count, :particles] - there[:count, :particles]
    distances = np.sqrt(np.nanmean(np.sum(apart**2, axis=2), axis=1)) / spacing
    numbers = {
        name: (
            number.value,
            second.numbers[name].value - number.value,
            math.hypot(number.error, second.numbers[name].error),
        )
        for name, number in first.numbers.items()
    }
    kind, parted, growth = judge_distances(times[:count], distances)
    return Comparison(what, kind, parted, growth, times[:count], distances, numbers)


def judge_distances(times: Array, distances: Array) -> tuple[str, float | None, float | None]:
    """
    Return what a growing distance means, the time of parting, and the rate of growth.

    The rate is the slope of the logarithm, fitted from a thousand times the smallest rounding seen
    to what is visible; None where the distance does not grow so far.
    """
    if not np.any(distances > 0.0):
        return "same", None, None
    span = times - times[0]
    beyond = np.flatnonzero(distances > PARTED)
    parted = float(span[beyond[0]]) if len(beyond) else None
    if np.any(distances[span <= _EARLY * span[-1]] > _AT_ONCE) and (
        np.flatnonzero(distances > _AT_ONCE)[0] <= 1
    ):
        return "at once", parted, None
    least = float(np.min(distances[distances > 0.0]))
    end = int(beyond[0]) if len(beyond) else len(distances)
    fitted = np.flatnonzero(distances[:end] > min(_GROWN_FROM * least, 0.1 * PARTED))
    growth = None
    if parted is not None and len(fitted) > 2:
        growth = float(np.polyfit(span[fitted], np.log(distances[fitted]), 1)[0])
    return ("chaos" if parted is not None else "together"), parted, growth
