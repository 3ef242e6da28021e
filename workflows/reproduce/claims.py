"""
Judge claims of the paper, by the rule for margins in ``docs/reproduction.md``.

The margin depends on the form of a claim: an exact statement, a trend, a printed number, or words
such as "almost", "near", "approaches" and "agrees". A finding within 10 % satisfies words, and a
finding within a quarter gives "reproduced with a correction". For a trend, the finding is 1 if the
trend is there and 0 if it is not.

Some claims depend on a choice that the paper does not state, such as a range of speeds. A claim is
undecided only if this choice can explain its difference from our number. If the number varies with
the choice by more than the wider margin of words on both sides, the quantity is not constant, and a
claim that it is constant is not reproduced.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from types import ModuleType
from typing import Any, NamedTuple

from chaincor.workflows.reproduce.measurements import MeasuredPoint, Measurements, NoNumber

# The engines may disagree on at most this fraction of the points of a finding.
_DISAGREEMENTS_ALLOWED = 0.05
# These are the relative margins of words, for "reproduced" and for "reproduced with a correction".
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
    """Number of a claim, and how far a finding may be from it."""

    paper: float  #: Number in the paper; 1 for a trend.
    whole: float  #: Quantity that relative margins refer to: the paper's number, or a scale.
    reason: str  #: Reason for the margins.
    #: Largest distance for "reproduced", to which the error of the finding is added.
    reproduced_within: float = 0.0
    corrected_within: float = 0.0  #: The same distance for "reproduced with a correction".
    is_trend: bool = False  #: Whether the claim is a trend without a number.


def exact(paper: float, scale: float = 0.0) -> Margin:
    """Return the margin of an exact statement; findings need errors below 10 % of the scale."""
    return Margin(paper, scale or abs(paper), "said to be exact: within our own error")


def words(paper: float, scale: float = 0.0, scale_name: str = "") -> Margin:
    """Return the margin of a claim in words, relative to the scale or otherwise to the number."""
    whole, of = scale or abs(paper), scale_name or f"{abs(paper):.4g}"
    reason = f"said in words: {_percent(ABOUT)} and {_percent(ROUGHLY)} of {of}"
    return Margin(paper, whole, reason, ABOUT * whole, ROUGHLY * whole)


def digits(printed: str) -> Margin:
    """Return the margin of a printed number from its digits."""
    paper, unit = float(printed), 10.0 ** -len(printed.partition(".")[2])
    reason = f"half a unit of the last digit; {_percent(ABOUT)} of {paper:.4g}"
    return Margin(paper, paper, reason, 0.5 * unit, ABOUT * paper)


TREND = Margin(1.0, 1.0, "a trend: it is so, or not", is_trend=True)


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


@dataclass(frozen=True)
class ClaimFinding:
    """Number that decides on a claim of the paper."""

    value: float  #: Measured number; nan if the points do not give one.
    #: Error of the number: from error bars, the scatter of a fit, or the spacing of points.
    error: float
    text: str  #: Derivation of the number: range, points and dependences.
    #: Points that give the number. If LAMMPS and the reference engine disagree on more than one in
    #: twenty of them, the verdict is "not reproduced".
    points: Sequence[MeasuredPoint] = field(default=(), repr=False)
    #: Smallest and largest value over other ranges, or of the values in a mean. The spread does not
    #: widen a margin.
    spread: tuple[float, float] | None = None
    brief: str = ""  #: Text for the summary, if the number alone says too little.


class Judgement(NamedTuple):
    """Verdict on a claim, with the reason."""

    verdict: Verdict
    reason: str


@dataclass(frozen=True)
class Claim:
    """Claim of the paper, with its margin and the function that finds our number."""

    key: str  #: Short unique name.
    where: str  #: Place in the paper.
    text: str  #: Statement of the paper.
    margin: Margin  #: Number in the paper and margins.
    brief: str  #: Claim in a few words, for the summary.
    #: Function that finds our number. It raises NoNumber if the points do not give one.
    find: Callable[[Measurements], ClaimFinding]
    #: Correction for a claim that is not reproduced as it stands; ``{value}`` is our number.
    correction: str = ""
    unsaid: str = ""  #: Dependence of the number that the paper does not state; empty if it does.
    figure: str = ""  #: Key of the figure that shows the points; empty if there is none.

    def found(self, measured: Measurements) -> ClaimFinding:
        """Return the finding on the claim; its value is nan if the points give no number."""
        try:
            return self.find(measured)
        except NoNumber as reason:
            return ClaimFinding(math.nan, math.nan, str(reason))

    def judge(self, finding: ClaimFinding) -> Judgement:
        """
        Judge a finding.

        The verdict is also "not reproduced" if there is no number, if its error is too large, or
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
            return Judgement(Verdict.NOT_REPRODUCED, "it is not so")
        reason = f"{distance:.2g} away, where {max(margin.corrected_within, error):.2g} is allowed"
        reason += f"; {correction}" if correction else ""
        return Judgement(Verdict.NOT_REPRODUCED, reason)

    def _unusable(self, finding: ClaimFinding) -> str:
        """Return the reason why a finding cannot be judged, or an empty text."""
        margin, points = self.margin, finding.points
        if not math.isfinite(finding.value):
            return f"no number: {finding.text}"
        if finding.error > (margin.corrected_within or ABOUT * margin.whole):
            return f"the error of our own number, {finding.error:.2g}, is too large to say"
        apart = sum(point.agrees is False for point in points)
        if apart > _DISAGREEMENTS_ALLOWED * len(points):
            return f"LAMMPS and the reference engine disagree on {apart} of {len(points)} points"
        return ""

    def errors_away(self, finding: ClaimFinding) -> float:
        """Return the distance from the paper's number over our error bar, or nan."""
        if self.margin.is_trend or not finding.error > 0.0:
            return math.nan
        return abs(finding.value - self.margin.paper) / finding.error


def claim(
    where: str, margin: Margin, brief: str, *, text: str = "", key: str = "", **more: Any
) -> Callable[[Callable[[Measurements], ClaimFinding]], Claim]:
    """
    Return a decorator that turns the function that finds a number into a claim.

    By default, the claim's text is its brief text, and its key is the function's name.
    """

    def made(find: Callable[[Measurements], ClaimFinding]) -> Claim:
        name = key or find.__name__.strip("_").replace("_", " ")
        return Claim(name, where, text or brief, margin, brief, find, **more)

    return made


def claims_of(module: ModuleType) -> tuple[Claim, ...]:
    """Return the claims that a module defines, in the module's order."""
    return tuple(value for value in vars(module).values() if isinstance(value, Claim))
