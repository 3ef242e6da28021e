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
from numpy.typing import NDArray

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.script_run import Runner, ScriptRun
from chaincor.workflows.scripts.timed_runs import FRAME_FILE

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
    """
    A run beside the script's own.

    Attributes
    ----------
    what : str
        What it did otherwise.
    kind : str
        ``same``: not a digit differs; ``together``: roundings stay invisible; ``chaos``: they grow
        until the runs have parted; ``at once``: no rounding does that.
    parted : float or None
        Physical time at which the runs had parted.
    growth : float or None
        lambda, the rate at which the distance grew.
    times, distances : ndarray of shape (S,)
        Root-mean-square distance between the runs' particles, in distances of neighbours.
    numbers : dict of str to tuple
        By name: the script's own number, the difference, and the standard error of that, nan where
        it is not known.
    """

    what: str
    kind: str
    parted: float | None
    growth: float | None
    times: NDArray[np.float64]
    distances: NDArray[np.float64]
    numbers: dict[str, tuple[float, float, float]]

    def agrees(self, name: str) -> bool | None:
        """Return whether a number's difference is within three standard errors; None: not known."""
        _, difference, error = self.numbers[name]
        if difference == 0.0:
            return True
        return None if not math.isfinite(error) else abs(difference) <= _SURE * error


def compare_last_digit(runner: Runner) -> Comparison:
    """Run the script as it stands, and with all particles displaced by a last digit."""
    first = _run(runner, "as it stands")
    second = _run(runner, "last digit changed", _LAST_DIGIT)
    return _compare("last digit of the coordinates", first, second)


def compare_ranks(runner: Runner, ranks: tuple[int, ...]) -> tuple[Comparison, ...]:
    """Run the script on each number of processes, and compare with the first."""
    launcher = _launcher(runner.lmp)
    runs = [
        _run(replace(runner, lmp=f"{launcher} -n {k} {runner.lmp}"), f"{k} processes")
        for k in ranks
    ]
    return tuple(
        _compare(f"{k} processes instead of {ranks[0]}", runs[0], each)
        for k, each in zip(ranks[1:], runs[1:], strict=True)
    )


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


_Found = tuple[ScriptRun, NDArray[np.float64], NDArray[np.float64], float]


def _run(runner: Runner, name: str, shaken: float = 0.0) -> _Found:
    """Return a run, the times of its frames, its positions, and the distance of neighbours."""
    frames: list[tuple[NDArray[np.float64], NDArray[np.float64], float]] = []
    run = runner.run(
        name,
        Change(shaken=shaken, frames=True),
        read=lambda folder: frames.append(read_frames(folder / FRAME_FILE)),
    )
    if run.failure:
        raise runner.error(f"with {name}", run.failure)
    return run, *frames[0]


def read_frames(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """
    Read the positions that were written with the samples.

    Returns times of shape (S,), positions of shape (S, N, 3), nan beyond the particles of a frame,
    and the distance of neighbours, that of as many particles on a simple cubic lattice.
    """
    times: list[float] = []
    frames: list[NDArray[np.float64]] = []
    spacing = 1.0
    lines = path.read_text("utf-8").splitlines() if path.is_file() else []
    k = 0
    while k < len(lines):
        item = lines[k]
        if item.startswith("ITEM: TIME") and item != "ITEM: TIMESTEP":
            times.append(float(lines[k + 1]))
        elif item.startswith("ITEM: NUMBER"):
            count = int(lines[k + 1])
        elif item.startswith("ITEM: BOX"):
            box = [[float(x) for x in line.split()] for line in lines[k + 1 : k + 4]]
            spacing = (math.prod(row[1] - row[0] for row in box) / max(count, 1)) ** (1.0 / 3.0)
        elif item.startswith("ITEM: ATOMS"):
            rows = [line.split() for line in lines[k + 1 : k + 1 + count]]
            frames.append(np.array(rows, dtype=float).reshape(-1, 4)[:, 1:])
            k += count
        k += 1
    if not frames:
        raise InputError("the script wrote no positions; expected a 'run' with particles")
    most = max(len(frame) for frame in frames)
    padded = [np.pad(f, ((0, most - len(f)), (0, 0)), constant_values=np.nan) for f in frames]
    return np.array(times), np.array(padded), spacing


def _compare(what: str, first: _Found, second: _Found) -> Comparison:
    """Say how the distance of two runs grew, and what became of the numbers."""
    count = min(len(first[1]), len(second[1]))
    times = first[1][:count]
    particles = min(first[2].shape[1], second[2].shape[1])
    apart = first[2][:count, :particles] - second[2][:count, :particles]
    distances = np.sqrt(np.nanmean(np.sum(apart**2, axis=2), axis=1)) / first[3]
    numbers = {
        name: (
            number.value,
            second[0].numbers[name].value - number.value,
            math.hypot(number.error, second[0].numbers[name].error),
        )
        for name, number in first[0].numbers.items()
    }
    kind, parted, growth = judge_distances(times, distances)
    return Comparison(what, kind, parted, growth, times, distances, numbers)


def judge_distances(
    times: NDArray[np.float64], distances: NDArray[np.float64]
) -> tuple[str, float | None, float | None]:
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
