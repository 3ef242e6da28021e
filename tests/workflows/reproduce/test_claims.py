"""Test that verdicts depend only on margins."""

import math
import re
from dataclasses import replace

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.claims import (
    ABOUT,
    ROUGHLY,
    TREND,
    Claim,
    ClaimFinding,
    Verdict,
    digits,
    exact,
    words,
)
from chaincor.workflows.reproduce.measurements import Answer, MeasuredPoint, NoNumber
from chaincor.workflows.reproduce.paper import CLAIMS
from chaincor.workflows.reproduce.report import describe_found, verdict_row


def made(margin, **more):
    return Claim("x", "eq. (0)", "x is about 2", margin, "x", lambda _: None, **more)


# This claim has margins of 0.2 and 0.5.
CLAIM = made(words(2.0), correction="x is {value:.1f}")


def point(lammps: float, reference: float, bar: float = 1e-6) -> MeasuredPoint:
    def answer(eta):
        return Answer({"restitution": eta, "restitution_error": bar})

    return MeasuredPoint(Scene(), answer(lammps), answer(reference))


@pytest.mark.parametrize(
    ("value", "error", "verdict"),
    [
        (2.19, 0.0, Verdict.REPRODUCED),
        (2.25, 0.06, Verdict.REPRODUCED),
        (2.25, 0.0, Verdict.CORRECTED),
        (1.6, 0.0, Verdict.CORRECTED),
        (2.6, 0.0, Verdict.NOT_REPRODUCED),
        (float("nan"), 0.0, Verdict.NOT_REPRODUCED),
        (2.0, 0.6, Verdict.NOT_REPRODUCED),
    ],
)
def test_margins_decide(value, error, verdict):
    assert CLAIM.judge(ClaimFinding(value, error, "")).verdict is verdict


def test_reasons_are_those_of_the_number_found():
    assert CLAIM.judge(ClaimFinding(2.3, 0.0, "")).reason == "x is 2.3"
    assert (
        CLAIM.judge(ClaimFinding(3.0, 0.0, "")).reason
        == "the difference is 1, but 0.5 is allowed; x is 3.0"
    )


def test_engines_that_disagree_spoil_a_number_that_is_right():
    good, bad = point(0.9, 0.9 + 1e-6), point(0.9, 0.9 + 3e-6)
    assert CLAIM.judge(ClaimFinding(2.0, 0.0, "", [good] * 20)).verdict is Verdict.REPRODUCED
    assert (
        CLAIM.judge(ClaimFinding(2.0, 0.0, "", [good] * 19 + [bad])).verdict is Verdict.REPRODUCED
    )
    spoilt = CLAIM.judge(ClaimFinding(2.0, 0.0, "", [good] * 9 + [bad]))
    assert spoilt.verdict is Verdict.NOT_REPRODUCED
    assert "disagree on 1 of 10" in spoilt.reason


@pytest.mark.parametrize(
    ("margin", "widths"),
    [
        (digits("2.31"), (0.005, 0.231)),
        (digits("0.90"), (0.005, 0.09)),
        (words(-2.0), (0.2, 0.5)),
        (words(0.0, 0.3, "a fall"), (0.03, 0.075)),
        (exact(1.0), (0.0, 0.0)),
    ],
)
def test_margins_go_by_how_a_claim_is_put(margin, widths):
    assert (margin.reproduced_within, margin.corrected_within) == pytest.approx(widths)


def test_exact_claims_allow_our_own_error_alone():
    claim = made(exact(0.0, 0.03))
    assert claim.judge(ClaimFinding(1e-9, 1e-8, "")).verdict is Verdict.REPRODUCED
    assert claim.judge(ClaimFinding(1e-7, 1e-8, "")).verdict is Verdict.NOT_REPRODUCED
    # A result whose error covers all verdicts gives none.
    assert claim.judge(ClaimFinding(0.004, 0.005, "")).verdict is Verdict.NOT_REPRODUCED


def test_a_trend_is_there_or_not():
    claim = made(TREND)
    assert claim.judge(ClaimFinding(1.0, 0.0, "")).verdict is Verdict.REPRODUCED
    judgement = claim.judge(ClaimFinding(0.0, 0.0, ""))
    assert (judgement.verdict, judgement.reason) == (
        Verdict.NOT_REPRODUCED,
        "the trend does not hold",
    )


def test_how_far_a_number_depends_on_its_range_widens_no_margin():
    found = ClaimFinding(2.25, 0.0, "", spread=(1.0, 3.0))
    assert CLAIM.judge(found).verdict is Verdict.CORRECTED


@pytest.mark.parametrize(
    ("value", "spread", "unsaid", "verdict"),
    [
        (2.3, (1.9, 2.4), "", Verdict.CORRECTED),
        (2.3, (1.9, 2.4), "over which range", Verdict.UNDECIDED),
        (9.0, (1.9, 9.0), "over which range", Verdict.NOT_REPRODUCED),
        (2.3, (1.5, 2.51), "over which range", Verdict.NOT_REPRODUCED),
        (2.1, (1.5, 2.51), "over which range", Verdict.REPRODUCED),
        (2.3, (1.5, 2.49), "over which range", Verdict.UNDECIDED),
        (2.1, (1.9, 2.4), "over which range", Verdict.REPRODUCED),
        (2.3, (2.25, 2.4), "over which range", Verdict.CORRECTED),
        (2.6, (2.55, 2.7), "over which range", Verdict.NOT_REPRODUCED),
        (1.7, (1.5, 1.9), "over which range", Verdict.CORRECTED),
        (2.3, None, "over which range", Verdict.CORRECTED),
    ],
)
def test_what_the_paper_does_not_say_leaves_a_claim_undecided(value, spread, unsaid, verdict):
    """Require that the spread of our results includes the paper's number."""
    found = replace(CLAIM, unsaid=unsaid).judge(ClaimFinding(value, 0.0, "", spread=spread))
    assert found.verdict is verdict
    if verdict is Verdict.UNDECIDED:
        assert unsaid in found.reason


def test_bar_of_a_compared_value_covers_the_difference():
    near, far = point(0.9, 0.9 + 1e-7), point(0.9, 0.9 + 3e-4, bar=2e-4)
    for p in (near, far):
        p.lammps.result["tolerance_met"] = True
    assert near.error == pytest.approx(1e-6)
    assert far.error == pytest.approx(3e-4)
    # The agreement of the engines is judged by their own error bars.
    assert far.agrees
    assert not point(0.9, 0.9 + 5e-4, bar=2e-4).agrees


@pytest.mark.parametrize(
    ("lammps", "reference", "source"),
    [
        ((True, 1e-6), (True, 1e-9), "lammps"),
        ((None, 1e-6), (True, 1e-9), "lammps"),
        ((False, 1e-2), (True, 1e-6), "reference"),
        ((False, 1e-2), (False, 1e-3), "reference"),
        ((False, 1e-3), (False, 1e-2), "lammps"),
        ((False, None), (False, 1e-2), "reference"),
        (None, (False, 1e-2), "reference"),
        ((False, 1e-2), None, "lammps"),
        (None, None, None),
    ],
)
def test_value_shown_is_that_of_lammps_unless_it_misses_what_was_asked(lammps, reference, source):
    def answer(said):
        if said is None:
            return Answer({}, failure="RunError: no")
        met, bar = said
        return Answer({"restitution": 0.9, "restitution_error": bar, "tolerance_met": met})

    assert MeasuredPoint(Scene(), answer(lammps), answer(reference)).source == source


def test_claims_are_consistent():
    assert len({claim.key for claim in CLAIMS}) == len(CLAIMS)
    assert len({claim.brief for claim in CLAIMS}) == len(CLAIMS)
    for claim in CLAIMS:
        margin = claim.margin
        assert 0.0 <= margin.reproduced_within <= margin.corrected_within
        assert "{" not in claim.correction.format(value=0.5)
        assert claim.brief
        # If the paper's number is 0, the margins are fractions of another scale.
        assert margin.whole > 0.0


def test_units_are_those_of_the_digits_in_the_claim():
    """Require that a claim judged by digits contains its number with all these digits."""
    for claim in CLAIMS:
        margin = claim.margin
        if margin.reason.startswith("half a unit of the last digit"):
            unit = 2.0 * margin.reproduced_within
            printed = f"{margin.paper:.{round(-math.log10(unit))}f}"
            assert re.search(rf"{printed}(?!\d)", claim.text), claim.text
            assert float(printed) == margin.paper


def test_numbers_as_far_away_have_the_same_verdict():
    """Give equal verdicts to equal deviations; once, 0.18 was corrected but 0.235 reproduced."""
    claims = {claim.key: claim for claim in CLAIMS}
    for away in (0.05, 0.18, 0.235, 0.3):
        kinds = {
            claims[key].judge(ClaimFinding(1.0 + away, 0.0, "")).verdict
            for key in ("place of the minimum", "power r = 3", "contact time r = 3")
        }
        assert len(kinds) == 1
    slope = claims["theoretical slope"].judge(ClaimFinding(3.239, 0.0, ""))
    assert slope.verdict is Verdict.NOT_REPRODUCED
    assert "3.24" in slope.reason
    assert (ABOUT, ROUGHLY) == (0.1, 0.25)


def test_what_cannot_be_found_is_not_reproduced_and_says_why():
    def find(_):
        raise NoNumber("fewer than four speeds")

    claim = replace(CLAIM, find=find)
    judgement = claim.judge(claim.found(None))
    assert judgement.verdict is Verdict.NOT_REPRODUCED
    assert judgement.reason == "no number: fewer than four speeds"


def test_summary_says_no_yes_of_a_trend_without_points():
    row = verdict_row(made(TREND), ClaimFinding(math.nan, math.nan, "no points"))
    assert row["in_brief"] == describe_found(row) == "–"
    assert verdict_row(made(TREND), ClaimFinding(1.0, 0.0, ""))["in_brief"] == "yes"
    assert verdict_row(CLAIM, ClaimFinding(1.5, 0.1, ""))["in_brief"] == "1.50, −25 %"
