"""Verdicts follow from the margins, and from nothing else."""

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.measurements import Answer, Point
from chaincor.workflows.reproduce.rules import RULES, Rule, Verdict, judge

RULE = Rule("x", "eq. (0)", "x is 2", 2.0, 0.1, 0.5, "x is {value:.1f}")


def point(lammps: float, in_house: float, bar: float = 1e-6) -> Point:
    def answer(eta):
        return Answer({"restitution": eta, "restitution_error": bar})

    return Point(Scene(), answer(lammps), answer(in_house))


@pytest.mark.parametrize(
    ("value", "error", "verdict"),
    [
        (2.05, 0.0, Verdict.REPRODUCED),
        (2.15, 0.06, Verdict.REPRODUCED),
        (2.15, 0.0, Verdict.CORRECTED),
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
    assert judge(RULE, Finding(3.0, 0.0, "")).reason == "1 away, where 0.5 is allowed"


def test_engines_that_disagree_spoil_a_number_that_is_right():
    good, bad = point(0.9, 0.9 + 1e-6), point(0.9, 0.9 + 3e-6)
    assert judge(RULE, Finding(2.0, 0.0, "", [good] * 20)).verdict is Verdict.REPRODUCED
    assert judge(RULE, Finding(2.0, 0.0, "", [good] * 19 + [bad])).verdict is Verdict.REPRODUCED
    spoilt = judge(RULE, Finding(2.0, 0.0, "", [good] * 9 + [bad]))
    assert spoilt.verdict is Verdict.NOT_REPRODUCED
    assert "disagree on 1 of 10" in spoilt.reason


def test_rules_are_consistent():
    assert len({rule.key for rule in RULES}) == len(RULES)
    for rule in RULES:
        assert 0.0 <= rule.reproduced_within <= rule.corrected_within
        assert "{" not in rule.correction.format(value=0.5)
