"""
How claims of the paper are judged: by one rule for margins, which ``docs/reproduction.md`` tells.

It goes by how the paper puts a claim: exactly, as a trend, in digits or in words. "Almost", "near",
"approaches", "agrees" and the like are words: no reader takes them for more than 10 %, nor for less
than a quarter. A trend has no number: 1 stands for "it is so", 0 for "it is not".

A claim is undecided only if the ranges that the paper leaves open could have missed its number. If
these ranges give more than the wider margin of words on both sides, the quantity is no constant,
and the claim of a constant is not reproduced.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from types import ModuleType
from typing import Any, NamedTuple

from chaincor.workflows.reproduce.measurements import Measurements, NoNumber, Point

# Share of the points a number rests on.
_DISAGREEMENTS_ALLOWED = 0.05
# What words claim, and what is still near enough to be corrected.
ABOUT = 0.1
ROUGHLY = 0.25


class Verdict(StrEnum):
    """What is said of a claim."""

    REPRODUCED = "reproduced"
    CORRECTED = "reproduced with a correction"
    UNDECIDED = "undecided"
    NOT_REPRODUCED = "not reproduced"


@dataclass(frozen=True)
class Margin:
    """The number of a claim, and how far ours may be from it."""

    paper: float  #: The paper's number; 1 for a trend.
    whole: float  #: What shares are taken of: the paper's number, or a scale.
    reason: str  #: Why these margins.
    #: Reproduced, or reproduced with a correction, if the finding is no further away than this and
    #: its error.
    reproduced_within: float = 0.0
    corrected_within: float = 0.0  #: See ``reproduced_within``.
    is_trend: bool = False  #: Whether something is said to be so, without a number.


def exact(paper: float, scale: float = 0.0) -> Margin:
    """Return the margin of an exact statement; our own error is to be below 10 % of the scale."""
    return Margin(paper, scale or abs(paper), "said to be exact: within our own error")


def words(paper: float, scale: float = 0.0, scale_name: str = "") -> Margin:
    """Return the margin of what is said in words; shares are of the scale, if there is one."""
    whole, of = scale or abs(paper), scale_name or f"{abs(paper):.4g}"
    reason = f"said in words: {_percent(ABOUT)} and {_percent(ROUGHLY)} of {of}"
    return Margin(paper, whole, reason, ABOUT * whole, ROUGHLY * whole)


def digits(printed: str) -> Margin:
    """Return the margin of a number, written as it is printed."""
    paper, unit = float(printed), 10.0 ** -len(printed.partition(".")[2])
    reason = f"half a unit of the last digit; {_percent(ABOUT)} of {paper:.4g}"
    return Margin(paper, paper, reason, 0.5 * unit, ABOUT * paper)


TREND = Margin(1.0, 1.0, "a trend: it is so, or not", is_trend=True)


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


@dataclass(frozen=True)
class Finding:
    """One number that a claim of the paper is judged by."""

    value: float  #: The number; nan where the points do not give one.
    #: Its error: from error bars, from the scatter of a fit, or the spacing of points.
    error: float
    text: str  #: How it was found: range, points, what it depends on.
    #: What it rests on: if LAMMPS and the in-house engine disagree on one of them, no verdict can
    #: be better than "not reproduced".
    points: Sequence[Point] = field(default=(), repr=False)
    #: Least and largest value over other ranges, or of what it is a mean of; it widens no margin.
    spread: tuple[float, float] | None = None
    brief: str = ""  #: What the summary says of it, where the number alone would say too little.


class Judgement(NamedTuple):
    """What is said of a claim, and why."""

    verdict: Verdict
    reason: str


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, how far our number may be from its, and how ours is found."""

    key: str  #: A short name, unique.
    where: str  #: Place in the paper.
    text: str  #: What the paper says.
    margin: Margin  #: Its number and the margins.
    brief: str  #: The claim in a few words, for the summary.
    #: Finds our number; raises NoNumber where the points do not give it.
    find: Callable[[Measurements], Finding]
    #: What has to be corrected where it is not reproduced as it stands; ``{value}`` stands for the
    #: number found.
    correction: str = ""
    unsaid: str = ""  #: What the number depends on and the paper does not say; empty where it does.
    figure: str = ""  #: Key of the figure where its points are seen; empty if there is none.

    def found(self, measured: Measurements) -> Finding:
        """Return the number found: nan, with the reason, where there is none."""
        try:
            return self.find(measured)
        except NoNumber as reason:
            return Finding(math.nan, math.nan, str(reason))

    def judge(self, finding: Finding) -> Judgement:
        """
        Judge what was found.

        "Not reproduced" also where there is no number, where its error is too large to say, or
        where LAMMPS and the in-house engine disagree on more than one in twenty of the points it
        rests on.
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
                f"the paper does not say {self.unsaid}: ours give {low:.2f} to {high:.2f}, and its "
                "number is among them",
            )
        correction = self.correction.format(value=finding.value)
        if self.unsaid and low <= margin.paper <= high and not could_fail:
            return Judgement(
                Verdict.NOT_REPRODUCED,
                f"the paper does not say {self.unsaid}, and it is no constant: ours give {low:.2f} "
                f"to {high:.2f}; {correction}",
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

    def _unusable(self, finding: Finding) -> str:
        """Say why nothing can be judged by a number; empty where it can."""
        margin, points = self.margin, finding.points
        if not math.isfinite(finding.value):
            return f"no number: {finding.text}"
        if finding.error > (margin.corrected_within or ABOUT * margin.whole):
            return f"the error of our own number, {finding.error:.2g}, is too large to say"
        apart = sum(point.agrees is False for point in points)
        if apart > _DISAGREEMENTS_ALLOWED * len(points):
            return f"LAMMPS and the in-house engine disagree on {apart} of {len(points)} points"
        return ""

    def errors_away(self, finding: Finding) -> float:
        """Return how far our number is from the paper's, in its errors; nan where it has none."""
        if self.margin.is_trend or not finding.error > 0.0:
            return math.nan
        return abs(finding.value - self.margin.paper) / finding.error


def claim(
    where: str, margin: Margin, brief: str, *, text: str = "", key: str = "", **more: Any
) -> Callable[[Callable[[Measurements], Finding]], Claim]:
    """
    Make a claim of the function that finds its number.

    Where they are not given, what the paper says is the brief, and the key the function's name.
    """

    def made(find: Callable[[Measurements], Finding]) -> Claim:
        name = key or find.__name__.strip("_").replace("_", " ")
        return Claim(name, where, text or brief, margin, brief, find, **more)

    return made


def claims_of(module: ModuleType) -> tuple[Claim, ...]:
    """Return the claims that a module makes, in its order."""
    return tuple(value for value in vars(module).values() if isinstance(value, Claim))
