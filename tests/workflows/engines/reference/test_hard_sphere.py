"""Test the hard-sphere limit against event-driven spheres and against chains with bonds."""

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference import adaptive, hard_sphere
from chaincor.workflows.errors import CrossingError, TimestepError


def simulate_spheres(particles, diameter, speed):
    """Simulate spheres by events in the simplest way; return final states and contact times."""
    x = np.arange(particles, dtype=float)
    v = np.full(particles, -speed)
    now, contacts, exchanges = 0.0, [0.0], 0
    v[0] = speed
    while True:
        waits = np.full(particles, np.inf)
        if v[0] < 0:
            waits[0] = -x[0] / v[0]
        closing = v[:-1] - v[1:]
        gaps = np.diff(x) - diameter
        meeting = closing > 1e-12 * speed
        waits[1:][meeting] = gaps[meeting] / closing[meeting]
        event = int(np.argmin(waits))
        if np.isinf(waits[event]):
            return x, v, np.array(contacts), exchanges, now
        x, now = x + v * waits[event], now + waits[event]
        if event == 0:
            contacts.append(now)
            v[0] = -v[0]
        else:
            v[event - 1], v[event] = v[event], v[event - 1]
            exchanges += 1


@pytest.mark.parametrize("particles", [2, 3, 7, 20])
def test_closed_form_is_what_events_give(particles):
    scene = Scene(potential="lj", particles=particles, speed=30.0)
    outcome = hard_sphere.run(scene.problem)
    diameter = outcome.bond_min
    _, v, times, exchanges, _ = simulate_spheres(particles, diameter, scene.impact_velocity)
    assert exchanges == particles * (particles - 1) // 2
    assert np.allclose(outcome.velocities, v, rtol=1e-12)
    assert np.allclose(outcome.contact_times, times, rtol=1e-10, atol=1e-12)
    assert np.all(outcome.displacements == 0.0)


def test_diameter_stops_two_particles():
    scene = Scene(potential="lj", particles=2, speed=30.0)
    diameter = hard_sphere.run(scene.problem).bond_min
    assert float(scene.bond.energy(diameter - 1.0)) == pytest.approx(scene.impact_velocity**2)
    # The particles stop at this distance, which is also the shortest bond in the motion.
    moving = adaptive.run(scene.problem, 1e-10)
    assert moving.bond_min == pytest.approx(diameter, rel=1e-3)


def test_log_bond_shrinks_to_nothing():
    outcome = hard_sphere.run(Scene(potential="log", particles=5, speed=10.0).problem)
    assert outcome.bond_min == 0.0
    assert not np.isnan(outcome.contact_times).any()


def test_soft_bond_cannot_be_a_sphere():
    with pytest.raises(CrossingError, match="cannot stop"):
        hard_sphere.run(Scene(potential="harmonic", particles=5, velocity=3.0).problem)


@pytest.mark.slow_cases
@pytest.mark.parametrize(
    "fields",
    [
        {"potential": "lj", "speed": 8.0},
        {"potential": "lj", "speed": 100.0},
        {"potential": "toda", "toda_b": 100.0, "speed": 30.0},
        {"potential": "log", "speed": 3.0},
    ],
)
@pytest.mark.parametrize("particles", [4, 10, 30])
def test_deviation_bounds_what_the_bonds_lose(fields, particles):
    scene = Scene(particles=particles, **fields)
    outcome = adaptive.run(scene.problem, 1e-11)
    lost = 1.0 - (outcome.velocities.mean() / scene.impact_velocity) ** 2
    bound = hard_sphere.deviation(scene.problem)
    assert 0.0 < lost <= bound
    assert bound < 40.0 * lost  # the bound is not too wide


def test_limit_is_approached_as_a_power_of_the_speed():
    # With three spheres in contact, the loss falls faster than v^-3, and the power grows with the
    # speed.
    losses = []
    for speed in (8.0, 16.0, 32.0, 64.0):
        scene = Scene(potential="lj", particles=20, speed=speed)
        outcome = adaptive.run(scene.problem, 1e-10)
        losses.append(1.0 - (outcome.velocities.mean() / scene.impact_velocity) ** 2)
        assert len(outcome.contact_times) == 20
    powers = -np.diff(np.log2(losses))
    assert np.all(np.diff(powers) > 0.0)
    assert 3.3 < powers[0] < powers[-1] < 4.7


@pytest.mark.parametrize("speed", [1e7, 1e13, 1e20])
def test_deviation_far_beyond_where_bonds_are_followed(speed):
    # Steps through the contact of three particles would take more than an hour at these speeds.
    deviation = hard_sphere.deviation(Scene(particles=4, speed=speed, engine="reference").problem)
    assert 0.0 < deviation < 1e-20


def test_a_triple_that_no_step_resolves_is_a_named_failure(monkeypatch):
    tried = []

    def unresolved(scene, _accuracy):
        tried.append(scene.impact_velocity)
        raise TimestepError("no step resolves it")

    monkeypatch.setattr(adaptive, "run", unresolved)
    with pytest.raises(TimestepError, match="three particles with lj bonds"):
        hard_sphere.deviation(Scene(potential="lj", particles=20, speed=100.0).problem)
    assert len(tried) < 100
