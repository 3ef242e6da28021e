"""Compare an answer with the right answer and with usual mistakes."""

import html
import math
from collections.abc import Iterable, Iterator, Mapping, ValuesView
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.given_numbers import shown
from chaincor.workflows.lessons.answer_text import numbers_of

# Iterator over pairs of a possible answer and a text about it.
Answers = Iterator[tuple[ArrayLike, str]]

# A mistake is named only if the answer agrees to this fraction with the wrong result that the
# mistake gives, even if the exercise has a larger tolerance.
_NAMED_WITHIN = 0.01
# General mistakes with numbers are searched only if the tolerance of the exercise is at most this.
_SHARP = 0.01
# An answer with this many right digits is accepted, even if the tolerance requires more digits.
_ENOUGH_DIGITS = 3
# If an answer of two digits differs from the right answer by less than this fraction, no mistake is
# named, because the answer may be right and rounded.
_CLOSE = 0.1
# The first two general mistakes, in the sign and in per cent, are named even if the answer has only
# two digits.
_CERTAIN = 2


@dataclass(frozen=True)
class AnswerVerdict:
    """Verdict on an answer; true if the answer is right."""

    right: bool  #: Whether the answer is right.
    says: str  #: Text that says what is right or wrong about the answer.

    def __bool__(self) -> bool:
        return self.right

    def __repr__(self) -> str:
        return self.says

    def _repr_html_(self) -> str:
        # JupyterLab breaks long lines of plain text within words, but does not do so in HTML
        # paragraphs.
        return f"<p>{html.escape(self.says)}</p>"


@dataclass(frozen=True)
class AnswerComparison:
    """Numbers in an answer, and rules for their comparison."""

    given: Array  #: Numbers in the answer.
    tolerance: float  #: Allowed difference, as a fraction of the largest number.
    either_sign: bool = False  #: Whether the answer with all signs reversed is also right.
    rounded: bool = True  #: Whether the numbers may be rounded, because a person typed them.

    def verdict(
        self, expected: Array, right: str, mistakes: Iterable[tuple[ArrayLike, str]]
    ) -> AnswerVerdict:
        """
        Return the verdict on the answer.

        `right` is the text for a right answer. Each mistake comes with its own text.
        """
        if self._near(expected, self.tolerance) or self._digits(expected) >= _ENOUGH_DIGITS:
            return AnswerVerdict(True, right)
        near = min(self.tolerance, _NAMED_WITHIN)
        with np.errstate(all="ignore"):
            arrays = [(np.ravel(np.asarray(other, dtype=float)), says) for other, says in mistakes]
            known = [(other, says) for other, says in arrays if other.size == expected.size]
            general = list(_general_mistakes(expected)) if self.tolerance <= _SHARP else []
        for other, says in known:
            if self._near(other, near) or self._digits(other) >= _ENOUGH_DIGITS:
                return AnswerVerdict(False, f"not yet: {says}")
        for other, says in general:
            if self._near(other, 1e-9) or self._shares_digits(other):
                return AnswerVerdict(False, f"not yet: {says}")
        if factor := self._common_factor(expected):
            times = f"each number is {factor:.4g} times the right one"
            return AnswerVerdict(False, f"not yet: {times}: a constant factor is wrong")
        if self._digits(expected) == 2:
            others = (other for other, _ in (*known, *general))
            if self._unique(expected) and all(self._digits(other) < 2 for other in others):
                return AnswerVerdict(True, "right, to two digits")
            return AnswerVerdict(False, "right to 2 digits: give three digits, or an expression")
        if self._has_one_decimal_of(expected):
            return AnswerVerdict(False, "right to one decimal: give three digits")
        candidates = (*known, *general[:_CERTAIN])
        likely = {says for other, says in candidates if self._names_by_two_digits(other, expected)}
        if len(likely) == 1:
            return AnswerVerdict(False, f"not yet: {likely.pop()}")
        return AnswerVerdict(False, f"not yet: {self._side(expected)}")

    def _aligned(self, other: Array) -> Array:
        """Return the answer; reverse all signs if that is allowed and fits better."""
        return -self.given if self.either_sign and float(self.given @ other) < 0.0 else self.given

    def _near(self, other: Array, tolerance: float) -> bool:
        scale = float(np.max(np.abs(other)))
        off = np.abs(self._aligned(other) - other)
        return math.isfinite(scale) and bool(np.all(off <= tolerance * scale))

    def _digits(self, other: Array) -> int:
        """Return to how many digits `other` must be rounded to give the answer; 0 if impossible."""
        scale = float(np.max(np.abs(other)))
        if not self.rounded or not (math.isfinite(scale) and scale > 0.0):
            return 0
        given = self._aligned(other)
        for digits in (6, 5, 4, 3, 2):
            decimals = digits - 1 - math.floor(math.log10(scale))
            by_decimals = [round(float(value), decimals) for value in other]
            by_digits = [float(f"{value:.{digits - 1}e}") for value in other]
            # One decimal is too few to recognise a vector whose largest number is about 1.
            for rounded in (by_digits, by_decimals) if digits > 2 else (by_digits,):
                if np.allclose(given, rounded, rtol=1e-12, atol=1e-12 * scale):
                    return digits
        return 0

    def _unique(self, expected: Array) -> bool:
        """Return whether two digits are enough: they are shown, and no whole number is rounded."""
        whole = np.allclose(expected, np.round(expected), rtol=1e-9, atol=0.0)
        return self._shown_digits() == 2 and not whole

    def _has_one_decimal_of(self, expected: Array) -> bool:
        """Return whether the answer is a vector, rounded to the second digit of the largest."""
        scale = float(np.max(np.abs(expected)))
        if not self.rounded or expected.size < 3 or scale == 0.0:
            return False
        rounded = np.round(expected, 1 - math.floor(math.log10(scale)))
        return np.allclose(self.given, rounded, rtol=1e-12, atol=1e-12 * scale)

    def _shown_digits(self) -> int:
        """Return the largest number of digits that a number of the answer has."""
        return max(len(f"{abs(v):.11e}".split("e")[0].rstrip("0")) - 1 for v in self.given)

    def _shares_digits(self, other: Array) -> bool:
        """Return whether `other`, rounded to the answer's number of digits, gives the answer."""
        return min(self._digits(other), self._shown_digits()) >= _ENOUGH_DIGITS

    def _names_by_two_digits(self, other: Array, expected: Array) -> bool:
        """Return whether the answer is `other` to two digits, and is not close to the right one."""
        return self._digits(other) == 2 and not self._near(expected, _CLOSE)

    def _common_factor(self, expected: Array) -> float | None:
        """Return the common factor between all numbers in the answer and the right ones, if any."""
        used = expected != 0.0
        if expected.size < 3 or not used.any() or np.any(self.given[~used] != 0.0):
            return None
        factors = self.given[used] / expected[used]
        factor = float(np.mean(factors))
        same = np.allclose(factors, factor, rtol=1e-6, atol=0.0)
        return factor if same and factor != 0.0 and abs(factor - 1.0) > 1e-3 else None

    def _side(self, expected: Array) -> str:
        """Describe whether the answer is too large or too small, and which numbers are wrong."""
        given = self._aligned(expected)
        if expected.size == 1:
            side = f"it is too {'large' if given[0] > expected[0] else 'small'}"
            return f"{side}, by less than 1 %" if self._near(expected, 0.01) else side
        off = np.abs(given - expected) > self.tolerance * float(np.max(np.abs(expected)))
        right = int(expected.size - np.count_nonzero(off))
        first = int(np.argmax(off))
        side = "large" if given[first] > expected[first] else "small"
        return f"{right} of {expected.size} numbers are right; number {first + 1} is too {side}"


def _general_mistakes(expected: Array) -> Iterator[tuple[Array, str]]:
    """
    Return mistakes that can occur in any exercise.

    These mistakes are tried after the exercise's own mistakes.
    """
    yield -expected, "the sign is wrong; the rest is right"
    yield 100.0 * expected, "this is right in per cent: divide it by 100, or write %"
    if expected.size > 1:
        order = "exchanged" if expected.size == 2 else "in reverse order"
        yield expected[::-1], f"the numbers are right, but {order}"
    yield 2.0 * expected, "this is twice the right answer"
    yield 0.5 * expected, "this is half the right answer"
    yield expected**2, "this is the square of the right answer"
    yield np.sqrt(np.abs(expected)), "this is the square root of the right answer"
    yield 1.0 / expected, "this is the reciprocal of the right answer"
    yield 2.0 * np.pi * expected, "divide this by 2 pi"
    yield expected / (2.0 * np.pi), "multiply this by 2 pi"


def numbers_in(answer: Any, count: int = 1) -> Array | str:
    """
    Return the numbers in an answer as an array, or a text that says why there are none.

    Texts such as ``"1/64"``, ``"9.3 %"``, ``"30 steps"`` and ``"sqrt(2)"`` count as numbers. If a
    text may be read in two ways, `count` is how many numbers are expected.
    """
    if isinstance(answer, Mapping):
        answer = list(answer.values())
    if isinstance(answer, Iterator | ValuesView):
        answer = list(answer)
    if isinstance(answer, str):
        answer = numbers_of(answer, count) or answer
    if isinstance(answer, list | tuple):
        answer = [_read(one) if isinstance(one, str) else one for one in answer]
    if isinstance(answer, str):
        return f"{shown(answer)}, in which no number is found"
    if isinstance(answer, bytes | set | bool) or answer is None:
        return shown(answer)
    try:
        numbers = np.asarray(answer)
        # The conversion to real numbers would drop the imaginary part with only a warning.
        if numbers.dtype.kind == "c" and np.any(numbers.imag != 0.0):
            return shown(answer)
        numbers = np.ravel((numbers.real if numbers.dtype.kind == "c" else numbers).astype(float))
    except Exception:  # The conversion of a foreign object may raise any error.
        return shown(answer)
    if not np.all(np.isfinite(numbers)):
        return "not finite: a division by zero, or a root of a negative number"
    return numbers


def _read(text: str) -> float | str:
    """Return the number in a text, or the text if it does not state one number."""
    numbers = numbers_of(text)
    return numbers[0] if len(numbers) == 1 else text
