"""Run a script at each value of a ladder, and judge each quantity."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from chaincor.analysis.ladders.verdict import LEAST_RUNGS, LadderVerdict, judge_ladder
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.advice import ScriptAdvice, advise_value
from chaincor.workflows.scripts.ladder import Ladder
from chaincor.workflows.scripts.quantities import RequestedNumbers
from chaincor.workflows.scripts.script_run import Runner, ScriptRun, ScriptRunError
from chaincor.workflows.scripts.tolerances import Tolerance, default_tolerance
from chaincor.workflows.scripts.varied import Varied
from chaincor.workflows.scripts.vary_options import in_whole_numbers

# If LAMMPS refuses a number because it is not whole, it prints one of these messages.
_WANTS_WHOLE = ("Expected integer", "Expected an integer")
# The ends of a ladder were probably exchanged if a run at the coarse end takes more than _DEARER
# times as long as a run at the fine end, and more than _SURELY_SECONDS.
_DEARER, _SURELY_SECONDS = 2.0, 0.5
# End times of comparable runs may differ by at most this fraction.
_SAME_END = 1e-6

# A progress function is called with the name of the current part and the finished fraction of the
# study.
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class NumberLadder:
    """One quantity of a script along a ladder."""

    name: str  #: Pattern, or name of the quantity.
    results: Array  #: Results of M runs on each of R rungs, of shape (R, M).
    #: Smallest unit of the last printed digit in any run; 0 for sampled quantities.
    resolution: float
    #: Standard error of one run's mean on the finest rung; None if the quantity is not a mean or
    #: has too few samples.
    standard_error: float | None
    independent: float | None  #: Number of independent samples of one run's mean.
    verdict: LadderVerdict  #: Verdict on the error.
    tolerance: float | None  #: Tolerance that the advice meets; None if unknown.
    tolerance_reason: str  #: Reason of the default tolerance; empty if the user gave one.
    advice: ScriptAdvice | None  #: Advice; None if the runs allow none.
    repeats: bool  #: Whether the advice may average several runs.


@dataclass(frozen=True)
class ScriptLadder:
    """Runs and results of a script along one ladder."""

    ladder: Ladder  #: The values of the varied setting.
    fixed: dict[str, str]  #: Values of the fixed variables, as text.
    #: All runs, including failed ones, in the order of execution.
    runs: tuple[ScriptRun, ...]
    given: tuple[float, ...]  #: Value of the varied setting in each of `runs`.
    #: Values of the varied setting on the rungs without a failed run, from coarse to fine, of shape
    #: (R, M).
    inputs: Array
    seconds: Array  #: Median processor time of one run on each rung, of shape (R,).
    numbers: tuple[NumberLadder, ...]  #: Results by quantity.
    #: Earliest and latest physical end time of the runs; None if unknown.
    ends: tuple[float, float] | None
    repeatable: bool  #: Whether a repeated command gave the same digits again.

    @property
    def values(self) -> Array:
        """Value of each rung, of shape (R,)."""
        return self.inputs[:, 0]

    @property
    def failed(self) -> list[tuple[float, ScriptRun]]:
        """The failed runs, with their values of the varied setting."""
        runs = zip(self.given, self.runs, strict=True)
        return [(given, run) for given, run in runs if run.failure]

    @property
    def ends_apart(self) -> bool:
        """Whether runs ended at different physical times."""
        return self.ends is not None and self.ends[1] - self.ends[0] > _SAME_END * self.ends[1]


@dataclass(frozen=True)
class _Runs:
    """Runs along one ladder; each run is executed when it is first needed."""

    runner: Runner
    varied: Varied
    fixed: dict[str, str]
    done: dict[tuple[int, int], ScriptRun] = field(default_factory=dict)

    def run(self, rung: int, column: int) -> ScriptRun:
        """Return one run of a rung. If values are whole numbers, equal values share a run."""
        if (rung, column) not in self.done:
            change = self.varied.change(self.fixed, rung, column)
            changes = {
                place: self.varied.change(self.fixed, *place)
                for place in self.done
                if self.varied.ladder.counts
            }
            same = next((place for place, each in changes.items() if each == change), None)
            found = self.anew(rung, column) if same is None else self.done[same]
            self.done[rung, column] = found
        return self.done[rung, column]

    def anew(self, rung: int, column: int, *, again: bool = False) -> ScriptRun:
        """Execute a run; `again` repeats the first run of a rung, with another seed if any."""
        ladder = self.varied.ladder
        text = ladder.text(self.varied.value(rung, column))
        name = f"{ladder.name}={text}_{column}{'_again' if again else ''}"
        return self.runner.run(
            "_".join([name, *(f"{key}={value}" for key, value in self.fixed.items())]),
            self.varied.change(self.fixed, rung, column, again=again),
        )

    def failed(self, run: ScriptRun, rung: int, column: int = 0) -> ScriptRunError:
        """Return the exception for a failed run."""
        ladder = self.varied.ladder
        settings = {ladder.name: ladder.text(self.varied.value(rung, column)), **run.variables}
        where = "at " + ", ".join(f"{name} = {value}" for name, value in settings.items())
        return self.runner.error(where, str(run.failure))

    def check_ends(self) -> None:
        """Raise an error if the runs at the ends of the ladder show that the ladder is wrong."""
        ladder, script = self.varied.ladder, self.varied.script
        fine = self.run(ladder.rungs - 1, 0)
        if fine.failure:
            raise self.failed(fine, ladder.rungs - 1)
        coarse = self.run(0, 0)
        if coarse.failure:
            return
        unused = self.varied.kind == "variable" and not script.mentions(ladder.name)
        if unused and _same_digits(coarse, fine):
            raise InputError(
                f"{script.path.name} gives {_first(fine)!r} at both ends of the ladder and does "
                f"not mention ${{{ladder.name}}}. Use the variable in the script"
            )
        dearer = coarse.seconds > max(_DEARER * fine.seconds, _SURELY_SECONDS)
        # Smaller steps are always finer, so the ends of a ladder of steps cannot be exchanged.
        if dearer and self.varied.kind != "step":
            raise InputError(
                f"a run at {ladder.name} = {ladder.coarse:g} takes {coarse.seconds:.2g} s, but "
                f"only {fine.seconds:.2g} s at {ladder.fine:g}. Give the coarse end first: "
                f"--vary {ladder.name}={ladder.fine:g}:{ladder.coarse:g}:{ladder.rungs}"
            )

    def is_repeatable(self, rung: int) -> bool:
        """Return whether a run gives equal results when repeated, or other seeds are given."""
        seeds, first = self.varied.seeds, self.run(rung, 0)
        second = self.anew(rung, 0, again=True)
        if second.failure:
            raise self.failed(second, rung)
        same = _same_digits(first, second)
        if seeds and same:
            raise InputError(
                f"{self.runner.script.name} gives {_first(first)!r} with seed {seeds[0]} and "
                f"with {seeds[1]}. Use the variable 'seed' in the script, or write seeds in it as "
                "whole numbers. Leave --seeds out if the script draws no random numbers"
            )
        return same or bool(seeds)


def _same_digits(first: ScriptRun, second: ScriptRun) -> bool:
    return all(each.value == second.numbers[name].value for name, each in first.numbers.items())


def _first(run: ScriptRun) -> float:
    return next(iter(run.numbers.values())).value


def _with_whole_numbers(runner: Runner, varied: Varied, fixed: dict[str, str]) -> Varied:
    """Use whole numbers if LAMMPS refuses other values."""
    ladder = varied.ladder
    if varied.kind != "variable" or ladder.counts:
        return varied
    if not (ladder.coarse.is_integer() and ladder.fine.is_integer()):
        return varied
    # The second run of a rung tests this, because its value is not a whole number.
    fine = _Runs(runner, varied, fixed).run(ladder.rungs - 1, 1)
    if not any(said in str(fine.failure) for said in _WANTS_WHOLE):
        return varied
    return replace(varied, values=in_whole_numbers(ladder))


def measure_ladder(
    runner: Runner,
    varied: Varied,
    fixed: dict[str, str],
    tolerance: float | None,
    progress: Progress,
) -> ScriptLadder:
    """Run one ladder, starting with both ends, and judge each quantity."""
    varied = _with_whole_numbers(runner, varied, fixed)
    ladder, columns = varied.ladder, varied.columns
    title = " ".join(f"{key} {value}" for key, value in fixed.items()) or ladder.name
    weights = 1.0 / np.array([ladder.step(varied.value(r, 0)) for r in range(ladder.rungs)])
    weights /= weights.sum()
    runs = _Runs(runner, varied, fixed)
    progress(title, 0.0)
    runs.check_ends()
    good: list[int] = []
    for rung in range(ladder.rungs):
        for column in range(columns):
            if runs.run(rung, column).failure:
                break
            progress(title, float(weights[:rung].sum() + weights[rung] * column / columns))
        else:
            good.append(rung)
    if len(good) < LEAST_RUNGS:
        place = next(key for key in reversed(runs.done) if runs.done[key].failure)
        raise runs.failed(runs.done[place], *place)
    repeatable = runs.is_repeatable(good[0])
    rows = [[runs.run(rung, column) for column in range(columns)] for rung in good]
    inputs = np.array([[varied.value(rung, column) for column in range(columns)] for rung in good])
    seconds = np.array([np.median([run.seconds for run in row]) for row in rows])
    ends = [run.samples.end for row in rows for run in row if run.samples is not None]
    return ScriptLadder(
        ladder=ladder,
        fixed=fixed,
        runs=tuple(runs.done.values()),
        given=tuple(varied.value(*place) for place in runs.done),
        inputs=inputs,
        seconds=seconds,
        numbers=tuple(
            _judge(varied, runner.asked, name, rows, inputs, seconds, tolerance)
            for name in runner.asked.names
        ),
        ends=(min(ends), max(ends)) if ends else None,
        repeatable=repeatable,
    )


def _judge(
    varied: Varied,
    asked: RequestedNumbers,
    name: str,
    rows: list[list[ScriptRun]],
    inputs: Array,
    seconds: Array,
    tolerance: float | None,
) -> NumberLadder:
    """Judge the error of one quantity, and give advice."""
    ladder, seeded = varied.ladder, bool(varied.seeds)
    found = [[run.numbers[name] for run in row] for row in rows]
    results = np.array([[each.value for each in row] for row in found])
    resolution = min(each.unit for row in found for each in row)
    steps = np.vectorize(ladder.step)(inputs)
    verdict = judge_ladder(steps, results, resolution=resolution, seeded=seeded)
    quantity = next((each for each in asked.quantities if str(each) == name), None)
    wanted: Tolerance | None = None
    if tolerance is not None:
        wanted = Tolerance(tolerance, "")
    else:
        samples = [run.samples for run in rows[-1] if run.samples is not None]
        wanted = default_tolerance(quantity, samples, verdict, results)
    advice, repeats = None, seeded or quantity is not None
    if wanted is not None:
        advice = advise_value(ladder, inputs[:, 0], verdict, seconds, wanted.value, repeats=repeats)
    error = float(np.sqrt(np.mean([each.error**2 for each in found[-1]])))
    independent = float(np.median([each.independent for each in found[-1]]))
    return NumberLadder(
        name=name,
        results=results,
        resolution=resolution,
        standard_error=error if np.isfinite(error) else None,
        independent=independent if np.isfinite(independent) else None,
        verdict=verdict,
        tolerance=None if wanted is None else wanted.value,
        tolerance_reason="" if wanted is None else wanted.reason,
        advice=advice,
        repeats=repeats,
    )
