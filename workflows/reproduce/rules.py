"""The rules by which claims of the paper are judged: one table, nothing hidden."""

import math
from dataclasses import dataclass
from enum import StrEnum

from chaincor.workflows.reproduce.findings.finding import Finding

# Share of the points a number rests on.
_DISAGREEMENTS_ALLOWED = 0.05


class Verdict(StrEnum):
    """What is said of a claim."""

    REPRODUCED = "reproduced"
    CORRECTED = "reproduced with a correction"
    NOT_REPRODUCED = "not reproduced"


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
    reproduced_within : float
        Reproduced, if the finding is no further away than this and its error: half a unit of the
        last printed digit, or what a word such as "almost" is taken to allow.
    corrected_within : float
        Reproduced with a correction, if it is no further away than this.
    correction : str
        What has to be corrected in that case; ``{value}`` stands for the number found.
    """

    key: str
    where: str
    claim: str
    paper: float
    reproduced_within: float
    corrected_within: float
    correction: str = ""


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

    "Not reproduced" also where there is no number, where its error is as large as the widest
    margin, or where LAMMPS and the in-house engine disagree on more than one in twenty of the
    points it rests on.
    """
    if not math.isfinite(finding.value):
        return Judgement(rule, finding, Verdict.NOT_REPRODUCED, f"no number: {finding.text}")
    if finding.error > max(rule.corrected_within, rule.reproduced_within):
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
    if distance <= rule.corrected_within + error:
        correction = rule.correction.format(value=finding.value)
        return Judgement(rule, finding, Verdict.CORRECTED, correction)
    reason = f"{distance:.2g} away, where {max(rule.corrected_within, error):.2g} is allowed"
    return Judgement(rule, finding, Verdict.NOT_REPRODUCED, reason)


RULES = (
    # ---- harmonic chains
    Rule(
        "independence of v0", "II", "η of a harmonic chain does not depend on v₀", 0.0, 1e-5, 1e-3
    ),
    Rule("contact time", "II", "contact time t_c is almost 2τ for large n", 2.0, 0.02, 0.2),
    Rule(
        "interval",
        "eq. (8)",
        "Δt = 2.31/ω at n = 500",
        2.31,
        0.005,
        0.05,
        "the mean interval is {value:.3f}",
    ),
    Rule(
        "contacts per particle",
        "eq. (9)",
        "f(n)/n = 0.867 at n = 500",
        0.867,
        0.0005,
        0.01,
        "there are a few more contacts: {value:.3f}",
    ),
    Rule("incoming speed", "eq. (10)", "v = 1.15 v₀ at n = 500", 1.15, 0.005, 0.05),
    Rule("harmonic exponent", "eq. (12)", "1 − η ∝ n^(−2/3)", -2.0 / 3.0, 0.02, 0.1),
    Rule(
        "harmonic prefactor",
        "eq. (12)",
        "1 − η = 0.652 n^(−2/3) agrees very well",
        0.652,
        0.01,
        0.1,
        "{value:.2f} on average, with scatter; single chains are off by up to a third",
    ),
    Rule("formula prefactor", "eq. (12)", "0.652 follows from eqs. (7)–(11)", 0.652, 0.0005, 0.01),
    # ---- restitution against speed
    Rule("low-speed limit", "III", "η → η(harmonic) at low speed", 0.0, 0.005, 0.02),
    Rule(
        "place of the minimum",
        "III, abstract",
        "minimum of η near v₀/v* = 1",
        1.0,
        0.1,
        0.3,
        "it is at {value:.2f} v* on average",
    ),
    Rule(
        "collapse lj toda",
        "III, figure 4",
        "lj and toda: almost the same curve η(v/v*)",
        0.0,
        0.02,
        0.05,
    ),
    Rule(
        "collapse lj log",
        "III, figure 4",
        "log too: almost the same curve up to 0.9 v*",
        0.0,
        0.02,
        0.05,
        "log follows only within {value:.3f}",
    ),
    Rule(
        "collapse lj log, fast",
        "III, figure 4; IV",
        "log too: almost the same curve from 0.9 to 2 v*",
        0.0,
        0.02,
        0.05,
        "log leaves the curve by {value:.3f}",
    ),
    Rule("high-speed limit", "III", "η → 1 at high speed", 1.0, 0.005, 0.05),
    Rule("contacts at high speed", "III, figure 7", "f(n)/n → 1 at high speed", 1.0, 0.005, 0.05),
    Rule("rise of contacts", "figure 7", "f(n)/n and η rise at v₀/v* ≈ 1", 1.0, 0.25, 0.5),
    Rule("hard spheres", "III", "hard spheres: η = 1 exactly", 1.0, 0.0, 0.0),
    Rule("hard-sphere contacts", "III", "hard spheres: n contacts (as f/n)", 1.0, 0.0, 0.0),
    # ---- long chains
    Rule(
        "long chains, fast",
        "III, figure 5",
        "1 − η at 0.78 v* tends to a constant (exponent 0)",
        0.0,
        0.05,
        0.2,
    ),
    Rule(
        "long chains, slow",
        "III, figure 5",
        "1 − η at 0.008 v* vanishes in long chains (exponent −2/3)",
        -2.0 / 3.0,
        0.05,
        0.2,
        "it falls as n^({value:.2f})",
    ),
    # ---- low speed
    Rule("alpha", "eq. (15)", "n = 2, lj: α = 0.808", 0.808, 0.0005, 0.02, "α = {value:.4f}"),
    Rule(
        "theoretical slope",
        "eq. (18)",
        "theory: C = 32α/π² = 2.61",
        2.61,
        0.005,
        1.0,
        "with the factor v²/v₀² = π²/8 that was dropped, C = 4α = {value:.2f}",
    ),
    Rule(
        "simulated slope",
        "III",
        "simulation: C = 0.66",
        0.66,
        0.05,
        0.3,
        "{value:.2f} at n = 100; there is no single C: it depends on n and on the range",
    ),
    *(
        Rule(
            f"power r = {order}",
            "eq. (20)",
            f"increase ∝ v^(r−2), r = {order}, at low speed",
            order - 2.0,
            0.1,
            0.4,
            "the power grows with speed; r − 2 is the limit",
        )
        for order in (3, 4, 5)
    ),
    *(
        Rule(
            f"printed power r = {order}",
            "figure 6",
            f"slope {slope} for r = {order}, over some range",
            slope,
            0.05,
            0.2,
            "no range that begins at 0.01 v* gives it exactly",
        )
        for order, slope in ((3, 1.34), (4, 2.09), (5, 3.14))
    ),
)
