"""
Judge claims of the paper according to the rule for margins in ``docs/reproduction.md``.

The margin depends on the form of a claim: an exact statement, a trend, a printed number, or words
such as "almost", "near", "approaches" and "agrees". A claim in words is reproduced if our number
differs by at most 10 %, and reproduced with a correction if it differs by at most a quarter. For a
trend, our number is 1 if the trend exists and 0 if it does not.

Some claims depend on a choice that the paper does not state, such as a range of speeds. A claim is
undecided only if this choice can explain the difference between the paper's number and ours. If our
number varies with the choice by more than twice the wider margin of words, the quantity is not
constant. A claim that the quantity is constant is then not reproduced.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from types import ModuleType
from typing import Any, NamedTuple

from chaincor.workflows.reproduce.measurements import MeasuredPoint, Measurements, NoNumber

# The engines may disagree on at most this fraction of the points behind a finding.
_DISAGREEMENTS_ALLOWED = 0.05
# Relative margins of claims that the paper makes in words, for the verdicts "reproduced" and
# "reproduced with a correction".
ABOUT = 0.1
ROUGHLY = 0.25


class Verdict(StrEnum):
    """Verdict on a claim of the paper."""

    REPRODUCED = "reproduced"
    CORRECTED = "reproduced with a correction"
    UNDECIDED = "undecided"
    NOT_REPRODUCED = "not reproduced"


@dataclass(frozen=True)
class Margin:
    """Number in a claim, and how much our number may differ from it."""

    paper: float  #: Number in the paper; 1 for a trend.
    whole: float  #: Reference value for relative margins: the paper's number, or a scale.
    reason: str  #: Reason for the margins.
    #: Largest difference for "reproduced". The error of our number is added.
    reproduced_within: float = 0.0
    corrected_within: float = 0.0  #: Largest difference for "reproduced with a correction".
    is_trend: bool = False  #: Whether the claim states a trend and no number.


def exact(paper: float, scale: float = 0.0) -> Margin:
    """
    Return the margin of an exact statement.

    The error of our number must be below 10 % of the scale.
    """
    return Margin(paper, scale or abs(paper), "exact in the paper: within our own error")


def words(paper: float, scale: float = 0.0, scale_name: str = "") -> Margin:
    """
    Return the margin of a claim in words.

    The margin is relative to `scale` if given, and otherwise to the paper's number.
    """
    whole, of = scale or abs(paper), scale_name or f"{abs(paper):.4g}"
    reason = f"stated in words: {_percent(ABOUT)} and {_percent(ROUGHLY)} of {of}"
    return Margin(paper, whole, reason, ABOUT * whole, ROUGHLY * whole)


def digits(printed: str) -> Margin:
    """Return the margin of a printed number, which follows from its number of digits."""
    paper, unit = float(printed), 10.0 ** -len(printed.partition(".")[2])
    reason = f"half a unit of the last digit; {_percent(ABOUT)} of {paper:.4g}"
    return Margin(paper, paper, reason, 0.5 * unit, ABOUT * paper)


TREND = Margin(1.0, 1.0, "a trend: it holds or it does not", is_trend=True)


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


@dataclass(frozen=True)
class ClaimFinding:
    """Our number, which decides on a claim of the paper."""

    value: float  #: Our number; nan if the points do not determine it.
    #: Error of our number, from error bars, the scatter about a fit, or the spacing of points.
    error: float
    text: str  #: Description of how the number was found: range, points and dependences.
    #: Points that determine the number. If LAMMPS and the reference engine disagree on more than
    #: one in twenty of these points, the verdict is "not reproduced".
    points: Sequence[MeasuredPoint] = field(default=(), repr=False)
    #: Smallest and largest number from other ranges, or among the values in a mean. The spread does
    #: not widen a margin.
    spread: tuple[float, float] | None = None
    brief: str = ""  #: Text for the summary, if the number alone is not clear.


class Judgement(NamedTuple):
    """Verdict on a claim, with the reason."""

    verdict: Verdict
    reason: str


@dataclass(frozen=True)
class Claim:
    """Claim of the paper, with its margin and the function that finds our number."""

    key: str  #: Short unique name of the claim.
    where: str  #: Place of the claim in the paper.
    text: str  #: Statement in the paper.
    margin: Margin  #: Number in the paper, and its margins.
    brief: str  #: Claim in a few words, for the summary.
    #: Function that finds our number. It raises NoNumber if the points do not determine one.
    find: Callable[[Measurements], ClaimFinding]
    #: Corrected statement, if the claim needs one; ``{value}`` is our number.
    correction: str = ""
    #: Choice on which the number depends but which the paper does not state; empty if there is
    #: none.
    unsaid: str = ""
    figure: str = ""  #: Key of the figure that shows the points; empty if there is none.

    def found(self, measured: Measurements) -> ClaimFinding:
        """Return the finding on the claim; its value is nan if the points determine no number."""
        try:
            return self.find(measured)
        except NoNumber as reason:
            return ClaimFinding(math.nan, math.nan, str(reason))

    def judge(self, finding: ClaimFinding) -> Judgement:
        """
        Judge a finding.

        The verdict is also "not reproduced" if our number is missing, if its error is too large, or
        if LAMMPS and the reference engine disagree on more than one in twenty of its points.
        """
        margin = self.margin
        failed = self._unusable(finding)
        if failed:
            return Judgement(Verdict.NOT_REPRODUCED, failed)
        distance = abs(finding.value - margin.paper)
        error = finding.error if math.isfinite(finding.error) else 0.0
        if distance <= margin.reproduced_within + error:
            return Judgement(Verdict.REPRODUCED, "within the margin")
        low, high = finding.spread or (math.inf, -math.inf)
        could_fail = high - low <= 2.0 * ROUGHLY * margin.whole
        if self.unsaid and low <= margin.paper <= high and could_fail:
            return Judgement(
                Verdict.UNDECIDED,
                f"the paper does not say {self.unsaid}; our choices give {low:.2f} to "
                f"{high:.2f}, which includes its number",
            )
        correction = self.correction.format(value=finding.value)
        if self.unsaid and low <= margin.paper <= high and not could_fail:
            return Judgement(
                Verdict.NOT_REPRODUCED,
                f"the paper does not say {self.unsaid}, and the number is not constant: "
                f"our choices give {low:.2f} to {high:.2f}; {correction}",
            )
        if distance <= margin.corrected_within + error:
            if self.unsaid and finding.spread:
                correction += f"; over the ranges tried {low:.2f} to {high:.2f}"
            return Judgement(Verdict.CORRECTED, correction)
        if margin.is_trend:
            return Judgement(Verdict.NOT_REPRODUCED, "the trend does not hold")
        allowed = max(margin.corrected_within, error)
        reason = f"the difference is {distance:.2g}, but {allowed:.2g} is allowed"
        reason += f"; {correction}" if correction else ""
        return Judgement(Verdict.NOT_REPRODUCED, reason)

    def _unusable(self, finding: ClaimFinding) -> str:
        """Return why a finding cannot be judged; empty if it can."""
        margin, points = self.margin, finding.points
        if not math.isfinite(finding.value):
            return f"no number: {finding.text}"
        if finding.error > (margin.corrected_within or ABOUT * margin.whole):
            return f"our own error, {finding.error:.2g}, is too large to decide"
        apart = sum(point.agrees is False for point in points)
        if apart > _DISAGREEMENTS_ALLOWED * len(points):
            return f"LAMMPS and the reference engine disagree on {apart} of {len(points)} points"
        return ""

    def errors_away(self, finding: ClaimFinding) -> float:
        """Return the difference from the paper's number in units of our error bar, or nan."""
        if self.margin.is_trend or not finding.error > 0.0:
            return math.nan
        return abs(finding.value - self.margin.paper) / finding.error


def claim(
    where: str, margin: Margin, brief: str, *, text: str = "", key: str = "", **more: Any
) -> Callable[[Callable[[Measurements], ClaimFinding]], Claim]:
    """
    Return a decorator for a function that finds our number; the result is a claim.

    By default, the text of the claim is its brief text, and its key is the name of the function.
    """

    def made(find: Callable[[Measurements], ClaimFinding]) -> Claim:
        name = key or find.__name__.strip("_").replace("_", " ")
        return Claim(name, where, text or brief, margin, brief, find, **more)

    return made


def claims_of(module: ModuleType) -> tuple[Claim, ...]:
    """Return the claims that a module defines, in the order of definition."""
    return tuple(value for value in vars(module).values() if isinstance(value, Claim))
