"""
Compare runs that should differ only by roundings: process count, last digit, restart.

In chaotic motion, the distance between the runs grows as exp(lambda t) until the runs have parted.
In a crystal, the distance does not grow. If the runs differ from the beginning, roundings are not
the cause, and the module searches for another one.
"""

import math
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.frames import ScriptFrames
from chaincor.workflows.scripts.halving import find_halfway
from chaincor.workflows.scripts.matching import IndexArray, match_particles
from chaincor.workflows.scripts.parting_causes import find_causes
from chaincor.workflows.scripts.quantities import RequestedNumbers
from chaincor.workflows.scripts.restarting import Halfway
from chaincor.workflows.scripts.script_run import Runner, ScriptRun
from chaincor.workflows.scripts.varied import LAST_DIGIT, RANKS, RESTART, Varied

# Runs have parted if their particles differ by more than this fraction of the distance between
# neighbours.
PARTED = 0.01
# During the first fraction _EARLY of a run, rounding errors move particles by at most _AT_ONCE
# times the distance between neighbours.
_AT_ONCE, _EARLY = 1e-6, 0.1
# Particles are displaced by this fraction of the box length, to change the last digit of positions.
_SHAKEN = 1e-15
# The growth rate is fitted to distances above this multiple of the smallest distance.
_GROWN_FROM = 1e3
_SURE = 3.0
# Without chaos, rounding errors change a quantity by at most this fraction.
_ROUNDING = 1e-10
# Times are sums of steps. Due to rounding, equal times can differ by up to this fraction.
_SAME_TIME = 1e-9


@dataclass(frozen=True)
class Difference:
    """Difference in one quantity between two runs."""

    value: float  #: Value in the first run.
    difference: float  #: Value in the second run minus the value in the first run.
    #: Standard error of the difference; nan unless the quantity is a mean, inf if the samples are
    #: too few.
    error: float
    #: Number of independent samples in the mean, from the run with fewer of them.
    independent: float

    @property
    def is_rounding(self) -> bool:
        """Whether roundings alone can explain the difference."""
        return abs(self.difference) <= _ROUNDING * abs(self.value)

    @property
    def agrees(self) -> bool | None:
        """Whether the difference is within three standard errors; None if unknown."""
        if self.is_rounding:
            return True
        return None if not math.isfinite(self.error) else abs(self.difference) <= _SURE * self.error


@dataclass(frozen=True)
class PartingComparison:
    """Comparison of one run with the first run."""

    what: str  #: Difference between the setups of the runs, in words.
    #: ``same``: all digits agree; ``together``: the runs differ only by roundings; ``chaos``:
    #: roundings grow until the runs have parted; ``at once``: the runs differ by more than
    #: roundings from the beginning.
    kind: str
    #: Physical time of the first frame in which the runs have parted; None if they have not parted.
    parted: float | None
    growth: float | None  #: Rate lambda at which the distance grew; None if unknown.
    #: Times of the frames that both runs have, of shape (S,).
    times: Array
    #: Root-mean-square distance between the runs' particles, in units of the distance between
    #: neighbours, of shape (S,).
    distances: Array
    numbers: dict[str, Difference]  #: Differences between the runs, by quantity.
    renumbered: bool = False  #: Whether ids differed, so that particles were matched by position.
    causes: tuple[
        str, ...
    ] = ()  #: Possible causes of a difference from the beginning, with the likeliest first.

    def agrees(self, name: str) -> bool | None:
        """Return whether a quantity differs by at most three standard errors; None if unknown."""
        return self.numbers[name].agrees


def compare_runs(runner: Runner, varied: Varied) -> tuple[PartingComparison, ...]:
    """Execute the runs that `varied` describes, and compare each of them with the first."""
    what, values = varied.switch
    start: Halfway | None = None
    if varied.kind == RANKS:
        mpi = _launcher(runner.lmp)
        runs = [
            _run(replace(runner, lmp=f"{mpi} -n {k} {runner.lmp}"), f"{k} processes")
            for k in values
        ]
        names = [f"{k} processes instead of {values[0]}" for k in values[1:]]
    elif varied.kind == LAST_DIGIT:
        runs = [_run(runner, "as it stands"), _run(runner, "last digit changed", shaken=_SHAKEN)]
        names = ["last digit of the coordinates"]
    elif varied.kind == RESTART:
        start = find_halfway(runner, varied.script)
        runs = [
            _run(runner, "a restart written halfway", restart=start),
            _run(runner, "a restart read", restart=replace(start, reads=True)),
        ]
        names = [f"restart read at step {start.step} instead of one run"]
    else:
        runs = [_run(runner, f"{what} = {each}", variables={what: each}) for each in values]
        names = [f"{what} = {each} instead of {values[0]}" for each in values[1:]]
    return tuple(
        _compare(varied, runner.asked, name, runs[0], run)
        for name, run in zip(names, runs[1:], strict=True)
    )


def _launcher(lmp: str) -> str:
    """Return the MPI launcher from LAMMPS's folder or from the PATH."""
    beside = str(Path(lmp.split()[0]).parent)
    found = next(
        (path for where in (beside, None) for name in ("mpiexec", "mpirun")
         if (path := shutil.which(name, path=where))),
        None,
    )  # fmt: skip
    if found is None:
        raise InputError(
            "there is no mpiexec beside LAMMPS or on the PATH. Install MPI: pip install mpich"
        )
    return found


def _run(runner: Runner, name: str, **change: object) -> ScriptRun:
    run = runner.run(name, Change(frames=True, **change))  # type: ignore[arg-type]
    if run.failure:
        raise runner.error(f"with {name}", run.failure)
    return run


def _common_times(first: ScriptFrames, second: ScriptFrames) -> tuple[IndexArray, IndexArray]:
    """Return the indices of the frames in two runs that have equal times."""
    span = max(float(first.times[-1]), 1e-300)
    places = np.searchsorted(first.times, second.times - _SAME_TIME * span)
    places = np.minimum(places, len(first.times) - 1)
    same = np.abs(first.times[places] - second.times) <= _SAME_TIME * span
    return places[same], np.flatnonzero(same)


def _compare(
    varied: Varied, asked: RequestedNumbers, what: str, first: ScriptRun, second: ScriptRun
) -> PartingComparison:
    """Compare two runs: the distance between their particles, and their quantities."""
    assert first.frames is not None
    assert second.frames is not None
    ours, theirs = _common_times(first.frames, second.frames)
    if len(ours) < 2:
        raise InputError(
            f"the runs have only {len(ours)} sampled times in common ({what}). Choose run "
            "lengths so that all runs are sampled several times at equal physical times"
        )
    here, there = first.frames.positions[ours], second.frames.positions[theirs]
    begun = np.isfinite(here[:, 0, 0]) & np.isfinite(there[:, 0, 0])
    start = int(np.argmax(begun))
    at = int(ours[start]), int(theirs[start])
    match = match_particles(first.frames, second.frames, at)
    particles = min(here.shape[1], there.shape[1])
    order = np.arange(particles)
    order[: len(match.order)] = match.order[:particles]
    apart = here[:, :particles] - there[:, order]
    edges = first.frames.edges
    inside = np.isfinite(edges)
    images = np.round(apart[start][:, inside] / edges[inside])
    apart[:, :, inside] -= np.where(np.isfinite(images), images, 0.0) * edges[inside]
    distances = np.sqrt(np.nanmean(np.sum(apart**2, axis=2), axis=1)) / first.frames.spacing
    times = first.frames.times[ours]
    known = np.isfinite(distances)
    kind, parted, growth = judge_distances(times[known], distances[known])
    causes: tuple[str, ...] = ()
    if kind == "at once":
        causes = find_causes(varied, match)
    return PartingComparison(
        what, kind, parted, growth, times, distances, _differences(asked, first, second),
        renumbered=match.renumbered, causes=causes,
    )  # fmt: skip


def _differences(
    asked: RequestedNumbers, first: ScriptRun, second: ScriptRun
) -> dict[str, Difference]:
    """Return the differences in the quantities, for samples over their common time."""
    found = {}
    sampled = {str(each): each for each in asked.quantities}
    for name in first.numbers:
        runs = [first.numbers[name], second.numbers[name]]
        if name in sampled and first.samples is not None and second.samples is not None:
            start = max(each.samples.times[0] for each in (first, second) if each.samples)
            if start > first.samples.times[0] + _SAME_TIME * first.samples.end:
                runs = [
                    each.number(sampled[name], start) for each in (first.samples, second.samples)
                ]
        error = math.hypot(*(each.error for each in runs))
        independent = min(each.independent for each in runs)
        found[name] = Difference(runs[0].value, runs[1].value - runs[0].value, error, independent)
    return found


def judge_distances(times: Array, distances: Array) -> tuple[str, float | None, float | None]:
    """
    Judge the distance between two runs, and return verdict, parting time and growth rate.

    The growth rate is the slope of the distance's logarithm, fitted between a thousand times the
    smallest distance above 0 and the distance at which the runs have parted. The parting time and
    the growth rate are None if the runs do not part.
    """
    if not np.any(distances > 0.0):
        return "same", None, None
    span = times - times[0]
    beyond = np.flatnonzero(distances > PARTED)
    parted = float(span[beyond[0]]) if len(beyond) else None
    if np.any(distances[span <= _EARLY * span[-1]] > _AT_ONCE) and (
        np.flatnonzero(distances > _AT_ONCE)[0] <= 2
    ):
        return "at once", parted, None
    least = float(np.min(distances[distances > 0.0]))
    end = int(beyond[0]) if len(beyond) else len(distances)
    fitted = np.flatnonzero(distances[:end] > min(_GROWN_FROM * least, 0.1 * PARTED))
    growth = None
    if parted is not None and len(fitted) > 2:
        growth = float(np.polyfit(span[fitted], np.log(distances[fitted]), 1)[0])
    return ("chaos" if parted is not None else "together"), parted, growth
