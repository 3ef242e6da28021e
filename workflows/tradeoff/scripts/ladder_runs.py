"""One ladder of a script: its runs made and judged, with an advice."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.ladders.verdict import LEAST_RUNGS, LadderVerdict, judge_ladder
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.tradeoff.scripts.advice import (
    ScriptAdvice,
    give_advice,
    promised_errors,
)
from chaincor.workflows.tradeoff.scripts.ladder import Ladder
from chaincor.workflows.tradeoff.scripts.script_run import ScriptRun, ScriptRunError, run_script
from chaincor.workflows.tradeoff.scripts.script_text import ScriptText

SEED = "seed"
# The coarse end should not be the dear one: then somebody gave the ends the other way round.
_DEARER, _SURELY_SECONDS = 2.0, 0.5

# Called with what is being run and the fraction of the study that is done.
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class ScriptLadder:
    """
    One ladder of a script.

    Attributes
    ----------
    fixed : dict
        Values of the variables that stay, as text.
    runs : tuple of ScriptRun
        Every run, failed ones among them, in the order they were made.
    values : ndarray of shape (R,)
        The rungs all of whose runs ended well, coarse to fine.
    inputs, results : ndarray of shape (R, M)
        Values of the variable and the numbers found, run by run.
    seconds : ndarray of shape (R,)
        Processor time of one run: the median of a rung.
    resolution : float
        Unit of the last digit printed, of the most exact run.
    verdict : LadderVerdict
        What the error is like.
    promised : ndarray of shape (R,)
        Error that one run on a rung keeps; inf where it cannot be told.
    advice : ScriptAdvice or None
        For the tolerance; None without one, and where nothing can be advised.
    repeatable : bool
        Whether the same command gave the same digits twice.
    """

    fixed: dict[str, str]
    runs: tuple[ScriptRun, ...]
    values: NDArray[np.float64]
    inputs: NDArray[np.float64]
    results: NDArray[np.float64]
    seconds: NDArray[np.float64]
    resolution: float
    verdict: LadderVerdict
    promised: NDArray[np.float64]
    advice: ScriptAdvice | None
    repeatable: bool


@dataclass(frozen=True)
class Runner:
    """What all runs of a study share."""

    script: ScriptText
    ladder: Ladder
    files: list[Path]
    observable: str
    lmp: str
    scratch: Path
    timeout: float
    seeds: tuple[int, ...]
    columns: int

    def run(self, fixed: dict[str, str], rung: int, column: int, again: bool = False) -> ScriptRun:
        """Run one phase or seed of a rung; `again` with the first seed's value and another seed."""
        value = self.ladder.value(rung, column, self.columns)
        variables = {self.ladder.name: self.ladder.text(value), **fixed}
        if self.seeds:
            variables[SEED] = str(self.seeds[1 if again else column])
        return run_script(
            self.script.path,
            self.files,
            variables,
            self.observable,
            lmp=self.lmp,
            scratch=self.scratch,
            timeout=self.timeout,
        )


def measure_ladder(
    runner: Runner, fixed: dict[str, str], tolerance: float | None, progress: Progress
) -> ScriptLadder:
    """Run one ladder, both ends first: they show what is wrong before time is spent."""
    ladder, columns = runner.ladder, runner.columns
    name = " ".join(f"{key} {value}" for key, value in fixed.items()) or ladder.name
    weights = np.array(
        [1.0 / ladder.step(ladder.value(r, 0, columns)) for r in range(ladder.rungs)]
    )
    weights /= weights.sum() * columns
    progress(name, 0.0)
    fine = runner.run(fixed, ladder.rungs - 1, 0)
    if fine.failure:
        raise _failed(runner, fine)
    done = {(ladder.rungs - 1, 0): fine}
    coarse = done[0, 0] = runner.run(fixed, 0, 0)
    _check_ends(runner, coarse, fine)
    runs = [fine, coarse]
    good: list[int] = []
    for rung in range(ladder.rungs):
        for column in range(columns):
            if (rung, column) not in done:
                done[rung, column] = runner.run(fixed, rung, column)
                runs.append(done[rung, column])
            if done[rung, column].failure:
                break
            progress(name, min(1.0, float(weights[:rung].sum() * columns + weights[rung] * column)))
        else:
            good.append(rung)
    if len(good) < LEAST_RUNGS:
        raise _failed(runner, next(run for run in runs[::-1] if run.failure))
    repeatable = _repeat(runner, fixed, done[good[0], 0], good[0])
    observed = [[done[r, c].observed for c in range(columns)] for r in good]
    results = np.array([[o.value for o in row if o is not None] for row in observed])
    inputs = np.array([[ladder.value(r, c, columns) for c in range(columns)] for r in good])
    steps = np.array([[ladder.step(value) for value in row] for row in inputs])
    resolution = min(o.unit for row in observed for o in row if o is not None)
    seconds = np.array([np.median([done[r, c].seconds for c in range(columns)]) for r in good])
    verdict = judge_ladder(steps, results, resolution=resolution, seeded=bool(runner.seeds))
    values = np.array([ladder.value(r, 0, columns) for r in good])
    seeded = bool(runner.seeds)
    return ScriptLadder(
        fixed=fixed,
        runs=tuple(runs),
        values=values,
        inputs=inputs,
        results=results,
        seconds=seconds,
        resolution=resolution,
        verdict=verdict,
        promised=promised_errors(verdict),
        advice=None
        if tolerance is None
        else give_advice(ladder, values, verdict, seconds, tolerance, seeded=seeded),
        repeatable=repeatable,
    )


def _check_ends(runner: Runner, coarse: ScriptRun, fine: ScriptRun) -> None:
    """Raise InputError where the variable is not used, or the ends are the wrong way round."""
    ladder, script = runner.ladder, runner.script
    if coarse.observed is None or fine.observed is None:
        return
    if coarse.observed.value == fine.observed.value and not script.mentions(ladder.name):
        raise InputError(
            f"{script.path.name} prints {fine.observed.value!r} at both ends of the ladder and "
            f"does not mention ${{{ladder.name}}}; expected a script that uses the variable"
        )
    if coarse.seconds > _DEARER * fine.seconds and coarse.seconds > _SURELY_SECONDS:
        raise InputError(
            f"a run at {ladder.name} = {ladder.coarse:g} takes {coarse.seconds:.2g} s and at "
            f"{ladder.fine:g} only {fine.seconds:.2g} s; expected the coarse end first: "
            f"--vary {ladder.name}={ladder.fine:g}:{ladder.coarse:g}:{ladder.rungs}"
        )


def _repeat(runner: Runner, fixed: dict[str, str], first: ScriptRun, rung: int) -> bool:
    """Run one command again: with the same seed or, to see that it matters, with another."""
    second = runner.run(fixed, rung, 0, again=True)
    if second.failure:
        raise _failed(runner, second)
    assert first.observed is not None
    assert second.observed is not None
    same = first.observed.value == second.observed.value
    if runner.seeds and same:
        raise InputError(
            f"{runner.script.path.name} prints {first.observed.value!r} with seed "
            f"{runner.seeds[0]} and with {runner.seeds[1]}; expected a script whose random numbers "
            "obey the variable 'seed': leave --seeds out where it draws none"
        )
    return same or bool(runner.seeds)


def _failed(runner: Runner, run: ScriptRun) -> ScriptRunError:
    given = ", ".join(f"{name} = {value}" for name, value in run.variables.items())
    return ScriptRunError(
        f"{runner.script.path.name} failed at {given}: {run.failure}; expected a run that ends and "
        f"prints its number: files, screen and command are kept in {runner.scratch}"
    )
