"""Test exact collisions of two harmonic bodies against 50-digit arithmetic and known values."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference import modal, stepping
from tests.decimal_line import collide_in_decimals

# Rounding errors of a few 1e-16 in some ten modes and ten contacts, with a factor of ten as
# reserve.
SHARP = 1e-13


def harmonic(particles, velocity=0.1, **fields):
    return Scene(potential="harmonic", particles=particles, velocity=velocity, **fields)


def restitution(scene):
    """Return e, the ratio of relative speeds."""
    return math.sqrt(modal.run(scene.problem).eta)


def along_x(outcome, name):
    target = getattr(outcome, f"target_{name}")[::-1]
    return np.concatenate((target if len(target) else [0.0], getattr(outcome, name)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "fields",
    [
        {"particles": 3, "masses": [1, 2]},
        {"particles": 6, "masses": [1, 3]},
        {"particles": 4, "masses": [1e3, 1, 1e3]},
        {"particles": 4, "masses": [1, 1e-2], "compression": 0.05},
        {"particles": 4, "target_particles": 3},
        {"particles": 5, "masses": [2, 1, 0.5], "target_particles": 4, "target_masses": [3, 1]},
        {"particles": 1, "masses": [2.5], "target_particles": 5},
        {"particles": 5, "target_particles": 1, "target_masses": [7.0]},
        {"particles": 4, "masses": [1e-2, 1], "target_particles": 2},
    ],
)
def test_fifty_digits(fields):
    scene = harmonic(**fields)
    line, outcome = scene.line, modal.run(scene.problem)
    sharp = collide_in_decimals(
        line.masses, line.first, line.strains, line.velocities, outcome.duration
    )
    v0 = scene.impact_velocity
    assert outcome.ending.kind == "proved"
    assert len(outcome.contact_times) == len(sharp.contact_times)
    assert outcome.separation_velocity == pytest.approx(sharp.separation_rate, abs=SHARP * v0)
    # A light particle between two heavy particles amplifies errors 1e2 times more.
    many = 1e2 * SHARP
    assert outcome.contact_times == pytest.approx(sharp.contact_times, abs=many)
    assert outcome.contact_speeds == pytest.approx(sharp.contact_speeds, abs=many * v0)
    assert along_x(outcome, "velocities") == pytest.approx(sharp.velocities, abs=many * v0)
    assert along_x(outcome, "displacements") == pytest.approx(sharp.displacements, abs=many * v0)


def test_initial_state_of_any_kind(tmp_path):
    state = tmp_path / "state.csv"
    rows = [(0.3, -0.1, 2.0), (0.02, -0.15, 1.0), (-0.05, -0.02, 0.5), (0.01, -0.2, 1.5)]
    lines = ["strain,velocity,mass", *(",".join(map(repr, row)) for row in rows)]
    state.write_text("\n".join(lines))
    scene = Scene(potential="harmonic", particles=4, initial=state, target_particles=2)
    line, outcome = scene.line, modal.run(scene.problem)
    sharp = collide_in_decimals(
        line.masses, line.first, line.strains, line.velocities, outcome.duration + 10.0
    )
    assert outcome.contact_times == pytest.approx(sharp.contact_times, abs=SHARP)
    assert along_x(outcome, "velocities") == pytest.approx(sharp.velocities, abs=SHARP)
    assert along_x(outcome, "displacements") == pytest.approx(sharp.displacements, abs=SHARP)
    assert outcome.energy_end == pytest.approx(outcome.energy_start, rel=SHARP)


@pytest.mark.parametrize(
    "fields",
    [
        {"particles": 6},
        {"particles": 4, "masses": [1, 3], "target_particles": 5},
        {"particles": 1, "target_particles": 3, "target_masses": [2, 1]},
    ],
)
def test_warm_bodies_in_fifty_digits(fields):
    scene = harmonic(**fields, temperature=4e-3, seed=3)
    line, outcome = scene.line, modal.run(scene.problem)
    # The flight before the first contact takes less than 40, and the states are compared after the
    # last contact.
    sharp = collide_in_decimals(
        line.masses, line.first, line.strains, line.velocities, outcome.duration + 40.0
    )
    assert outcome.ending.kind == "proved"
    assert outcome.separation_velocity == pytest.approx(sharp.separation_rate, abs=SHARP)
    assert outcome.contact_times == pytest.approx(sharp.contact_times, abs=10.0 * SHARP)
    assert outcome.contact_speeds == pytest.approx(sharp.contact_speeds, abs=SHARP)
    assert along_x(outcome, "velocities") == pytest.approx(sharp.velocities, abs=10.0 * SHARP)
    assert along_x(outcome, "displacements") == pytest.approx(sharp.displacements, abs=10.0 * SHARP)
    # Stepping gives the same velocities, and the same positions of both bodies.
    stepped = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.05))
    for name in ("velocities", "displacements"):
        assert along_x(stepped, name) == pytest.approx(along_x(outcome, name), abs=1e-9)


def test_two_masses_lose_most_at_their_published_ratio():
    def of_ratio(ratio):
        return restitution(harmonic(2, masses=[ratio, 1.0]))

    found = minimize_scalar(of_ratio, bounds=(1.2, 1.6), method="bounded", options={"xatol": 1e-7})
    assert found.x == pytest.approx(1.43447, abs=5e-6)
    assert found.fun == pytest.approx(0.178465, abs=1e-6)


@pytest.mark.parametrize("particles", [1, 2, 20, 50])
def test_identical_chains_are_one_before_a_wall(particles):
    scene = harmonic(particles, target_particles=particles)
    alone = modal.run(harmonic(particles).problem)
    outcome = modal.run(scene.problem)
    e = alone.velocities.mean() / 0.1
    assert restitution(scene) == pytest.approx(e, abs=SHARP)
    if particles == 50:
        assert e == pytest.approx(0.96581, abs=5e-6)
    # In the frame of the centre of mass, each body arrives at half the speed. A root of a sum over
    # n modes has an error of n units in the last place of its time, which contacts amplify up to
    # ten times.
    rounding = 10.0 * particles * np.finfo(float).eps * alone.contact_times[-1]
    assert outcome.contact_times == pytest.approx(alone.contact_times, abs=max(rounding, 1e-12))
    assert outcome.contact_speeds == pytest.approx(alone.contact_speeds, abs=1e-12)


@pytest.mark.parametrize(("particles", "e"), [(10, 0.50721), (50, 0.50299), (200, 0.50182)])
def test_rods_of_two_lengths_tend_to_saint_venants_half(particles, e):
    scene = harmonic(particles, target_particles=2 * particles)
    assert restitution(scene) == pytest.approx(e, abs=5e-6)


def test_heavy_target_is_the_wall():
    wall = restitution(harmonic(20, masses=[1, 2]))
    heavy = harmonic(20, masses=[1, 2], target_particles=1, target_masses=[1e9])
    # The heavy target moves in proportion to the ratio of masses, 3e-8, which shifts the contacts.
    assert restitution(heavy) == pytest.approx(wall, abs=1e-6)
    heavier = harmonic(20, masses=[1, 2], target_particles=1, target_masses=[1e11])
    assert restitution(heavier) == pytest.approx(wall, abs=1e-8)


def test_bodies_may_be_exchanged():
    one = {"particles": 7, "masses": [1, 2, 5]}
    other = {"particles": 4, "masses": [3, 1]}
    forth = harmonic(**one, target_particles=4, target_masses=[3, 1])
    back = harmonic(**other, target_particles=7, target_masses=[1, 2, 5])
    assert restitution(forth) == pytest.approx(restitution(back), abs=SHARP)
    there, here = modal.run(forth.problem), modal.run(back.problem)
    assert there.contact_times == pytest.approx(here.contact_times, abs=SHARP)
    # The rest frame of the other body moves with the impact velocity.
    assert there.velocities == pytest.approx(-0.1 - here.target_velocities, abs=SHARP)


@pytest.mark.parametrize("factor", [1e-6, 3.7, 1e6])
def test_common_factor_of_masses_is_a_unit_of_time(factor):
    masses, target = np.array([1.0, 4.0, 2.0]), np.array([2.0, 1.0])
    plain = harmonic(6, masses=masses, target_particles=3, target_masses=target)
    scaled = harmonic(
        6,
        velocity=0.1 / factor**0.5,
        masses=factor * masses,
        target_particles=3,
        target_masses=factor * target,
    )
    assert restitution(scaled) == pytest.approx(restitution(plain), abs=SHARP)
    there, here = modal.run(scaled.problem), modal.run(plain.problem)
    assert there.contact_times / factor**0.5 == pytest.approx(here.contact_times, rel=SHARP)
    assert there.displacements == pytest.approx(here.displacements, abs=SHARP)
    assert there.energy_start == pytest.approx(here.energy_start, rel=SHARP)


@pytest.mark.parametrize("heavy", [1e-6, 1e6])
@pytest.mark.parametrize("place", [1, 3])
def test_balance_over_extreme_masses(heavy, place):
    masses = np.ones(6)
    masses[place] = heavy
    scene = harmonic(6, masses=masses, target_particles=4, target_masses=[heavy, 1])
    if heavy < 1.0:  # a light particle in contact with the other body would hit it 1e4 times
        scene = harmonic(6, masses=masses, target_particles=4, target_masses=[1, heavy])
    outcome, line = modal.run(scene.problem), scene.line
    momentum = line.chain_masses @ outcome.velocities
    momentum += line.target_masses @ outcome.target_velocities
    arriving = 0.1 * masses.sum()
    # Rounding of the momentum is relative to that of all particles at the speed of their energy.
    size = math.sqrt(2.0 * outcome.energy_start * (masses.sum() + line.target_masses.sum()))
    assert momentum == pytest.approx(-arriving, abs=SHARP * size)
    assert outcome.energy_end == pytest.approx(outcome.energy_start, rel=SHARP)
    given = outcome.impulses.sum()
    assert line.target_masses @ outcome.target_velocities == pytest.approx(-given, abs=SHARP * size)
    assert outcome.ending.kind == "proved"


def test_agrees_with_stepping_over_many_particles():
    masses = np.random.default_rng(1).uniform(0.5, 2.0, 30)
    scene = harmonic(30, masses=masses, target_particles=12, compression=0.01)
    exact = modal.run(scene.problem, frame_interval=0.5)
    stepped = stepping.run(
        scene.problem, Numerics(scheme="order8", timestep=0.025), frame_interval=0.5
    )
    # At half the usual step, order 8 has an error below 1e-12, which contacts amplify.
    assert exact.eta == pytest.approx(stepped.eta, abs=1e-11)
    for name in ("contact_times", "contact_speeds", "impulses", "velocities", "displacements"):
        assert getattr(exact, name) == pytest.approx(getattr(stepped, name), abs=1e-10)
    for name in ("target_velocities", "target_displacements"):
        assert getattr(exact, name) == pytest.approx(getattr(stepped, name), abs=1e-10)
    for name in ("energy_start", "energy_end"):
        assert getattr(exact, name) == pytest.approx(getattr(stepped, name), rel=1e-11)
    assert exact.bond_min == pytest.approx(stepped.bond_min, abs=5e-3)
    assert exact.bond_max == pytest.approx(stepped.bond_max, abs=5e-3)
    shared = min(len(exact.frames.times), len(stepped.frames.times))
    assert shared > 20
    for name in ("displacements", "velocities", "target_displacements", "target_velocities"):
        here, there = getattr(exact.frames, name), getattr(stepped.frames, name)
        assert here[:shared] == pytest.approx(there[:shared], abs=1e-10)


@pytest.mark.parametrize("velocity", [1e-100, 2.0, 1e100])
def test_restitution_does_not_depend_on_speed(velocity):
    fields = {"masses": [1, 2], "target_particles": 3}
    outcome = modal.run(harmonic(8, velocity, **fields).problem)
    e = outcome.separation_velocity / velocity
    assert e == pytest.approx(restitution(harmonic(8, **fields)), abs=SHARP)
    assert outcome.crossed == (outcome.bond_min < 0.0) == (velocity > 1.0)


@pytest.mark.slow
def test_the_sensitivity_tells_what_roundings_make():
    # A few contacts do not amplify rounding, but the 1e5 contacts of a light particle do.
    calm = harmonic(6, masses=[1, 3])
    assert 0.0 < modal.rounding_sensitivity(calm.problem) < SHARP
    light = harmonic(3, masses=[1e-6, 1, 1e-6])
    grown = modal.rounding_sensitivity(light.problem)
    assert 10.0 * modal.rounding_sensitivity(calm.problem) < grown < 1e-9


def test_reference_values():
    path = Path(__file__).parents[3] / "reference_general.json"
    cases = [c for c in json.loads(path.read_text())["cases"] if c["potential"] == "harmonic"]
    assert len(cases) == 3
    for case in cases:
        fields = {"masses": case["masses"]}
        if case["target_particles"]:
            fields |= {k: case[k] for k in ("target_particles", "target_masses")}
        scene = harmonic(case["particles"], case["velocity"], **fields)
        outcome = modal.run(scene.problem)
        # The file states an error of 1e-9.
        assert outcome.eta == pytest.approx(case["restitution"], abs=1e-9)
        assert len(outcome.contact_times) == case["contacts"]
        assert outcome.contact_times[-1] == pytest.approx(case["last_contact_time"], abs=1e-9)


def test_refuses_what_is_no_collision_of_hard_particles(tmp_path):
    state = tmp_path / "state.csv"
    state.write_text("strain,velocity\n0.0,0.0\n0.0,-0.1\n")
    with pytest.raises(SceneError, match="presses it"):
        modal.run(Scene(potential="harmonic", particles=2, initial=state).problem)
    with pytest.raises(SceneError, match="hard contacts"):
        modal.run(harmonic(3, contact="power").problem)


def test_particle_at_rest_that_is_pulled_away_is_hit_later(tmp_path):
    state = tmp_path / "state.csv"
    # The bond first pulls particle 1 off the wall; the other particles bring it back.
    state.write_text("strain,velocity\n0.0,0.0\n0.05,-0.01\n0.0,-0.1\n")
    scene = Scene(potential="harmonic", particles=3, initial=state)
    outcome, line = modal.run(scene.problem), scene.line
    sharp = collide_in_decimals(
        line.masses, line.first, line.strains, line.velocities, outcome.duration + 10.0
    )
    assert outcome.contact_speeds == pytest.approx(sharp.contact_speeds, abs=SHARP)
    assert outcome.contact_times == pytest.approx(sharp.contact_times, abs=SHARP)
