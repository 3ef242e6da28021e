"""Verdicts follow from the margins, and from nothing else."""

import math
import re
from dataclasses import replace

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.claims.all_claims import RULES
from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.measurements import Answer, Point
from chaincor.workflows.reproduce.rules import ABOUT, ROUGHLY, Put, Rule, Verdict, judge

# Margins 0.2 and 0.5.
RULE = Rule("x", "eq. (0)", "x is about 2", 2.0, Put.WORDS, correction="x is {value:.1f}")


def point(lammps: float, in_house: float, bar: float = 1e-6) -> Point:
    def answer(eta):
        return Answer({"restitution": eta, "restitution_error": bar})

    return Point(Scene(), answer(lammps), answer(in_house))


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
    assert judge(RULE, Finding(value, error, "")).verdict is verdict


def test_reasons_are_those_of_the_number_found():
    assert judge(RULE, Finding(2.3, 0.0, "")).reason == "x is 2.3"
    assert judge(RULE, Finding(3.0, 0.0, "")).reason == "1 away, where 0.5 is allowed; x is 3.0"


def test_engines_that_disagree_spoil_a_number_that_is_right():
    good, bad = point(0.9, 0.9 + 1e-6), point(0.9, 0.9 + 3e-6)
    assert judge(RULE, Finding(2.0, 0.0, "", [good] * 20)).verdict is Verdict.REPRODUCED
    assert judge(RULE, Finding(2.0, 0.0, "", [good] * 19 + [bad])).verdict is Verdict.REPRODUCED
    spoilt = judge(RULE, Finding(2.0, 0.0, "", [good] * 9 + [bad]))
    assert spoilt.verdict is Verdict.NOT_REPRODUCED
    assert "disagree on 1 of 10" in spoilt.reason


@pytest.mark.parametrize(
    ("rule", "margins"),
    [
        (Rule("x", "", "", 2.31, Put.DIGITS, unit=0.01), (0.005, 0.231)),
        (Rule("x", "", "", -2.0, Put.WORDS), (0.2, 0.5)),
        (Rule("x", "", "", 0.0, Put.WORDS, scale=0.3, scale_name="a fall"), (0.03, 0.075)),
        (Rule("x", "", "", 1.0, Put.EXACT), (0.0, 0.0)),
    ],
)
def test_margins_go_by_how_a_claim_is_put(rule, margins):
    assert (rule.reproduced_within, rule.corrected_within) == pytest.approx(margins)


def test_exact_claims_allow_our_own_error_alone():
    rule = Rule("x", "", "", 0.0, Put.EXACT, scale=0.03)
    assert judge(rule, Finding(1e-9, 1e-8, "")).verdict is Verdict.REPRODUCED
    assert judge(rule, Finding(1e-7, 1e-8, "")).verdict is Verdict.NOT_REPRODUCED
    # An error that covers everything says nothing.
    assert judge(rule, Finding(0.004, 0.005, "")).verdict is Verdict.NOT_REPRODUCED


def test_a_trend_is_there_or_not():
    rule = Rule("x", "", "x rises", 1.0, Put.TREND)
    assert judge(rule, Finding(1.0, 0.0, "")).verdict is Verdict.REPRODUCED
    judgement = judge(rule, Finding(0.0, 0.0, ""))
    assert (judgement.verdict, judgement.reason) == (Verdict.NOT_REPRODUCED, "it is not so")


def test_how_far_a_number_depends_on_its_range_widens_no_margin():
    found = Finding(2.25, 0.0, "", spread=(1.0, 3.0))
    assert judge(RULE, found).verdict is Verdict.CORRECTED


@pytest.mark.parametrize(
    ("value", "spread", "unsaid", "verdict"),
    [
        (2.3, (1.9, 2.4), "", Verdict.CORRECTED),
        (2.3, (1.9, 2.4), "over which range", Verdict.UNDECIDED),
        (9.0, (1.9, 9.0), "over which range", Verdict.UNDECIDED),
        (2.1, (1.9, 2.4), "over which range", Verdict.REPRODUCED),
        (2.3, (2.25, 2.4), "over which range", Verdict.CORRECTED),
        (2.6, (2.55, 2.7), "over which range", Verdict.NOT_REPRODUCED),
        (1.7, (1.5, 1.9), "over which range", Verdict.CORRECTED),
        (2.3, None, "over which range", Verdict.CORRECTED),
    ],
)
def test_what_the_paper_does_not_say_leaves_a_claim_undecided(value, spread, unsaid, verdict):
    """Only where its number is within what ours give; then nothing is there to correct."""
    found = judge(replace(RULE, unsaid=unsaid), Finding(value, 0.0, "", spread=spread))
    assert found.verdict is verdict
    assert (verdict is Verdict.UNDECIDED) == (unsaid != "" and unsaid in found.reason)


def test_bar_of_a_compared_value_covers_the_difference():
    near, far = point(0.9, 0.9 + 1e-7), point(0.9, 0.9 + 3e-4, bar=2e-4)
    for p in (near, far):
        p.lammps.result["tolerance_met"] = True
    assert near.error == pytest.approx(1e-6)
    assert far.error == pytest.approx(3e-4)
    # Whether the engines agree goes by their own bars.
    assert far.agrees
    assert not point(0.9, 0.9 + 5e-4, bar=2e-4).agrees


@pytest.mark.parametrize(
    ("lammps", "in_house", "source"),
    [
        ((True, 1e-6), (True, 1e-9), "lammps"),
        ((None, 1e-6), (True, 1e-9), "lammps"),
        ((False, 1e-2), (True, 1e-6), "in-house"),
        ((False, 1e-2), (False, 1e-3), "in-house"),
        ((False, 1e-3), (False, 1e-2), "lammps"),
        ((False, None), (False, 1e-2), "in-house"),
        (None, (False, 1e-2), "in-house"),
        ((False, 1e-2), None, "lammps"),
        (None, None, None),
    ],
)
def test_value_shown_is_that_of_lammps_unless_it_misses_what_was_asked(lammps, in_house, source):
    def answer(said):
        if said is None:
            return Answer(None, failure="RunError: no")
        met, bar = said
        return Answer({"restitution": 0.9, "restitution_error": bar, "tolerance_met": met})

    assert Point(Scene(), answer(lammps), answer(in_house)).source == source


def test_rules_are_consistent():
    assert len({rule.key for rule in RULES}) == len(RULES)
    for rule in RULES:
        assert 0.0 <= rule.reproduced_within <= rule.corrected_within
        assert "{" not in rule.correction.format(value=0.5)
        assert rule.brief
        assert len({other.brief for other in RULES}) == len(RULES)
        # Where shares of the paper's number would be none, the scale is named, and in the reason.
        assert rule.paper != 0.0 or rule.scale > 0.0
        assert (rule.scale > 0.0) == bool(rule.scale_name)
        assert rule.put is Put.EXACT or rule.scale_name in rule.margin_reason


def test_units_are_those_of_the_digits_in_the_claim():
    """A claim in digits prints its number, and its unit is that of the last one."""
    for rule in RULES:
        assert (rule.put is Put.DIGITS) == (rule.unit > 0.0)
        if rule.put is Put.DIGITS:
            digits = f"{rule.paper:.{round(-math.log10(rule.unit))}f}"
            assert re.search(rf"{digits}(?!\d)", rule.claim), rule.claim
            assert float(digits) == rule.paper


def test_numbers_as_far_away_have_the_same_verdict():
    """What the old margins did not: 0.18 away was corrected, 0.235 reproduced."""
    rules = {rule.key: rule for rule in RULES}
    for away in (0.05, 0.18, 0.235, 0.3):
        kinds = {
            judge(rules[key], Finding(1.0 + away, 0.0, "")).verdict
            for key in ("place of the minimum", "power r = 3", "contact time r = 3")
        }
        assert len(kinds) == 1
    slope = judge(rules["theoretical slope"], Finding(3.239, 0.0, ""))
    assert slope.verdict is Verdict.NOT_REPRODUCED
    assert "3.24" in slope.reason
    assert (ABOUT, ROUGHLY) == (0.1, 0.25)
