"""Define exercises with right answers, and judge given answers."""

import importlib
import re
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError, one_line
from chaincor.lammps_inputs.given_numbers import shown
from chaincor.workflows.lessons.judging import AnswerComparison, Answers, AnswerVerdict, numbers_in

LESSONS = range(1, 9)
RIGHT = "right"


@dataclass(frozen=True)
class Exercise:
    """Question whose answer is a number, several numbers or a function."""

    asks: str  #: Quantity that the answer must give, with its unit.
    #: Function that yields the right answer, and then the wrong results of common mistakes, each
    #: with a text. If the exercise asks for a function, these answers are its results for
    #: `arguments`.
    answers: Callable[..., Answers]
    #: Largest error of a right answer, as a fraction of its largest number.
    tolerance: float = 1e-3
    #: Function that returns arguments for the test, if the exercise asks for a function.
    arguments: Callable[[], tuple[Any, ...]] | None = None
    either_sign: bool = False  #: Whether an answer with all signs reversed is also right.
    #: Whether a function that only takes single numbers is also right, for example with
    #: `math.sqrt`.
    elementwise: bool = False
    #: Kind of factor, if the exercise asks for one: "smaller" if the right answer is how many times
    #: smaller a number becomes, and "remaining" if it is the share that remains.
    factor: str = ""


def exercise(asks: str, **fields: Any) -> Callable[[Callable[..., Answers]], Exercise]:
    """Return a decorator that makes an exercise from a function that yields answers."""
    return lambda answers: Exercise(asks, answers, **fields)


def check(exercise: str, answer: Any, *more: Any) -> AnswerVerdict:
    """
    Check an answer, and describe what is right or wrong.

    Right answers are not stored. The reference engine computes them when they are needed.

    Parameters
    ----------
    exercise : str
        Name of the exercise, such as ``"4.1"`` for the first exercise of lesson 4.
    answer, *more : float, array_like or callable
        A number, several numbers, or a function, depending on the exercise. Several arguments count
        as a list. Numbers may be rounded
        to two digits if no usual mistake has the same two digits. Texts such as ``"1/64"``,
        ``"9.29 %"`` and ``"about 30 steps"`` are read as numbers.

    Returns
    -------
    Verdict
        Verdict with a text. A verdict is true if the answer is right.

    Raises
    ------
    InputError
        If there is no exercise with this name.
    """
    return judge(find_exercise(exercise), [answer, *more] if more else answer)


def find_exercise(name: str) -> Exercise:
    """Return an exercise by its name; raise InputError for an unknown name."""
    lesson = str(name).partition(".")[0]
    known: dict[str, Exercise] = {}
    if lesson in map(str, LESSONS):
        known = exercises_of(int(lesson))
    if not isinstance(name, str) or name not in known:
        names = (
            ", ".join(map(repr, known)) or f"the names of lessons 1 to {LESSONS[-1]}, such as '1.1'"
        )
        raise InputError(f"there is no exercise {shown(name)}. Use one of {names}")
    return known[name]


def exercises_of(lesson: int) -> dict[str, Exercise]:
    """Return the exercises of a lesson by name, without those that `check` cannot judge."""
    module = importlib.import_module(f"chaincor.workflows.lessons.exercises.lesson_{lesson}")
    return {
        f"{lesson}.{name.removeprefix('_exercise_')}": exercise
        for name, exercise in vars(module).items()
        if isinstance(exercise, Exercise)
    }


def judge(exercise: Exercise, answer: Any) -> AnswerVerdict:
    """
    Judge an answer, and name the mistake if the answer is wrong.

    The verdict does not reveal the right answer. If the answer is of the wrong kind, the verdict
    says what is expected. Examples are ``...``, a text, a list of another length, and a function
    that fails.
    """
    if answer is ...:
        return AnswerVerdict(
            False, f"no answer yet: write it in place of the dots. Expected: {exercise.asks}"
        )
    arguments = () if exercise.arguments is None else exercise.arguments()
    if callable(answer) != (exercise.arguments is not None):
        kind = "a function" if callable(answer) else f"no function but {shown(answer)}"
        return AnswerVerdict(False, f"this is {kind}; expected: {exercise.asks}")
    answers = exercise.answers(*arguments)
    value, right = next(answers)
    expected = np.ravel(np.asarray(value, dtype=float))
    what = "this is"
    if exercise.arguments is not None:
        what = "your function's result is"
        try:
            # Each call gets new arguments, because a function may change its arguments.
            answer = _results(exercise, answer)
        except (Exception, SystemExit) as error:
            return AnswerVerdict(
                False, f"{_failure(error, len(arguments))}; expected: {exercise.asks}"
            )
    given = numbers_in(answer, expected.size)
    if isinstance(answer, str) and not isinstance(given, str):
        given = _as_factor(exercise.factor, answer, given)
    if isinstance(given, str):
        return AnswerVerdict(False, f"{what} {given}; expected: {exercise.asks}")
    if given.shape != expected.shape:
        found = f"{given.size} number{'s' if given.size != 1 else ''}"
        return AnswerVerdict(False, f"{found} where {expected.size} are expected: {exercise.asks}")
    typed = exercise.arguments is None
    comparison = AnswerComparison(given, exercise.tolerance, exercise.either_sign, rounded=typed)
    return comparison.verdict(expected, right, answers)


def _as_factor(kind: str, text: str, numbers: Array) -> Array:
    """Return the factors that a text such as "1/64 of it" or "ten times smaller" states."""
    smaller = re.search(r"\b(?:smaller|less|lower)\b", text)
    if kind == "smaller":
        larger = re.search(r"\b(?:larger|bigger|greater)\b", text)
        turned = (numbers < 1.0) != bool(larger and not smaller)
    else:
        turned = (numbers > 1.0) & bool(kind and smaller)
    return np.divide(1.0, numbers, out=numbers.copy(), where=turned & (numbers > 0.0))


def _results(exercise: Exercise, function: Callable[..., Any]) -> Any:
    """Return the results of a function; if it takes no arrays, call it once for each number."""
    assert exercise.arguments is not None
    try:
        return function(*exercise.arguments())
    except (TypeError, ValueError):
        if not exercise.elementwise:
            raise
        try:
            return [function(*map(float, one)) for one in zip(*exercise.arguments(), strict=True)]
        except (TypeError, ValueError):
            pass
        raise


def _failure(error: BaseException, count: int) -> str:
    """Describe why a function with `count` arguments failed, and name the line."""
    words = one_line(error)[:120]
    named = f"{type(error).__name__}: {words}" if words else type(error).__name__
    frames = traceback.extract_tb(error.__traceback__)
    inside = [frame.lineno for frame in frames if frame.filename != __file__]
    if not inside:  # The function does not accept this number of arguments.
        arguments = "1 argument" if count == 1 else f"{count} arguments"
        return f"your function cannot be called with {arguments} ({named})"
    return f"your function raised {named} in its line {inside[0]}"
