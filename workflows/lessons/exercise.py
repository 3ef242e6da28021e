"""Exercises: what they ask, their right answers, and the judgement of given ones."""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from chaincor.lammps_inputs.errors import InputError, one_line
from chaincor.lammps_inputs.given_numbers import shown
from chaincor.workflows.lessons.judging import Answers, Comparison, Verdict, numbers_in

LESSONS = range(1, 9)
RIGHT = "right"


@dataclass(frozen=True)
class Exercise:
    """A question with a number, several numbers or a function for an answer."""

    asks: str  #: What is to be given, with its unit.
    #: Computes the right answer, then the answers of usual mistakes, each with what to say. For an
    #: exercise that asks for a function: what the function returns for `arguments`.
    answers: Callable[..., Answers]
    #: How far an answer may be off, as a fraction of the largest of its numbers.
    tolerance: float = 1e-3
    #: For an exercise that asks for a function: returns the arguments that it is tried with.
    arguments: Callable[[], tuple[Any, ...]] | None = None
    either_sign: bool = False  #: Whether the answer with all signs turned is right as well.


def exercise(asks: str, **fields: Any) -> Callable[[Callable[..., Answers]], Exercise]:
    """Return a decorator that makes an exercise of the function that yields its answers."""
    return lambda answers: Exercise(asks, answers, **fields)


def check(exercise: str, answer: Any) -> Verdict:
    """
    Return whether an answer is right, and if not, what is wrong with it.

    The right answer is computed by the in-house engine when it is needed: nothing is looked up.

    Parameters
    ----------
    exercise : str
        Its name, ``"4.1"`` for the first of lesson 4.
    answer : float, array_like or callable
        A number, several, or a function, as the exercise asks. Numbers may be rounded to three
        digits, and may be texts such as ``"1/64"`` and ``"9.29 %"``.

    Returns
    -------
    Verdict
        True if the answer is right; prints what is right or wrong about it.

    Raises
    ------
    InputError
        If there is no such exercise.
    """
    return judge(find_exercise(exercise), answer)


def find_exercise(name: str) -> Exercise:
    """Return an exercise by its name; raise InputError, which lists the names, if there is none."""
    lesson = str(name).partition(".")[0]
    known: dict[str, Exercise] = {}
    if lesson in map(str, LESSONS):
        known = exercises_of(int(lesson))
    if not isinstance(name, str) or name not in known:
        names = ", ".join(map(repr, known)) or f"those of lessons 1 to {LESSONS[-1]}, such as '1.1'"
        raise InputError(f"there is no exercise {shown(name)}; expected one of {names}")
    return known[name]


def exercises_of(lesson: int) -> dict[str, Exercise]:
    """Return the exercises of a lesson that can be checked, by name."""
    module = importlib.import_module(f"chaincor.workflows.lessons.exercises.lesson_{lesson}")
    return {
        f"{lesson}.{name.removeprefix('_exercise_')}": exercise
        for name, exercise in vars(module).items()
        if isinstance(exercise, Exercise)
    }


def judge(exercise: Exercise, answer: Any) -> Verdict:
    """
    Return whether an answer is right, and if not, what is wrong with it.

    The right answer is not revealed. An answer of another kind (``...``, a text, a list of another
    length, a function that fails) is not right, and the verdict says what is expected.
    """
    if answer is ...:
        return Verdict(False, f"no answer yet: put yours in place of the dots. {exercise.asks}")
    arguments = () if exercise.arguments is None else exercise.arguments()
    if callable(answer) != (exercise.arguments is not None):
        kind = "a function" if callable(answer) else f"no function but {shown(answer)}"
        return Verdict(False, f"this is {kind}; expected: {exercise.asks}")
    answers = exercise.answers(*arguments)
    value, right = next(answers)
    truth = np.ravel(np.asarray(value, dtype=float))
    what = "this is"
    if exercise.arguments is not None:
        what = "what your function returns is"
        try:
            # With arguments of its own: it may change them.
            answer = answer(*exercise.arguments())
        except (Exception, SystemExit) as error:
            return Verdict(False, f"{_failure(error, len(arguments))}; expected: {exercise.asks}")
    given = numbers_in(answer)
    if isinstance(given, str):
        return Verdict(False, f"{what} {given}; expected: {exercise.asks}")
    if given.shape != truth.shape:
        found = f"{given.size} number{'s' if given.size != 1 else ''}"
        return Verdict(False, f"{found} where {truth.size} are expected: {exercise.asks}")
    typed = exercise.arguments is None
    comparison = Comparison(given, exercise.tolerance, exercise.either_sign, rounded=typed)
    return comparison.verdict(truth, right, answers)


def _failure(error: BaseException, count: int) -> str:
    """Say how a function failed that was called with `count` arguments, and in which line."""
    words = one_line(error)[:120]
    named = f"{type(error).__name__}: {words}" if words else type(error).__name__
    if error.__traceback__ is None or error.__traceback__.tb_next is None:
        # Not inside it: it cannot be called like this.
        arguments = "1 argument" if count == 1 else f"{count} arguments"
        return f"your function cannot be called with {arguments} ({named})"
    return f"your function raised {named} in its line {error.__traceback__.tb_next.tb_lineno}"
