"""Exercises that know their answers, those of usual mistakes, and what to say of either."""

import html
import importlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError, one_line
from chaincor.lammps_inputs.given_numbers import shown

LESSONS = range(1, 9)
RIGHT = "right"
# Answers, each with what is said of it.
Answers = Iterator[tuple[ArrayLike, str]]


@dataclass(frozen=True)
class Exercise:
    """A question with a number, several numbers or a function for an answer."""

    asks: str  #: What is to be given, with its unit.
    #: Computes the right answer, and then what those get who go wrong in a usual way. For an
    #: exercise that asks for a function: what it returns for `arguments`.
    answers: Callable[..., Answers]
    #: How far an answer may be off, as a fraction of the largest of its numbers.
    tolerance: float = 1e-3
    #: For an exercise that asks for a function: returns the arguments that it is tried with.
    arguments: Callable[[], tuple[Any, ...]] | None = None


def exercise(asks: str, **how: Any) -> Callable[[Callable[..., Answers]], Exercise]:
    """Make an exercise of the answers to what it `asks`; `how` are its other fields."""
    return lambda answers: Exercise(asks, answers, **how)


@dataclass(frozen=True)
class Verdict:
    """What is said of an answer; true if it is right."""

    right: bool  #: Whether it is.
    says: str  #: What is right or wrong about it.

    def __bool__(self) -> bool:
        return self.right

    def __repr__(self) -> str:
        return self.says

    def _repr_html_(self) -> str:
        # Of plain text JupyterLab breaks lines within words.
        return f"<p>{html.escape(self.says)}</p>"


def check(exercise: str, answer: Any) -> Verdict:
    """
    Say whether an answer is right, and if not, what is probably wrong with it.

    The truth is computed when it is asked for, by the in-house engine: nothing is looked up.

    Parameters
    ----------
    exercise : str
        Its name, ``"4.1"`` for the first of lesson 4.
    answer : float, array_like or callable
        A number, several, or a function, as the exercise asks.

    Returns
    -------
    Verdict
        True if the answer is right; shows what there is to say.

    Raises
    ------
    InputError
        If there is no such exercise.
    """
    return judge(find_exercise(exercise), answer)


def find_exercise(name: str) -> Exercise:
    """Return an exercise by its name; InputError, which lists the names, if there is none."""
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
    Say whether an answer is right, and if not, what is probably wrong with it.

    The truth is not told. An answer that is none (``...``, a text, a list of another length, a
    function that fails) is not right, with words on what is expected.
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
    given = _numbers(answer)
    if isinstance(given, str):
        return Verdict(False, f"{what} {given}; expected: {exercise.asks}")
    if given.shape != truth.shape:
        found = f"{given.size} number{'s' if given.size != 1 else ''}"
        return Verdict(False, f"{found} where {truth.size} are expected: {exercise.asks}")
    if _near(given, truth, exercise.tolerance):
        return Verdict(True, right)
    with np.errstate(divide="ignore", over="ignore"):
        others = [
            (np.ravel(np.asarray(other, dtype=float)), says)
            for other, says in (*answers, *_slips(truth))
            if np.size(other) == truth.size
        ]
    for other, says in others:
        if _near(given, other, exercise.tolerance):
            return Verdict(False, f"not yet: {says}")
    digits = _rounded_to(given, truth)
    if digits:
        exactly = f"give it within {exercise.tolerance:g} of its value"
        return Verdict(False, f"right to {digits} digits: {exactly}, or as an expression")
    for other, says in others:
        if _rounded_to(given, other):
            return Verdict(False, f"not yet: {says}")
    return Verdict(False, f"not yet: {_compared(given, truth, exercise.tolerance)}")


def _slips(truth: Array) -> Answers:
    """Return what can go wrong with any number, tried after what an exercise itself knows."""
    yield -truth, "the sign is wrong: everything else is right"
    yield 100.0 * truth, "give the number itself, not per cent"
    yield 2.0 * truth, "there is a factor of 2 too much"
    yield 0.5 * truth, "a factor of 2 is missing"
    yield truth**2, "this is the square of the answer: take the root"
    yield np.sqrt(np.abs(truth)), "this is the square root of the answer"
    yield 1.0 / truth, "this is the reciprocal: turn the fraction over"
    yield 2.0 * np.pi * truth, "there is a factor of 2 pi too much"
    yield truth / (2.0 * np.pi), "a factor of 2 pi is missing"


def _near(given: Array, other: Array, tolerance: float) -> bool:
    scale = float(np.max(np.abs(other)))
    return math.isfinite(scale) and bool(np.all(np.abs(given - other) <= tolerance * scale))


def _rounded_to(given: Array, other: Array) -> int:
    """Return to how many digits, of two to four, all numbers are rounded; 0 if they are not."""
    for digits in (4, 3, 2):
        rounded = [float(f"{value:.{digits - 1}e}") for value in other]
        if np.allclose(given, rounded, rtol=1e-12, atol=0.0):
            return digits
    return 0


def _failure(error: BaseException, count: int) -> str:
    """Say how a function failed that was called with so many arguments, and in which line."""
    words = one_line(error)[:120]
    named = f"{type(error).__name__}: {words}" if words else type(error).__name__
    if error.__traceback__ is None or error.__traceback__.tb_next is None:
        # Not inside it: it cannot be called like this.
        arguments = "1 argument" if count == 1 else f"{count} arguments"
        return f"your function cannot be called with {arguments} ({named})"
    return f"your function raised {named} in its line {error.__traceback__.tb_next.tb_lineno}"


def _numbers(answer: Any) -> Array | str:
    """Return an answer as an array, or what it is instead."""
    if isinstance(answer, str | bytes | dict | set | bool) or answer is None:
        return shown(answer)
    try:
        numbers = np.asarray(answer)
        if numbers.dtype.kind == "c":  # its imaginary part would be dropped with a warning
            return shown(answer)
        numbers = np.ravel(numbers.astype(float))
    except Exception:  # what an object raises that is no number is its own affair
        return shown(answer)
    if not np.all(np.isfinite(numbers)):
        return "not finite: a division by zero, or a root of a negative number"
    return numbers


def _compared(given: Array, truth: Array, tolerance: float) -> str:
    """Say which way an answer is off, and which of several are."""
    if truth.size == 1:
        return f"it is too {'large' if given[0] > truth[0] else 'small'}"
    off = np.abs(given - truth) > tolerance * float(np.max(np.abs(truth)))
    right = int(truth.size - np.count_nonzero(off))
    first = int(np.argmax(off))
    side = "large" if given[first] > truth[first] else "small"
    return f"{right} of {truth.size} numbers are right; number {first + 1} is too {side}"
