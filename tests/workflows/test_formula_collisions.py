"""Test Morse chains and bonds by formula in both engines against other integrators."""

import numpy as np
import pytest

from benchmarks.bars.formula_scenes import Three, mie_force, morse_force
from chaincor import Scene, collide
from chaincor.workflows.errors import BarrierError, CrossingError
from chaincor.workflows.job import write_job
from tests.judge.kinks import judge

MORSE = {"energy": "D*(1-exp(-a*s))^2", "parameters": {"D": 1.0 / 72.0, "a": 6.0}}
LJ = {"energy": "(r^-12 - 2*r^-6 + 1)/72"}
MIE = {"energy": "4*eps*((sig/r)^12 - (sig/r)^6)", "parameters": {"eps": 0.02, "sig": 0.9}}


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["reference", "lammps"])
@pytest.mark.parametrize(("particles", "speed"), [(10, 0.1), (10, 2.0), (30, 0.5), (30, 1.0)])
def test_morse_chains_are_those_of_another_integrator(particles, speed, engine):
    scene = Scene(potential="morse", particles=particles, speed=speed, engine=engine)
    printed = Three(1.0 / 72.0, 6.0, 1.0)
    eta, error = judge(morse_force, printed, np.inf, particles, scene.impact_velocity)
    result = collide(scene, tolerance=1e-7)
    assert result.tolerance_met
    assert abs(result.restitution - eta) <= result.restitution_error + error


# The loops of a formula take half a minute to compile once.
@pytest.mark.slow
@pytest.mark.parametrize("engine", ["reference", "lammps"])
@pytest.mark.parametrize(("formula", "potential"), [(LJ, "lj"), (MORSE, "morse")])
def test_formulas_of_named_bonds_collide_as_these_do(formula, potential, engine):
    fields = {"particles": 12, "speed": 0.6, "engine": engine, "tolerance": 1e-8}
    named = collide(Scene(potential=potential, **fields))
    found = collide(Scene(potential="formula", **formula, **fields))
    assert found.contacts == named.contacts
    allowed = found.restitution_error + named.restitution_error
    assert allowed < 2e-8
    assert abs(found.restitution - named.restitution) <= allowed
    assert found.scene_sha256 != named.scene_sha256
    # Error bars could hide a wrong force, so that a tighter limit is also tested. LAMMPS has other
    # table rows and steps, and coordinates rounded to 12 eps/v0 = 3e-14.
    sharp = 1e-12 if engine == "reference" else 1e-9
    assert found.restitution == pytest.approx(named.restitution, abs=sharp)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_other_stiffness_and_natural_length(engine):
    scene = Scene(potential="formula", **MIE, particles=8, velocity=0.06, engine=engine)
    rest = 2.0 ** (1.0 / 6.0) * 0.9
    eta, error = judge(mie_force, Three(0.02, 0.9, rest), np.inf, 8, 0.06)
    result = collide(scene, tolerance=1e-7)
    assert abs(result.restitution - eta) <= result.restitution_error + error
    found = result.to_dict()
    assert found["natural_length"] == pytest.approx(rest, rel=1e-14)
    assert found["stiffness"] == pytest.approx(72.0 / 2 ** (1 / 3) * 0.02 / 0.81, rel=1e-13)
    assert found["parameters"] == MIE["parameters"]
    assert "eps" in found["energy"]
    # Lengths are in the units of the formula.
    assert found["bond_min"] < rest < found["bond_max"] < rest + 0.3


def test_what_a_result_says_of_a_bond_only_formulas_need():
    named = collide(Scene(potential="morse", particles=2, speed=0.2, engine="reference"))
    keys = {"energy", "parameters", "stiffness", "natural_length"}
    assert not keys & set(named.to_dict())


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_a_morse_chain_breaks_and_its_end_is_reported(engine):
    scene = Scene(potential="morse", particles=10, speed=2.0, engine=engine)
    result = collide(scene, tolerance=1e-6)
    assert result.fragments == 2
    assert result.ending in ("proved", "argued")


@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_morse_particles_that_would_meet_are_refused(engine):
    # U at zero length is (e^2 - 1)^2/8 = 5.1. Two particles at +-2.5 have a larger energy of 6.25.
    scene = Scene(potential="morse", morse_a=2.0, particles=2, velocity=2.5, engine=engine)
    with pytest.raises(CrossingError, match="morse bond cannot"):
        collide(scene, tolerance=1e-6)


@pytest.mark.slow
def test_a_formula_over_its_barrier_is_refused():
    scene = Scene(
        potential="formula", energy="s^2/2 - s^3", particles=20, velocity=0.9, engine="reference"
    )
    with pytest.raises(BarrierError, match="formula bond is stretched"):
        collide(scene, tolerance=1e-4)


def test_no_text_of_a_scene_reaches_a_script(tmp_path, monkeypatch):
    # The pilot run does not affect the texts.
    monkeypatch.setattr("chaincor.workflows.scripted.usual_pilot_run", lambda *_: None)
    energy = "0.5*(1+shell)*s^2 + run*s^4"
    scene = Scene(
        potential="formula",
        energy=energy,
        parameters={"shell": 0.25, "run": 1.0},
        particles=3,
        velocity=0.05,
        scheme="verlet",
        timestep=0.1,
    )
    write_job(scene, tmp_path / "job")
    texts = {path.name: path.read_text() for path in (tmp_path / "job").iterdir()}
    assert Scene.from_toml(texts.pop("scene.toml")) == scene
    assert not any("shell" in text for text in texts.values())
