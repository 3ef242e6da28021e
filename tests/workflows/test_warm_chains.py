"""Test warm chains in both engines, also with eta above 1."""

import json
import math

import numpy as np
import pytest

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.by_lammps import LammpsSearch
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.errors import CrossingError
from tests.judge.lines import judge_scene

SHARP = Numerics(scheme="order8", timestep=0.05)
WARM = [
    {"potential": "harmonic", "particles": 6, "velocity": 0.05, "temperature": 1e-3},
    {"potential": "lj", "particles": 8, "speed": 0.2, "temperature": 1e-3},
    {"potential": "toda", "particles": 5, "speed": 0.3, "temperature": 1e-2, "masses": [1, 2]},
    {"potential": "log", "particles": 4, "speed": 0.1, "temperature": 1e-2, "target_particles": 3},
    {"potential": "lj", "particles": 5, "speed": 0.3, "temperature": 1e-3, "contact": "power",
     "contact_exponent": 2.0, "target_particles": 4},
]  # fmt: skip


@pytest.mark.parametrize("fields", WARM, ids=lambda f: f["potential"])
@pytest.mark.slow_cases
def test_both_engines_and_the_judge_agree(fields):
    scene = Scene(**fields, seed=5)
    ours, theirs = stepping.run(scene.problem, SHARP), lammps.run(scene.problem, SHARP)
    judged = judge_scene(scene, 1e-9).seen
    assert len(ours.contact_times) == len(theirs.contact_times) == judged.contacts
    # The steps of order 8 are so short that their error is about (0.05/0.2)^8 times that at step
    # 0.2.
    assert ours.eta == pytest.approx(judged.restitution, rel=1e-8)
    assert theirs.eta == pytest.approx(judged.restitution, rel=1e-8)
    assert ours.energy_end == pytest.approx(ours.energy_start, rel=1e-9)
    assert theirs.displacements == pytest.approx(ours.displacements, abs=1e-8)
    assert theirs.target_displacements == pytest.approx(ours.target_displacements, abs=1e-8)


@pytest.mark.slow_cases
@pytest.mark.parametrize("potential", ["toda", "harmonic", "lj", "log"])
def test_the_number_tends_to_the_cold_one(potential):
    speed = {"velocity": 0.1} if potential == "harmonic" else {"speed": 0.4}
    scene = Scene(potential=potential, particles=10, engine="reference", tolerance=1e-10, **speed)
    cold = collide(scene).restitution
    off = []
    for temperature in (1e-8, 1e-12, 1e-16):
        # Differences are about v_thermal/v0 as long as the sequence of contacts does not change.
        thermal = math.sqrt(temperature) / scene.impact_velocity
        warm = [collide(scene.replace(temperature=temperature, seed=s)) for s in (1, 2)]
        off.append(max(abs(result.restitution - cold) for result in warm))
        assert off[-1] < 10.0 * thermal + 2e-10
    assert off[0] > 1e-7  # and yet eta differs


def test_a_warm_chain_may_come_back_faster_than_it_came(chaincor):
    arguments = "run --potential toda --particles 10 --velocity 0.01 --temperature 0.01 --seed 2"
    status, out, _ = chaincor(*arguments.split(), "--engine", "reference", "--json")
    found = json.loads(out)
    assert status == 0
    assert found["restitution"] > 1.0
    assert found["kinematic_restitution"] == pytest.approx(math.sqrt(found["restitution"]))
    assert found["restitution_error"] <= found["tolerance"]
    assert (found["temperature"], found["seed"]) == (0.01, 2)
    assert found["details"]["draw"]["generator"] == "PCG64"
    assert found["details"]["draw"]["gap"] > 0.0
    # The chain arrives with n v0^2/2 and heat, whose sum is conserved.
    before = 0.5 * 10 * 0.01**2
    assert found["translational_energy"] == pytest.approx(found["restitution"] * before)
    heat = Scene.from_toml(
        'potential = "toda"\nparticles = 10\nvelocity = 0.01\ntemperature = 0.01\nseed = 2'
    )
    assert found["translational_energy"] + found["vibrational_energy"] == pytest.approx(
        heat.line.energy(heat.bond, heat.line.strains, heat.line.velocities), rel=1e-9
    )


@pytest.mark.slow
def test_a_slow_chain_is_waited_for():
    # The first contact hardly changes the chain's velocity. The next contact comes after 168 time
    # units; the round trip of sound takes only 20.
    scene = Scene(potential="toda", particles=10, velocity=0.01, temperature=0.01, seed=2)
    steps = Numerics(scheme="order8", timestep=0.05)
    for outcome in (stepping.run(scene.problem, steps), lammps.run(scene.problem, steps)):
        assert len(outcome.contact_times) == 2
        # Errors of the steps and of the bond table grow during this time.
        assert outcome.contact_times[-1] == pytest.approx(168.5184, abs=0.1)
        assert outcome.ending.kind == "proved"


def test_steps_of_high_order_are_taken_where_flights_amplify_errors():
    # Verlet steps are usually the cheapest for 1e-3. Here, they cost twenty times as much as steps
    # of order 8.
    scene = Scene(potential="toda", particles=10, velocity=0.01, temperature=0.01, seed=2)
    assert LammpsSearch(scene.problem, 1e-3, 0.0).numerics.scheme in ("order6", "order8")
    cold = Scene(potential="toda", particles=10, velocity=0.01)
    assert LammpsSearch(cold.problem, 1e-3, 0.0).numerics.scheme == "verlet"


def test_lammps_refuses_what_it_cannot_place():
    # Harmonic bonds may have negative lengths, because the energy at length 0 is finite: 1 in 300
    # at T = 0.1.
    scene = Scene(potential="harmonic", particles=400, velocity=0.1, temperature=0.15)
    assert np.min(scene.line.strains[1:]) < -1.0
    assert collide(scene.replace(engine="reference", particles=60)).crossed
    with pytest.raises((SceneError, CrossingError), match="pass through each other"):
        collide(scene.replace(engine="lammps", particles=60))
