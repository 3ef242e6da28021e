"""``chaincor run --samples``: what is printed, and what is refused."""

import json

import pytest

from tests.workflows.commands.test_run import chaincor

WARM = ("run", "--potential", "toda", "--particles", "5", "--velocity", "0.08")
WARM += ("--temperature", "1e-3", "--engine", "reference")


def test_numbers_for_people_and_programs(capsys):
    status, out, err = chaincor(capsys, *WARM, "--samples", "30")
    assert status == 0, err
    for name in ("mean", "quantile 50 %", "P(e > 1)", "precision", "0.08"):
        assert name in out
    status, out, err = chaincor(capsys, *WARM, "--samples", "30", "--precision", "1e-3", "--json")
    assert status == 0, err
    found = json.loads(out)
    assert len(found["samples"]) == 30
    assert found["precision"] == 1e-3
    expected = (found["eta"]["deviation"] / 1e-3) ** 2
    assert found["samples_needed"] == pytest.approx(expected, abs=1.0)
    assert found["above_one"]["low"] <= found["above_one"]["value"] <= found["above_one"]["high"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("run", "--samples", "5"), "samples needs a temperature"),
        ((*WARM, "--samples", "0"), "--samples"),
        ((*WARM, "--samples", "5", "--watch"), "--watch shows one collision"),
        ((*WARM, "--samples", "5", "--animate", "a.gif"), "--animate shows one collision"),
        ((*WARM, "--samples", "5", "--arrays", "a.npz"), "arrays is given"),
        ((*WARM, "--precision", "0.1"), "--precision goes with --samples"),
        ((*WARM, "--workers", "2"), "--workers goes with --samples"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(capsys, options, message):
    status, out, err = chaincor(capsys, *options)
    assert status == 2
    assert out == ""
    assert message in err


def test_samples_that_miss_their_tolerance_are_told(capsys):
    # No number has so many digits.
    few = (*WARM, "--samples", "1", "--tolerance", "1e-15", "--json")
    status, out, err = chaincor(capsys, *few)
    assert status == 1
    assert json.loads(out)["inexact"] == 1
    assert "1 do not meet the tolerance; seed 1: the error reached is" in err
