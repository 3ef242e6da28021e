"""Test that every exercise accepts its answer and names usual mistakes."""

import math
import sys

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.lessons import check
from chaincor.workflows.lessons.exercise import (
    LESSONS,
    RIGHT,
    Exercise,
    exercise,
    exercises_of,
    find_exercise,
    judge,
)

NAMES = [name for lesson in LESSONS for name in exercises_of(lesson)]
J = np.arange(10)
E = 0.95242  # values that lesson 1 prints


def acceleration(u, sign=1.0):
    bonds = LennardJones().force(np.diff(u))
    return sign * (np.append(0.0, bonds) - np.append(bonds, 0.0))


def lj_energy(r):
    return (r**-12 - 2 * r**-6 + 1) / 72


# These are answers that students may give, each with a part of the expected reply.
WRONG = {
    # eta and e, energy and momentum
    "1.1": [
        ([0, 0], "takes no energy"),
        ([1, 0.5], "half a period"),
        ([1, 0], "do not stay at the wall"),
    ],
    "1.2": [
        (E, "this is e"),
        (E**2, "share that came back"),
        (1 - E, "loss of speed"),
        ((1 - E) ** 2, "square the speed first"),
    ],
    "1.3": [
        (1 - E, "mind the sign"),
        (2, "keeps all its energy"),
        (1 + E**2, "adds an energy"),
        (E, "before that, the wall stopped"),
    ],
    "1.4": [
        (1 - 4 * (1 - E**2), "four times as large"),
        (1 - 2 * (1 - E**2), "linear"),
        (E, "ratio of speeds"),
    ],
    # stability of the step, neighbour lists
    "1.5": [
        (1.0125, "ten particles"),
        (math.sqrt(0.5), "not omega h = 1"),
        (2, "sqrt(2)"),
        (1, "long chains"),
        (2 * math.pi / math.sqrt(2), "this is the period"),
    ],
    "1.6": [(60, "whole skin"), (0.15, "this is the time"), (0.3, "a number of steps")],
    # orders of interpolation, sign and slope of the force
    "2.1": [
        ([100, 100], "1/rows"),
        ([10, 10], "1/rows^4"),
        ([100, 1e4], "asks for the rows"),
        ([math.sqrt(10), 10], "exchanged"),
    ],
    "2.2": [
        (lambda r: (r**-7 - r**-13) / 6, "sign of the force"),
        (lj_energy, "this is the energy"),
        (lambda r: 12 * (r**-13 - r**-7), "1/72 is forgotten"),
        (lambda r: (r**-11 - r**-5) / 6, "lowers the power by one"),
        (lambda r: 1 - r, "force of a spring"),
    ],
    "2.3": [
        (0.0, "flat at the end"),
        (-1.0, "slope at r = 1"),
        ((13 * 0.9**-14 - 7 * 0.9**-8) / 6, "slope of the force itself"),
    ],
    # first-order wall, error bars
    "3.1": [
        (-2.0, "against 1/h"),
        (1.0, "reflect wall"),
        (4.0, "factor to base 2"),
        (0.4757, "axes are exchanged"),
        (0.012294, "take the logarithms"),
        (-1.7228, "the slope is the first number"),
    ],
    "3.2": [
        (8, "order 1"),
        (4, "one halving"),
        (7, "4**3"),
        (12, "factors multiply"),
        (6, "exponents"),
        (512, "order 3"),
        (1 / 64, "reciprocal"),
    ],
    "3.3": [
        (lambda x, v, a: x / abs(v), "free flight"),
        (lambda x, v, a: (-v - np.sqrt(v**2 - 4 * a * x)) / (2 * a), "factor 1/2 in a s^2/2"),
        (lambda x, v, a: (-v - np.sqrt(v**2 - 2 * a * x)) / -a, "this time is negative"),
        (lambda x, v, a: (-v + np.sqrt(v**2 - 2 * a * x)) / a, "other root"),
    ],
    "3.4": [
        (3e-4, "difference of the two runs"),
        (7.5e-5, "3 times the error of the finer"),
        (4e-4, "error of the coarser run"),
        (2e-5, "order 4"),
        (1.5e-4, "a quarter"),
    ],
    # frequencies and shapes of modes
    "4.1": [
        (np.sin(np.pi * J / 10), "misprint"),
        (2 * np.sin(np.pi * J / 10), "ring"),
        (2 * np.sin(np.pi * (J + 1) / 22), "held at both ends"),
        (4 * np.sin(np.pi * J / 20) ** 2, "square root is forgotten"),
        (np.pi * J / 10, "continuous rod"),
        (2 * np.sin(np.pi * J / 20) / (2 * np.pi), "radians"),
        (2 * np.sin(np.pi * J[1:] / 20), "9 numbers where 10"),
    ],
    "4.2": [
        (0.0314, "frequency omega"),
        (100, "also holds the way back"),
        (1 / 0.031415, "one radian"),
        (math.pi, "fastest"),
    ],
    "4.4": [
        (lambda j, n: np.cos(np.pi * j * (np.arange(1, n + 1) - 0.5) / n), "sum to n/2"),
        (lambda j, n: math.sqrt(2 / n) * np.sin(np.pi * j * (np.arange(n) + 0.5) / n), "held"),
        (lambda j, n: math.sqrt(2 / n) * np.cos(np.pi * j * np.arange(n) / n), "i - 1/2"),
    ],
    # v*
    "5.1": [
        (0.253608, "v* for b = 10"),
        (0.126804, "stiffness is 1 for every b"),
        (0.507217 / math.sqrt(2), "sqrt(2 U)"),
        (0.507217**2 / 2, "this is the energy"),
        (0.507217**2, "square root is missing"),
    ],
    "5.2": [
        (0.8, "in units of v*"),
        (0.8 / 0.128489, "multiply by it"),
        (0.8 * 0.253608, "Toda"),
        (0.128489, "at 1 v*"),
    ],
    "5.3": [
        (10, "v* decreases"),
        (100**-0.25, "not -1/r"),
        (0.01, "1/c"),
        (1, "depends on c"),
        (-0.5, "this is the exponent"),
    ],
    "5.4": [
        ([1, 1], "less often"),
        ([0.86, 0.86], "depends on the speed"),
        ([86, 100], "divide"),
        ([1, 0.86], "exchanged"),
    ],
    # forces, momentum, orders
    "6.1": [
        (lambda u: acceleration(u, -1.0), "sign of the force"),
        (lambda u: np.append(0.0, LennardJones().force(np.diff(u))), "at both ends"),
        (lambda u: np.append(-LennardJones().force(np.diff(u)), 0.0), "at both ends"),
        (lambda u: np.append(np.diff(u), 0.0) - np.append(0.0, np.diff(u)), "force of springs"),
    ],
    "6.2": [
        (lambda s, n, v0: (s.sum() / (n * v0) - 1) ** 2, "2 v, not v"),
        (lambda s, n, v0: (2 * s.sum() / (n * v0)) ** 2, "add the initial momentum"),
        (lambda s, n, v0: 2 * s.sum() / (n * v0) - 1, "eta = e^2"),
        (lambda s, n, v0: (s**2).sum() / (n * v0**2), "no energy"),
    ],
    "6.3": [(8, "the exponent"), (16, "not 2 x 8"), (64, "base and exponent"), (4, "order 2")],
    # sweeps
    "7.1": [
        ([108, 108], "not computed again"),
        ([36, 36], "stay in the store"),
        ([36, 72], "same store"),
        ([12, 84], "combined"),
    ],
    "7.3": [(2, "twice as long"), (8, "not three"), (16, "neighbours only")],
    "7.2": [(0.717, "eta at the minimum"), (0.8, "longer chains"), (2.0, "end of the axis")],
    # limits
    "8.1": [(0.719, "sign"), (-2 / 3, "law of long chains"), (-0.719 * math.log(10), "log10")],
    "8.2": [
        (1e4, "not to its square"),
        (10, "square root"),
        (1, "bonds of a slower chain"),
        (2, "decades"),
    ],
    "8.3": [
        ([10, 45], "add the contacts"),
        ([10, 100], "once, not twice"),
        ([1, 10], "must be reversed"),
    ],
    "8.4": [
        (2.2204e-16, "before division by"),
        (2.2204e-7, "near 1"),
        (1.4211e-14, "divide"),
        (2.198e-5, "grow continuously"),
    ],
}


def said_by(exercise):
    """Return the replies of an exercise to all answers that it knows, the right answer first."""
    arguments = exercise.arguments() if exercise.arguments else ()
    return [says for _, says in exercise.answers(*arguments)]


@pytest.mark.slow_cases
@pytest.mark.parametrize("name", NAMES)
def test_an_exercise_takes_its_own_truth(name):
    exercise = find_exercise(name)
    # No mistake may be taken for the right answer or for another mistake.
    for k, says in enumerate(said_by(exercise)):

        def answer(*arguments, k=k):
            return [value for value, _ in exercise.answers(*arguments)][k]

        verdict = judge(exercise, answer if exercise.arguments else answer())
        assert bool(verdict) == (k == 0)
        assert verdict.says == (says if k == 0 else f"not yet: {says}")


CASES = [(name, k) for name, cases in WRONG.items() for k in range(len(cases))]


@pytest.mark.parametrize(("name", "case"), CASES)
@pytest.mark.slow_cases
def test_a_wrong_answer_is_named(name, case):
    answer, reported = WRONG[name][case]
    verdict = check(name, answer)
    assert not verdict
    assert reported in verdict.says


@pytest.mark.parametrize("lesson", LESSONS)
def test_five_wrong_answers_of_each_lesson(lesson):
    assert sum(name.startswith(f"{lesson}.") for name, _ in CASES) >= 5


def test_five_mistakes_or_so_are_known_of_each_lesson():
    for lesson in LESSONS:
        assert sum(len(said_by(e)) - 1 for e in exercises_of(lesson).values()) >= 10


def knows(number):
    """Return the answers of an exercise that knows only the right answer."""
    return lambda: iter([(number, RIGHT)])


@exercise("a function", arguments=lambda: (np.arange(4.0),))
def squares(x):
    yield x**2, RIGHT


@pytest.mark.parametrize(
    ("answer", "reported"),
    [
        (..., "no answer yet"),
        ("much", "'much', in which no number is found; expected: one number"),
        (None, "None; expected"),
        (True, "True; expected"),
        ([1.0, 2.0], "2 numbers where 1 are expected"),
        ([], "0 numbers"),
        ([[1.0], [1.0, 2.0]], "expected: one number"),
        (float("nan"), "not finite"),
        (1j, "expected: one number"),
        (lambda x: x, "a function; expected: one number"),
        (-3.0, "the sign is wrong"),
        (300.0, "right in per cent"),
        (9.0, "the square"),
        (3.0**0.5, "square root of the right answer"),
        (1 / 3, "reciprocal"),
        (6.0, "twice the right answer"),
        (6.0 * math.pi, "divide this by 2 pi"),
        (3.1, "too large"),
        (2.0, "too small"),
    ],
)
def test_any_answer_is_judged(answer, reported):
    verdict = judge(Exercise("one number", knows(3.0)), answer)
    assert not verdict
    assert reported in repr(verdict)


def test_a_number_in_place_of_a_function_and_one_of_many():
    assert judge(squares, lambda x: x * x)
    assert "no function but 3.0" in judge(squares, 3.0).says
    assert (
        "3 of 4 numbers are right; number 3 is too large"
        in judge(squares, lambda x: x**2 + (x == 2)).says
    )


class Unspeakable:
    """Object that can be neither converted to a number nor printed."""

    def __array__(self, *_, **__):
        raise RuntimeError("no array")

    def __repr__(self):
        raise RuntimeError("no words")


def fails(x):
    return {}[x.size]


@pytest.mark.parametrize(
    ("function", "reported"),
    [
        (fails, f"raised KeyError: 4 in its line {fails.__code__.co_firstlineno + 1}; expected: a"),
        (lambda x: sys.exit(3), "raised SystemExit: 3 in its line"),
        (lambda: 1.0, "cannot be called with 1 argument (TypeError: "),
        (lambda x, y: 1.0, "cannot be called with 1 argument (TypeError: "),
        (lambda x: None, "your function's result is None; expected: a function"),
        (lambda x: math.nan, "your function's result is not finite"),
        (lambda x: np.zeros(7), "7 numbers where 4 are expected"),
        (lambda x: x + 1j * x, "your function's result is array([0.+0.j"),
        (lambda x: "x", "your function's result is 'x'"),
        (lambda x: Unspeakable(), "an object of type Unspeakable"),
        (lambda x: 10**400, "your function's result is 1000"),
    ],
)
def test_a_function_that_fails_is_judged_in_one_line(function, reported):
    verdict = judge(squares, function)
    assert not verdict
    assert reported in repr(verdict)
    assert repr(verdict).isprintable()


def test_a_notebook_shows_a_verdict_as_text_that_it_may_wrap():
    verdict = judge(Exercise("one number < 1", knows(0.5)), ...)
    assert verdict._repr_html_() == f"<p>{repr(verdict).replace('<', '&lt;')}</p>"


def test_a_function_may_change_its_arguments():
    @exercise("a function", arguments=lambda: (np.arange(4.0),))
    def cubes(x):
        yield x**3, RIGHT
        yield x**2 - x, "this is known"

    def changes(x):
        result = x**2 - x
        x[:] = 0.0
        return result

    assert "this is known" in judge(cubes, changes).says


def test_zero_has_no_reciprocal_to_mistake_for():
    assert "too large" in judge(Exercise("one number", knows(0.0)), 5.0).says


@pytest.mark.parametrize("name", ["9.1", "1.99", "one", "", 1.1, None, ["1.1"]])
def test_no_such_exercise(name):
    with pytest.raises(InputError, match="there is no exercise"):
        check(name, 1.0)


@pytest.mark.parametrize(
    ("name", "answer", "says"),
    [
        ("1.2", 0.093, "right, to two digits"),
        ("4.3", 0.18, "right, to two digits"),
        # The answer 2.0 is that of a chain without losses, which the exercise names as a mistake.
        ("1.3", 2.0, "not yet: a chain that keeps"),
        # One digit does not show that the answer is rounded; whole numbers are not rounded.
        ("5.2", 0.1, "right to 2 digits: give three digits"),
        ("6.3", 260, "right to 2 digits: give three digits"),
        ("4.1", np.round(2.0 * np.sin(np.pi * np.arange(10) / 20), 1), "right to one decimal"),
    ],
)
def test_an_answer_rounded_to_fewer_digits_is_reported(name, answer, says):
    verdict = check(name, answer)
    assert bool(verdict) == says.startswith("right, ")
    assert verdict.says.startswith(says)


def test_several_arguments_count_as_a_list():
    assert check("1.1", 1, 1)
    assert "2 numbers where 1 are expected" in check("1.2", 9, 29).says
    assert "write the power as 2**8" in check("6.3", 2 ^ 8).says


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (195.24, "in per cent"),
        (195.0, "in per cent"),
        (19.524, "divide it by the number of particles"),
        (19.5, "divide it by the number of particles"),
    ],
)
def test_per_cent_and_sums_over_the_chain_are_recognised(answer, says):
    verdict = check("1.3", answer)
    assert not verdict
    assert says in verdict.says
