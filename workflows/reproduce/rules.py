"""
How claims of the paper are judged.

There is one rule for margins, the same for all claims. It goes by how the paper puts a claim:

=========  ==========================  ==============================
the claim  reproduced within           with a correction within
=========  ==========================  ==============================
exact      our own error               (never)
trend      what is said is so          (never)
digits     half a unit of the last     10 % of the number: as near as
           digit that is printed       a word would claim
words      10 %                        25 %
=========  ==========================  ==============================

"Almost", "near", "approaches", "agrees" and the like are words: no reader takes them for more than
10 %, nor for less than a quarter. They are taken of the paper's number. If that is 0 or a limit,
they are taken of a natural scale that the rule names, such as the depth of the minimum of eta. Our
own error is added to a margin, and must be smaller than the wider one; for what is exact, than 10 %
of the number or scale. A trend has no number: 1 stands for "it is so", 0 for "it is not".

How far a number depends on the range it is fitted over is stated beside it, and widens no margin:
ranges are fixed, one for all claims of a kind. Where the paper does not say over which range or for
which length it found its number, and that is beyond the first margin but within what ours give, the
claim is undecided: there is nothing to correct.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

from chaincor.workflows.reproduce.findings.finding import Finding

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


class Put(StrEnum):
    """How the paper puts a claim, which decides the margins."""

    EXACT = "exact"
    DIGITS = "digits"
    WORDS = "words"
    TREND = "trend"


@dataclass(frozen=True)
class Rule:
    """
    A claim of the paper and how far our number may be from it.

    Attributes
    ----------
    key : str
        Name of the finding it judges.
    where : str
        Place in the paper.
    claim : str
        What the paper says.
    paper : float
        Its number.
    put : Put
        How it says so.
    unit : float
        Of the last digit that is printed; for digits.
    scale : float
        What the shares are of; the paper's number by default.
    scale_name : str
        What that is.
    correction : str
        What has to be corrected where it is not reproduced as it stands; ``{value}`` stands for the
        number found.
    unsaid : str
        What the number depends on and the paper does not say; empty where it does.
    brief : str
        The claim in a few words, for the summary.
    figure : str
        Key of the figure where its points are seen; empty if there is none.
    """

    key: str
    where: str
    claim: str
    paper: float
    put: Put
    unit: float = 0.0
    scale: float = 0.0
    scale_name: str = ""
    correction: str = ""
    unsaid: str = ""
    brief: str = ""
    figure: str = ""

    @property
    def _scale(self) -> float:
        return self.scale or abs(self.paper)

    @property
    def reproduced_within(self) -> float:
        """Reproduced, if the finding is no further away than this and its error."""
        return {Put.DIGITS: 0.5 * self.unit, Put.WORDS: ABOUT * self._scale}.get(self.put, 0.0)

    @property
    def corrected_within(self) -> float:
        """Reproduced with a correction, if it is no further away than this."""
        return {Put.DIGITS: ABOUT, Put.WORDS: ROUGHLY}.get(self.put, 0.0) * self._scale

    @property
    def largest_error(self) -> float:
        """Own error beyond which nothing can be said."""
        return self.corrected_within or ABOUT * self._scale

    @property
    def margin_reason(self) -> str:
        """Why these margins."""
        of = self.scale_name or f"{abs(self.paper):.4g}"
        return {
            Put.EXACT: "said to be exact: within our own error",
            Put.TREND: "a trend: it is so, or not",
            Put.DIGITS: f"half a unit of the last digit; {ABOUT:.0%} of {of}",
            Put.WORDS: f"said in words: {ABOUT:.0%} and {ROUGHLY:.0%} of {of}",
        }[self.put].replace("%", " %")


@dataclass(frozen=True)
class Judgement:
    """A rule applied to what was found: the verdict, and why."""

    rule: Rule
    finding: Finding
    verdict: Verdict
    reason: str


def judge(rule: Rule, finding: Finding) -> Judgement:
    """
    Apply a rule.

    "Not reproduced" also where there is no number, where its error is too large to say, or where
    LAMMPS and the in-house engine disagree on more than one in twenty of the points it rests on.
    """
    if not math.isfinite(finding.value):
        return Judgement(rule, finding, Verdict.NOT_REPRODUCED, f"no number: {finding.text}")
    if finding.error > rule.largest_error:
        reason = f"the error of our own number, {finding.error:.2g}, is too large to say"
        return Judgement(rule, finding, Verdict.NOT_REPRODUCED, reason)
    if finding.disagreements > _DISAGREEMENTS_ALLOWED * len(finding.points):
        reason = (
            f"LAMMPS and the in-house engine disagree on {finding.disagreements} of "
            f"{len(finding.points)} points"
        )
        return Judgement(rule, finding, Verdict.NOT_REPRODUCED, reason)
    distance = abs(finding.value - rule.paper)
    error = finding.error if math.isfinite(finding.error) else 0.0
    if distance <= rule.reproduced_within + error:
        return Judgement(rule, finding, Verdict.REPRODUCED, "within the margin")
    if rule.unsaid and finding.spread and finding.spread[0] <= rule.paper <= finding.spread[1]:
        low, high = finding.spread
        reason = (
            f"the paper does not say {rule.unsaid}: ours give {low:.2f} to {high:.2f}, and its "
            "number is among them"
        )
        return Judgement(rule, finding, Verdict.UNDECIDED, reason)
    if distance <= rule.corrected_within + error:
        correction = rule.correction.format(value=finding.value)
        if rule.unsaid and finding.spread:
            correction += "; over the ranges tried {:.2f} to {:.2f}".format(*finding.spread)
        return Judgement(rule, finding, Verdict.CORRECTED, correction)
    if rule.put is Put.TREND:
        return Judgement(rule, finding, Verdict.NOT_REPRODUCED, "it is not so")
    reason = f"{distance:.2g} away, where {max(rule.corrected_within, error):.2g} is allowed"
    if rule.correction:
        reason += f"; {rule.correction.format(value=finding.value)}"
    return Judgement(rule, finding, Verdict.NOT_REPRODUCED, reason)
