"""One ladder of a script: its runs made and judged, with an advice for each number."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.ladders.verdict import LEAST_RUNGS, LadderVerdict, judge_ladder
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.advice import (
    ScriptAdvice,
    give_advice,
    own_tolerance,
    promised_errors,
)
from chaincor.workflows.scripts.ladder import Ladder
from chaincor.workflows.scripts.rewriting import Change
from chaincor.workflows.scripts.script_run import Asked, ScriptRun, ScriptRunError, run_script
from chaincor.workflows.scripts.script_text import ScriptText

SEED = "seed"
# The coarse end should not be the dear one: then somebody gave the ends the other way round.
_DEARER, _SURELY_SECONDS = 2.0, 0.5
# Runs that end further apart than this share of their time do not answer the same question.
_SAME_END = 1e-6

# Called with what is being run and the fraction of the study that is done.
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class NumberLadder:
    """
    One number of a script along a ladder.

    Attributes
    ----------
    name : str
        Pattern or quantity.
    results : ndarray of shape (R, M)
        What was found, run by run.
    resolution : float
        Unit of the last digit printed, of the most exact run; 0 for what is sampled.
    standard_error : float or None
        Of one run's mean, from the run itself, on the finest rung; None for what is no mean.
    verdict : LadderVerdict
        What the error is like.
    promised : ndarray of shape (R,)
        Error that one run on a rung keeps; inf where it cannot be told.
    tolerance : float or None
        What the advice is for: as asked, or one of its own.
    advice : ScriptAdvice or None
        None where nothing can be advised.
    """

    name: str
    results: NDArray[np.float64]
    resolution: float
    standard_error: float | None
    verdict: LadderVerdict
    promised: NDArray[np.float64]
    tolerance: float | None
    advice: ScriptAdvice | None


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
    given : tuple of float
        The varied value of each of these.
    values : ndarray of shape (R,)
        The rungs all of whose runs ended well, coarse to fine.
    inputs : ndarray of shape (R, M)
        Values, run by run.
    seconds : ndarray of shape (R,)
        Processor time of one run: the median of a rung.
    numbers : tuple of NumberLadder
        What was found.
    ends : tuple of float or None
        Earliest and latest physical time at which runs ended; None where that is not known.
    repeatable : bool
        Whether the same command gave the same digits twice.
    """

    fixed: dict[str, str]
    runs: tuple[ScriptRun, ...]
    given: tuple[float, ...]
    values: NDArray[np.float64]
    inputs: NDArray[np.float64]
    seconds: NDArray[np.float64]
    numbers: tuple[NumberLadder, ...]
    ends: tuple[float, float] | None
    repeatable: bool

    @property
    def ends_apart(self) -> bool:
        """Whether runs ended at different physical times."""
        return self.ends is not None and self.ends[1] - self.ends[0] > _SAME_END * self.ends[1]


@dataclass(frozen=True)
class Runner:
    """What all runs of a study share; `own_step` is the script's, where that is what varies."""

    script: ScriptText
    ladder: Ladder
    files: list[Path]
    asked: Asked
    lmp: str
    scratch: Path
    timeout: float
    seeds: tuple[int, ...]
    columns: int
    own_step: float | None
    setting: bool
    scale_periods: bool
    own_seed: bool

    def run(self, fixed: dict[str, str], rung: int, column: int, again: bool = False) -> ScriptRun:
        """Run one phase or seed of a rung; `again` with the first seed's value and another seed."""
        ladder = self.ladder
        value = ladder.value(rung, column, self.columns)
        change = Change(
            quantities=self.asked.sampled,
            variables=dict(fixed),
            scale_periods=self.scale_periods,
        )
        if self.own_step is not None:
            change = replace(change, finer=self.own_step / value)
        elif self.setting:
            change = replace(change, settings={ladder.name: ladder.text(value)})
        else:
            change = replace(change, variables={ladder.name: ladder.text(value), **fixed})
        if self.seeds:
            seed = self.seeds[1 if again else column]
            if self.own_seed:
                change = replace(change, variables={**change.variables, SEED: str(seed)})
            else:
                change = replace(change, seed=seed)
        name = f"{ladder.name}={ladder.text(value)}_{column}{'_again' if again else ''}"
        return run_script(
            self.script.path,
            self.files,
            self.asked,
            change,
            name="_".join([name, *(f"{k}={v}" for k, v in fixed.items())]),
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
        raise failed(runner, fine, ladder.fine)
    done = {(ladder.rungs - 1, 0): fine}
    coarse = done[0, 0] = runner.run(fixed, 0, 0)
    _check_ends(runner, coarse, fine)
    good: list[int] = []
    for rung in range(ladder.rungs):
        for column in range(columns):
            if (rung, column) not in done:
                done[rung, column] = runner.run(fixed, rung, column)
            if done[rung, column].failure:
                break
            progress(name, min(1.0, float(weights[:rung].sum() * columns + weights[rung] * column)))
        else:
            good.append(rung)
    if len(good) < LEAST_RUNGS:
        place = next(key for key in reversed(done) if done[key].failure)
        raise failed(runner, done[place], ladder.value(*place, columns))
    repeatable = _repeat(runner, fixed, done[good[0], 0], good[0])
    inputs = np.array([[ladder.value(r, c, columns) for c in range(columns)] for r in good])
    seconds = np.array([np.median([done[r, c].seconds for c in range(columns)]) for r in good])
    rows = [[done[r, c] for c in range(columns)] for r in good]
    values = np.array([ladder.value(r, 0, columns) for r in good])
    ends = [run.samples.end for row in rows for run in row if run.samples is not None]
    return ScriptLadder(
        fixed=fixed,
        runs=tuple(done.values()),
        given=tuple(ladder.value(*place, columns) for place in done),
        values=values,
        inputs=inputs,
        seconds=seconds,
        numbers=tuple(
            _judge(runner, each, rows, values, inputs, seconds, tolerance)
            for each in runner.asked.names
        ),
        ends=(min(ends), max(ends)) if ends else None,
        repeatable=repeatable,
    )


def _judge(
    runner: Runner,
    name: str,
    rows: list[list[ScriptRun]],
    values: NDArray[np.float64],
    inputs: NDArray[np.float64],
    seconds: NDArray[np.float64],
    tolerance: float | None,
) -> NumberLadder:
    """Say of one number what its error is like, and what to run."""
    ladder = runner.ladder
    results = np.array([[run.numbers[name].value for run in row] for row in rows])
    resolution = min(run.numbers[name].unit for row in rows for run in row)
    steps = np.array([[ladder.step(value) for value in row] for row in inputs])
    verdict = judge_ladder(steps, results, resolution=resolution, seeded=bool(runner.seeds))
    sampled = name != runner.asked.pattern
    if tolerance is None and sampled:
        tolerance = own_tolerance(verdict)
    errors = [run.errors[name] for run in rows[-1] if name in run.errors]
    error = float(np.sqrt(np.mean(np.square(errors)))) if errors else np.nan
    return NumberLadder(
        name=name,
        results=results,
        resolution=resolution,
        standard_error=error if np.isfinite(error) else None,
        verdict=verdict,
        promised=promised_errors(verdict),
        tolerance=tolerance,
        advice=None
        if tolerance is None
        else give_advice(
            ladder, values, verdict, seconds, tolerance, repeats=bool(runner.seeds) or sampled
        ),
    )


def _check_ends(runner: Runner, coarse: ScriptRun, fine: ScriptRun) -> None:
    """Raise InputError where the variable is not used, or the ends are the wrong way round."""
    ladder, script = runner.ladder, runner.script
    if coarse.failure or fine.failure:
        return
    same = all(coarse.numbers[k].value == fine.numbers[k].value for k in fine.numbers)
    varies_variable = runner.own_step is None and not runner.setting
    if same and varies_variable and not script.mentions(ladder.name):
        value = next(iter(fine.numbers.values())).value
        raise InputError(
            f"{script.path.name} gives {value!r} at both ends of the ladder and "
            f"does not mention ${{{ladder.name}}}; expected a script that uses the variable"
        )
    dearer = coarse.seconds > max(_DEARER * fine.seconds, _SURELY_SECONDS)
    # Of a step it is known which end is fine.
    if dearer and runner.own_step is None:
        raise InputError(
            f"a run at {ladder.name} = {ladder.coarse:g} takes {coarse.seconds:.2g} s and at "
            f"{ladder.fine:g} only {fine.seconds:.2g} s; expected the coarse end first: "
            f"--vary {ladder.name}={ladder.fine:g}:{ladder.coarse:g}:{ladder.rungs}"
        )


def _repeat(runner: Runner, fixed: dict[str, str], first: ScriptRun, rung: int) -> bool:
    """Run one command again: with the same seed or, to see that it matters, with another."""
    second = runner.run(fixed, rung, 0, again=True)
    if second.failure:
        raise failed(runner, second, runner.ladder.value(rung, 0, runner.columns))
    same = all(first.numbers[k].value == second.numbers[k].value for k in first.numbers)
    if runner.seeds and same:
        raise InputError(
            f"{runner.script.path.name} gives {next(iter(first.numbers.values())).value!r} with "
            f"seed {runner.seeds[0]} and with {runner.seeds[1]}; expected a script whose random "
            "numbers obey the variable 'seed', or seeds that are whole numbers in it: leave "
            "--seeds out where it draws none"
        )
    return same or bool(runner.seeds)


def failed(runner: Runner, run: ScriptRun, value: float) -> ScriptRunError:
    """Return the error of a run that failed, with where its files are."""
    told = {runner.ladder.name: runner.ladder.text(value), **run.variables}
    given = ", ".join(f"{name} = {text}" for name, text in told.items())
    return ScriptRunError(
        f"{runner.script.path.name} failed at {given}: {run.failure}; expected a run that ends and "
        f"gives its number: files, screen and command are kept in {runner.scratch}"
    )
