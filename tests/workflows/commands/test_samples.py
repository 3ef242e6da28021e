"""Test the output and the refusals of ``chaincor run --samples``."""

import json

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.collide_many import collide_many
from chaincor.workflows.errors import RunError

WARM = ("run", "--potential", "toda", "--particles", "5", "--velocity", "0.08")
WARM += ("--temperature", "1e-3", "--engine", "reference")


def test_numbers_for_people_and_programs(chaincor):
    status, out, err = chaincor(*WARM, "--samples", "30")
    assert status == 0, err
    for name in ("mean", "quantile 50 %", "P(e > 1)", "precision", "0.08"):
        assert name in out
    status, out, err = chaincor(*WARM, "--samples", "30", "--precision", "1e-3", "--json")
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
        ((*WARM, "--precision", "0.1"), "--precision works only with --samples"),
        ((*WARM, "--workers", "2"), "--workers works only with --samples"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(chaincor, options, message):
    status, out, err = chaincor(*options)
    assert status == 2
    assert out == ""
    assert message in err


def test_samples_that_miss_their_tolerance_are_reported(chaincor):
    # No floating-point number has so many digits.
    few = (*WARM, "--samples", "1", "--tolerance", "1e-15", "--json")
    status, out, err = chaincor(*few)
    assert status == 1
    assert json.loads(out)["inexact"] == 1
    assert "1 missed the tolerance. Seed 1: the error reached is" in err


def test_the_text_says_what_few_samples_do_not_tell(chaincor):
    status, out, err = chaincor(*WARM, "--samples", "1", "--precision", "1e-3")
    assert status == 0, err
    assert "one sample does not tell how many are needed" in out
    status, out, err = chaincor(*WARM, "--samples", "4", "--precision", "10")
    assert status == 0, err
    assert "mean of eta to 10: reached with 1 of these samples" in out
    assert "too few samples" in out
    # The steps are so coarse that one error bar reaches above e = 1.
    coarse = ("--scheme", "verlet", "--timestep", "0.6")
    status, out, err = chaincor(*WARM, "--samples", "4", *coarse)
    assert "; for 1 the error bar leaves e > 1 open" in out, err


def test_an_ensemble_without_a_number_says_why():
    # In every sample, particles pass through each other, because the bonds are soft.
    scene = Scene(
        potential="toda", particles=5, velocity=0.08, temperature=1e-4, engine="reference"
    )
    found = collide_many(scene.without("velocity").replace(toda_b=1.0, speed=5.0), 2, workers=1)
    assert repr(found) == "<Ensemble of 2 collisions, none with a number>"
    assert "none with a number" in found._repr_html_()
    with pytest.raises(RunError, match=r"none of 2 collisions has a number: two particles meet"):
        _ = found.eta
    shown = repr(collide_many(scene, 2, workers=1))
    assert shown.startswith("<Ensemble of 2 collisions: mean eta 0.")
