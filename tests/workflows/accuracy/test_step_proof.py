"""Test which error of a step three runs prove, and when they prove nothing."""

import math

import numpy as np
import pytest

from chaincor import Scene, collide
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.workflows.accuracy.fixed_steps import refine_regularly
from chaincor.workflows.accuracy.irregular import refine_irregularly
from chaincor.workflows.accuracy.step_proof import COARSER, proved_error, runs_differ
from chaincor.workflows.engines.reference import stepping


@pytest.mark.parametrize("order", [3.0, 6.0, 8.0])
def test_an_error_that_falls_is_bounded_by_the_near_run(order):
    # differences of coarser runs if the error at the step is 1
    far, near = (k**order - 1.0 for k in COARSER)
    error, falls = proved_error("order8", 20.0, far, near, 0.0, True)
    assert falls
    assert error >= 1.0


def test_an_error_that_falls_slowly_is_the_larger_difference():
    error, falls = proved_error("order8", 20.0, 3.0, 0.69, 0.0, True)  # differences of order 2
    assert not falls
    assert error == 3.0


def test_runs_that_are_one_part_of_a_step_tell_nothing():
    steps = np.array([0.0, 1e-3, 0.5, 2.0, 2.1])
    assert runs_differ(8.0, steps).tolist() == [True, True, False, False, True]
    errors, falls = proved_error("order8", steps, np.zeros(5), np.zeros(5), 0.0, True)
    assert errors.tolist() == [0.0, 0.0, math.inf, math.inf, 0.0]
    assert falls.tolist() == [True, True, False, False, True]


@pytest.mark.parametrize("seed", range(6))
def test_a_collision_within_the_first_step_has_an_honest_bar(seed):
    # The only contact is with a particle that then moves away. eta depends on the flight up to this
    # contact, which lasts 0.05 to 0.3. The flight is a single shortened step in all runs.
    scene = Scene(
        potential="toda",
        particles=5,
        target_particles=1,
        temperature=1e-7,
        seed=seed,
        velocity=0.008,
        engine="reference",
    )
    found = collide(scene, tolerance=1e-4)
    fine = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.005))
    speed = scene.line.separation(np.concatenate((fine.target_velocities, fine.velocities)))
    # The error of 60 steps of order 8 is rounding.
    assert abs(found.restitution - (speed / scene.impact_velocity) ** 2) <= found.restitution_error
    assert found.restitution_error <= 1e-4


@pytest.mark.parametrize("gap", [0.06, 0.006])
@pytest.mark.parametrize("refine", ["regularly", "irregularly"])
def test_a_collision_that_is_a_small_part_of_a_step_is_resolved(gap, refine, tmp_path):
    # The collision lasts a fourth to a hundredth of the first step. Halving such steps would seem
    # useless long before the steps resolve the collision.
    start = tmp_path / "start.csv"
    start.write_text(f"strain,velocity\n{gap},-0.5\n0.2,-0.3\n0.05,-0.1\n")
    scene = Scene(
        potential="toda", particles=3, target_particles=1, initial=start, engine="reference"
    )
    if refine == "regularly":
        found = refine_regularly(scene.problem, 1e-3, "srkn14", 1e-13, None)
    else:
        found = refine_irregularly(scene.problem, 1e-3, 1e-13)
    assert len(found.outcome.contact_times) == 1
    fine = stepping.run(scene.problem, Numerics(scheme="order8", timestep=gap / 60.0))
    # The error of 120 steps of order 8 is rounding.
    assert abs(found.outcome.eta - fine.eta) <= found.error + 1e-13
    assert found.outcome.lasted > COARSER[0] * found.outcome.timestep


@pytest.mark.parametrize(
    ("potential", "particles", "velocity", "tolerance", "right"),
    [
        ("lj", 3, 0.0258, 1e-6, 0.9091844309),
        ("log", 5, 0.7443540764199199, 1e-8, 0.8673496569268),
        ("log", 7, 0.5218877949662942, 1e-6, 0.7514084313),
        ("log", 19, 0.6182128823801389, 1e-6, 0.7140339098),
        ("log", 2, 0.8557686768304469 * 0.967042944497, 1e-4, None),
        ("lj", 42, 1.329 * 0.128489059895, 1e-5, 0.7638470386757),
        ("lj", 29, 1.4794 * 0.128489059895, 1e-5, 0.8082737940301),
    ],
)
def test_runs_that_agree_by_chance_do_not_make_the_bar_small(
    potential, particles, velocity, tolerance, right
):
    # The right values come from runs with tolerances 1000 times smaller, printed with at least ten
    # digits.
    scene = Scene(
        potential=potential,
        particles=particles,
        velocity=velocity,
        engine="reference",
        tolerance=tolerance,
    )
    found = collide(scene)
    if right is None:
        right = collide(scene, tolerance=1e-3 * tolerance).restitution
    assert abs(found.restitution - right) <= found.restitution_error + 1e-10
    assert found.restitution_error <= tolerance
