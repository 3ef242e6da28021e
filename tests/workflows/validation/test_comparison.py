"""Test that right integrators agree and wrong ones are found."""

import json
from dataclasses import replace

import numpy as np
import pytest

from chaincor.analysis.error_bar import error_alone
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.given_bodies import given_bodies
from chaincor.workflows.accuracy import by_lammps
from chaincor.workflows.collision import collide
from chaincor.workflows.validation.comparison import validate
from chaincor.workflows.validation.grid import grid_around
from chaincor.workflows.validation.user_comparison import validate_user

# A user's integrator in a module that the child process imports. It takes the reference engine's
# steps, which a test may spoil.
MODULE = """
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.workflows.engines.reference import stepping as reference

def collide(scene, timestep=0.1, force=1.0):
    if force != 1.0:
        bond = scene.bond
        spoilt = UserBond(bond.energy, lambda s: force * bond.force(s))
        scene = scene.replace(potential=spoilt, speed=None, velocity=scene.impact_velocity)
    done = reference.run(scene.problem, Numerics(scheme="order8", timestep=timestep))
    return {
        "velocities": done.velocities,
        "displacements": done.displacements,
        "contact_times": done.contact_times,
        "contact_speeds": done.contact_speeds,
    }

def long_steps(scene):
    return collide(scene, timestep=1.0)

def off_by_a_millionth(scene):
    return collide(scene, force=1.0 + 1e-6)
"""
SCENE = Scene(potential="lj", particles=10, speed=0.4, tolerance=1e-9)


@pytest.fixture
def users_module(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def verdicts(validation):
    return {each.quantity: each.agrees for each in validation.comparisons}


@pytest.mark.parametrize(
    "scene",
    [
        SCENE,
        Scene(potential="harmonic", particles=20, velocity=0.1, tolerance=1e-9),
        Scene(potential="log", particles=5, speed=1.0, tolerance=1e-8),
        Scene(potential="power", power_order=4, power_c=1.0, particles=8, speed=1.0),
    ],
    ids=lambda scene: scene.label,
)
def test_both_engines_agree_in_every_quantity(scene):
    found = validate(scene)
    assert found.agrees, found
    assert set(verdicts(found)) == {
        "restitution", "contacts", "contact_times", "contact_speeds", "velocities",
        "mode_energies", "fragments", "bond_min", "bond_max",
    }  # fmt: skip
    # All quantities are judged, within narrow limits. Limits of bond lengths are wider, because
    # bonds are sampled at steps.
    for each in found.comparisons:
        assert 0.0 <= each.allowed < (0.1 if each.quantity.startswith("bond") else 1e-4)


def test_bonds_are_compared_within_what_steps_leave_unseen():
    # Steps of 0.64 in the reference engine miss a tenth of the longest bond's strain.
    found = validate(Scene(potential="toda", particles=6, speed=0.049, tolerance=1e-3))
    assert found.agrees, found
    (longest,) = (each for each in found.comparisons if each.quantity == "bond_max")
    assert longest.difference < longest.allowed < 2e-3


def test_the_stock_wall_is_distinguished():
    # The stock wall does not locate contacts, so that times have errors of parts of a step. Their
    # error bar is the difference to half the step. Within such bars, results may agree, but not
    # within the bars of exact contacts.
    found = validate(SCENE.replace(tolerance=None, wall="reflect", timestep=0.005))
    exact = validate(SCENE)
    difference = {each.quantity: each.difference for each in found.comparisons}
    allowed = {each.quantity: each.allowed for each in exact.comparisons}
    assert difference["restitution"] > 1e3 * allowed["restitution"]
    assert difference["contact_times"] > 1e3 * allowed["contact_times"]


def test_a_users_integrator_that_is_right(users_module):
    found = validate_user(SCENE, "mine:collide")
    assert found.agrees
    assert set(verdicts(found)) == {
        "restitution", "contacts", "contact_times", "contact_speeds", "mode_energies"
    }  # fmt: skip


@pytest.mark.parametrize("wrong", ["long_steps", "off_by_a_millionth"])
@pytest.mark.slow_cases
def test_a_users_integrator_that_is_wrong(users_module, wrong):
    # A relative error of 1e-6 in the force acts like one of 5e-7 in the speed. eta falls by about
    # 0.2 per v*, which gives 4e-8 here.
    found = validate_user(SCENE, f"mine:{wrong}")
    assert not verdicts(found)["restitution"]
    assert not found.agrees


def test_the_grid_keeps_tolerance_and_numerics():
    grid = grid_around(SCENE.replace(tolerance=None, scheme="order6", timestep=0.05))
    assert len(grid) == 50
    assert {scene.label for scene in grid} == {"harmonic", "lj", "toda", "log"}
    assert {(scene.scheme, scene.timestep) for scene in grid} == {("order6", 0.05)}
    assert {scene.tolerance for scene in grid_around(SCENE)} == {1e-9}


def test_the_grid_has_bodies_of_every_kind_that_numerics_allow():
    kinds = [set(given_bodies(scene)) for scene in grid_around(SCENE)]
    every = {"masses", "target_particles", "target_masses", "contact", "compression"}
    assert set().union(*kinds) == every | {"temperature"}
    # The stock wall is rigid and hard. A user's integrator may support only chains at walls.
    stock = grid_around(SCENE.replace(tolerance=None, wall="reflect"))
    given = set().union(*(set(given_bodies(scene)) for scene in stock))
    assert given == {"masses", "compression", "temperature"}
    assert not any(given_bodies(scene) for scene in grid_around(SCENE, bodies=False))


def test_the_command_says_who_agrees(chaincor, users_module):
    scene = ("--potential", "lj", "--particles", "10", "--tolerance", "1e-8")
    status, out, _ = chaincor("validate", *scene, "--json", "--plot", "agreement.png")
    assert status == 0
    assert json.loads(out)["agrees"] is True
    assert (users_module / "agreement.png").stat().st_size > 5000
    status, out, _ = chaincor("validate", *scene, "--against", "mine:long_steps")
    assert status == 1
    assert out.endswith("verdict: they DIFFER\n")


@pytest.mark.slow
def test_the_whole_grid_agrees(chaincor):
    status, out, _ = chaincor("validate", "--grid", "--tolerance", "1e-8", "--json")
    report = json.loads(out)
    assert [v for v in report["validations"] if not v["agrees"]] == []
    assert status == 0
    assert np.isfinite([v["restitution"] for v in report["validations"]]).all()


def test_pieces_and_bonds_are_those_of_the_last_contact():
    # Engines stop at different times, which must not affect these results.
    validation = validate(Scene(potential="lj", particles=50, speed=1.2, tolerance=1e-6))
    found = {each.quantity: each for each in validation.comparisons}
    assert found["fragments"].difference == 0
    # Each engine samples the longest bond at the steps of reference runs.
    assert found["bond_max"].difference < 1e-2
    assert validation.agrees


@pytest.mark.parametrize("fields", [{"compression": 0.02}, {"temperature": 1e-3}])
def test_arrays_of_explicit_numerics_are_within_what_their_steps_say(fields):
    # The difference to half the step is 3/4 of an error of order 2.
    result = validate(Scene(particles=6, speed=0.3, scheme="verlet", timestep=0.01, **fields))
    assert result.agrees, [c for c in result.comparisons if not c.agrees]


def test_a_validation_shows_its_verdict():
    shown = repr(validate(SCENE.replace(particles=3)))
    assert shown.startswith("3 particles, ")
    assert shown.splitlines()[-1] == "verdict: they agree"


def test_what_is_no_scene_is_refused_in_one_line():
    with pytest.raises(InputError, match="type dict was given instead of a scene"):
        validate({"particles": 3})


def test_hard_spheres_are_compared_in_what_they_tell(chaincor):
    # Times, speeds and modes are those of hard spheres; their error is unknown.
    scene = ("--potential", "lj", "--particles", "5", "--velocity", "4.497", "--tolerance", "1e-4")
    status, out, _ = chaincor("validate", *scene)
    assert status == 0, out
    for name in ("contact_times", "velocities", "mode_energies", "bond_max"):
        assert any(row.startswith(name) and "not judged" in row for row in out.splitlines())
    assert any(row.startswith("bond_min") and "agrees" in row for row in out.splitlines())


def test_where_runs_differ_in_their_contacts_neither_number_nor_velocities_are_judged():
    # With such a long step, LAMMPS's own two runs differ in their contacts, so that their
    # velocities have no error.
    scene = Scene(potential="lj", particles=20, speed=1.0, scheme="verlet", timestep=0.2)
    found = validate(scene)
    allowed = {each.quantity: each.allowed for each in found.comparisons}
    differences = {each.quantity: each.difference for each in found.comparisons}
    assert differences["contacts"] == 1
    assert (allowed["contacts"], allowed["velocities"], allowed["mode_energies"]) == (None,) * 3
    assert allowed["restitution"] is not None
    assert found.agrees


def test_lammps_is_judged_by_what_its_own_runs_tell(monkeypatch):
    # If the reference result is wrong, the error bar includes the difference to it and does not
    # describe LAMMPS.
    scene = Scene(potential="lj", particles=5, speed=0.4)
    exact = collide(scene.replace(engine="reference"), tolerance=1e-12).restitution

    class Misled(by_lammps.LammpsSearch):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            wrong = replace(self.pilot.reference, restitution=exact + 1e-2)
            self.pilot = replace(self.pilot, reference=wrong)

    monkeypatch.setattr(by_lammps, "LammpsSearch", Misled)
    misled = collide(scene)
    assert misled.restitution_error > 0.9e-2
    alone = error_alone(misled.details, misled.restitution_error)
    assert abs(misled.restitution - exact) < alone < 1e-6
