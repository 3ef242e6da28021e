"""One ladder of a script: its runs made and judged, with an advice for each number."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from chaincor.analysis.ladders.verdict import LEAST_RUNGS, LadderVerdict, judge_ladder
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.advice import ScriptAdvice, give_advice, own_tolerance
from chaincor.workflows.scripts.script_run import Runner, ScriptRun, ScriptRunError
from chaincor.workflows.scripts.varied import Ladder, Varied

# The coarse end should not be the dear one: then somebody gave the ends the other way round.
_DEARER, _SURELY_SECONDS = 2.0, 0.5
# Runs that end further apart than this share of their time do not answer the same question.
_SAME_END = 1e-6

# Called with what is being run and the fraction of the study that is done.
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class NumberLadder:
    """One number of a script along a ladder."""

    name: str  #: Pattern or quantity.
    results: Array  #: What was found, run by run; of shape (R, M).
    #: Unit of the last digit printed, of the most exact run; 0 for what is sampled.
    resolution: float
    #: Of one run's mean, from the run itself, on the finest rung; None for what is no mean.
    standard_error: float | None
    verdict: LadderVerdict  #: What the error is like.
    tolerance: float | None  #: What the advice is for: as asked, or one of its own.
    advice: ScriptAdvice | None  #: None where nothing can be advised.


@dataclass(frozen=True)
class ScriptLadder:
    """One ladder of a script."""

    ladder: Ladder  #: What was varied.
    fixed: dict[str, str]  #: Values of the variables that stay, as text.
    #: Every run, failed ones among them, in the order they were made.
    runs: tuple[ScriptRun, ...]
    given: tuple[float, ...]  #: The varied value of each of these.
    #: Values, run by run, of the rungs all of whose runs ended well, coarse to fine; of shape
    #: (R, M).
    inputs: Array
    seconds: Array  #: Processor time of one run: the median of a rung; of shape (R,).
    numbers: tuple[NumberLadder, ...]  #: What was found.
    #: Earliest and latest physical time at which runs ended; None where that is not known.
    ends: tuple[float, float] | None
    repeatable: bool  #: Whether the same command gave the same digits twice.

    @property
    def values(self) -> Array:
        """The value of each of these rungs, of shape (R,)."""
        return self.inputs[:, 0]

    @property
    def failures(self) -> list[str]:
        """Of every run that failed where that was, and why."""
        name, text = self.ladder.name, self.ladder.text
        runs = zip(self.given, self.runs, strict=True)
        return [f"{name} = {text(given)}: {run.failure}" for given, run in runs if run.failure]

    @property
    def ends_apart(self) -> bool:
        """Whether runs ended at different physical times."""
        return self.ends is not None and self.ends[1] - self.ends[0] > _SAME_END * self.ends[1]


@dataclass(frozen=True)
class _Runs:
    """The runs of one ladder, each made when it is first asked for."""

    runner: Runner
    varied: Varied
    fixed: dict[str, str]
    done: dict[tuple[int, int], ScriptRun] = field(default_factory=dict)

    def run(self, rung: int, column: int) -> ScriptRun:
        """Return one run of a rung."""
        if (rung, column) not in self.done:
            self.done[rung, column] = self.anew(rung, column)
        return self.done[rung, column]

    def anew(self, rung: int, column: int, *, again: bool = False) -> ScriptRun:
        """Make a run; `again`, the first of a rung, with another seed where there are some."""
        ladder = self.varied.ladder
        text = ladder.text(self.varied.value(rung, column))
        name = f"{ladder.name}={text}_{column}{'_again' if again else ''}"
        return self.runner.run(
            "_".join([name, *(f"{key}={value}" for key, value in self.fixed.items())]),
            self.varied.change(self.fixed, rung, column, again=again),
        )

    def failed(self, run: ScriptRun, rung: int, column: int = 0) -> ScriptRunError:
        """Return the error of a run that failed."""
        ladder = self.varied.ladder
        told = {ladder.name: ladder.text(self.varied.value(rung, column)), **run.variables}
        where = "at " + ", ".join(f"{name} = {value}" for name, value in told.items())
        return self.runner.error(where, str(run.failure))

    def check_ends(self) -> None:
        """Raise what is wrong with the ladder as its ends show it, before time is spent."""
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
                f"{script.path.name} gives {_first(fine)!r} at both ends of the ladder and "
                f"does not mention ${{{ladder.name}}}; expected a script that uses the variable"
            )
        dearer = coarse.seconds > max(_DEARER * fine.seconds, _SURELY_SECONDS)
        # Of a step it is known which end is fine.
        if dearer and self.varied.kind != "step":
            raise InputError(
                f"a run at {ladder.name} = {ladder.coarse:g} takes {coarse.seconds:.2g} s and at "
                f"{ladder.fine:g} only {fine.seconds:.2g} s; expected the coarse end first: "
                f"--vary {ladder.name}={ladder.fine:g}:{ladder.coarse:g}:{ladder.rungs}"
            )

    def is_repeatable(self, rung: int) -> bool:
        """Run one command again: with the same seed or, to see that it matters, with another."""
        seeds, first = self.varied.seeds, self.run(rung, 0)
        second = self.anew(rung, 0, again=True)
        if second.failure:
            raise self.failed(second, rung)
        same = _same_digits(first, second)
        if seeds and same:
            raise InputError(
                f"{self.runner.script.name} gives {_first(first)!r} with seed {seeds[0]} and with "
                f"{seeds[1]}; expected a script whose random numbers obey the variable 'seed', or "
                "seeds that are whole numbers in it: leave --seeds out where it draws none"
            )
        return same or bool(seeds)


def _same_digits(first: ScriptRun, second: ScriptRun) -> bool:
    return all(each.value == second.numbers[name].value for name, each in first.numbers.items())


def _first(run: ScriptRun) -> float:
    return next(iter(run.numbers.values())).value


def measure_ladder(
    runner: Runner,
    varied: Varied,
    fixed: dict[str, str],
    tolerance: float | None,
    progress: Progress,
) -> ScriptLadder:
    """Run one ladder, both ends first, and judge each number."""
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
            _judge(varied, name, rows, inputs, seconds, tolerance, name != runner.asked.pattern)
            for name in runner.asked.names
        ),
        ends=(min(ends), max(ends)) if ends else None,
        repeatable=repeatable,
    )


def _judge(
    varied: Varied,
    name: str,
    rows: list[list[ScriptRun]],
    inputs: Array,
    seconds: Array,
    tolerance: float | None,
    sampled: bool,
) -> NumberLadder:
    """Say of one number what its error is like, and what to run."""
    ladder, seeded = varied.ladder, bool(varied.seeds)
    found = [[run.numbers[name] for run in row] for row in rows]
    results = np.array([[each.value for each in row] for row in found])
    resolution = min(each.unit for row in found for each in row)
    steps = np.vectorize(ladder.step)(inputs)
    verdict = judge_ladder(steps, results, resolution=resolution, seeded=seeded)
    if tolerance is None and sampled:
        tolerance = own_tolerance(verdict)
    advice = None
    if tolerance is not None:
        repeats = seeded or sampled
        advice = give_advice(ladder, inputs[:, 0], verdict, seconds, tolerance, repeats=repeats)
    error = float(np.sqrt(np.mean([each.error**2 for each in found[-1]])))
    return NumberLadder(
        name=name,
        results=results,
        resolution=resolution,
        standard_error=error if np.isfinite(error) else None,
        verdict=verdict,
        tolerance=tolerance,
        advice=advice,
    )
