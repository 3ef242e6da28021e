"""Test which costs the cost model includes, and the sources of its values."""

import json
import math
from dataclasses import replace

import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy import cost_model as module
from chaincor.workflows.accuracy.cost_model import CostModel
from chaincor.workflows.collision import collide

MODEL = CostModel(
    measured_on="never",
    step=1.0,
    harmonic_bond=0.01,
    linear_bond=0.02,
    spline_bond=0.03,
    stage=5.0,
    contact=20.0,
)
LJ = Scene(particles=101)


def test_verlet_is_charged_by_steps_bonds_and_contacts():
    numerics = Numerics(scheme="verlet", timestep=0.5)
    # The run has 200 steps with a cost of 1 and 100 bonds with a cost of 0.03, and 0.9 contacts per
    # particle.
    assert MODEL.integration(LJ.problem, numerics, 100.0) == pytest.approx(
        200 * 4.0 + 0.9 * 101 * 20.0
    )
    linear = replace(numerics, table="linear")
    assert MODEL.integration(LJ.problem, linear, 100.0) == pytest.approx(
        200 * 3.0 + 0.9 * 101 * 20.0
    )
    harmonic = Scene(potential="harmonic", particles=101)
    assert MODEL.integration(harmonic.problem, numerics, 100.0) == pytest.approx(
        200 * 2.0 + 0.9 * 101 * 20.0
    )


def test_a_free_target_is_charged_as_well():
    numerics = Numerics(scheme="verlet", timestep=0.5)
    one, other = (LJ.replace(particles=n, target_particles=102 - n) for n in (1, 101))
    # Each scene has 100 bonds and about one contact, and the wall is checked before each step.
    for scene in (one, other):
        expected = pytest.approx(200 * (4.0 + 8.0 * 5.0) + 0.9 * 20.0)
        assert MODEL.integration(scene.problem, numerics, 100.0) == expected


def test_compositions_are_charged_by_stages():
    numerics = Numerics(scheme="order8", timestep=0.5)
    stages = 17 * (200 + 0.9 * 101)
    assert MODEL.integration(LJ.problem, numerics, 100.0) == pytest.approx(stages * (4.0 + 5.0))


@pytest.fixture
def user_file(tmp_path, monkeypatch):
    path = tmp_path / "settings" / "cost_model.json"
    monkeypatch.setattr(module, "user_cost_model_path", lambda: path)
    module.cost_model.cache_clear()
    yield path
    module.cost_model.cache_clear()


def test_the_users_own_model_is_preferred(user_file):
    shipped = module.cost_model()
    assert shipped.step > 0.0
    MODEL.save(user_file)
    module.cost_model.cache_clear()
    assert module.cost_model() == MODEL
    assert json.loads(user_file.read_text())["measured_on"] == "never"


@pytest.mark.parametrize("text", ["", "{}", '{"step": 1.0, "colour": 2}', "[1, 2]"])
def test_a_broken_file_is_as_good_as_none_and_is_said_to_be(user_file, text, capsys):
    user_file.parent.mkdir()
    user_file.write_text(text)
    assert module.cost_model() == module.shipped_cost_model()
    assert module.cost_model().measured_on != "never"
    said = capsys.readouterr().err
    assert said.count("\n") == 1, "once, in one line"
    assert str(user_file) in said
    assert "--calibrate" in said


def test_no_file_is_nothing_to_speak_of(user_file, capsys):
    assert module.cost_model() == module.shipped_cost_model()
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("tolerance", [1e-4, pytest.param(1e-7, marks=pytest.mark.slow)])
def test_no_number_depends_on_the_cost_model(user_file, tolerance):
    scene = Scene(potential="lj", particles=10, speed=0.4)
    expected = collide(scene, tolerance=tolerance)
    # The cost that is negligible in one of these models exceeds the allowed time in the other.
    for dear in ("stage", "step"):
        module.cost_model.cache_clear()
        replace(MODEL, **{"stage": 1e-9, "step": 1e-9, dear: 1e3}).save(user_file)
        found = collide(scene, tolerance=tolerance, most_seconds=math.inf)
        assert (found.scheme, found.timestep) == (expected.scheme, expected.timestep)
        assert found.restitution == expected.restitution
