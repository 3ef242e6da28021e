"""Checking an answer to an exercise of a lesson."""

import importlib
from typing import Any

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import shown
from chaincor.workflows.lessons.exercise import Exercise, Verdict, judge

LESSONS = range(1, 9)


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
