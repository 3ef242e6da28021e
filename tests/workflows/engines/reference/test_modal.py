"""Test the modal propagator against stepping, high precision and known values."""

import math

import numpy as np
import pytest

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.contact_search import first_root
from chaincor.workflows.engines.reference import modal, stepping
from chaincor.workflows.engines.reference.mode_loops import TERMS, expand_path


def harmonic(particles, velocity=0.1):
    return Scene(potential="harmonic", particles=particles, velocity=velocity)


def restitution(outcome, scene):
    return (outcome.velocities.mean() / scene.impact_velocity) ** 2


@pytest.mark.parametrize("particles", [2, 3, 10, 19, 20, 100])
def test_agrees_with_stepping_to_rounding(particles):
    scene = harmonic(particles)
    exact = modal.run(scene.problem)
    stepped = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.05))
    # At step 0.05, the error of order 8 is below 1e-14 per unit of time: 4^-8 of the 1e-10 at step
    # 0.2. Rounding grows at most linearly to 2e-12 v0 within the 200 time units.
    v0 = scene.impact_velocity
    assert np.abs(exact.velocities - stepped.velocities).max() < 2e-12 * v0
    assert np.abs(exact.displacements - stepped.displacements).max() < 1e-11 * v0
    assert np.abs(exact.contact_times - stepped.contact_times).max() < 2e-11
    assert np.abs(exact.contact_speeds - stepped.contact_speeds).max() < 2e-12 * v0
    assert exact.bond_min == pytest.approx(stepped.bond_min, abs=0.03 * v0)
    assert exact.bond_max == pytest.approx(stepped.bond_max, abs=0.03 * v0)


def test_pair_in_closed_form():
    # The relative motion has omega = sqrt(2), and the second contact comes after half its period.
    outcome = modal.run(harmonic(2).problem)
    assert outcome.contact_times[1] == pytest.approx(math.pi / math.sqrt(2.0), rel=1e-14)
    assert outcome.velocities == pytest.approx([0.1, 0.1], rel=1e-14)


def test_five_hundred_particles():
    # A careful integration gave these values with all known digits.
    outcome = modal.run(harmonic(500).problem)
    intervals = np.diff(outcome.contact_times)
    assert len(outcome.contact_times) / 500 == pytest.approx(0.870, abs=5e-4)
    assert intervals.mean() == pytest.approx(2.3044, abs=5e-5)
    assert np.median(intervals) == pytest.approx(2.2995, abs=5e-5)
    assert outcome.contact_speeds.mean() / 0.1 == pytest.approx(1.146, abs=5e-4)


@pytest.mark.parametrize("velocity", [1e-140, 1e-13, 0.8, 1e100])
def test_restitution_does_not_depend_on_speed(velocity):
    scene = harmonic(20, velocity)
    outcome = modal.run(scene.problem)
    assert restitution(outcome, scene) == pytest.approx(0.8685036072402, abs=1e-12)
    # Particles cross at a strain of -1. Before the second contact, the largest compression is
    # 1.4366 v0.
    assert outcome.crossed == (1.4366 * velocity >= 1.0)


def test_energy_and_momentum_balance():
    scene = harmonic(300)
    outcome = modal.run(scene.problem)
    # Rounding errors of a few 1e-16 occur in 300 modes and 261 contacts.
    assert outcome.energy_end == pytest.approx(outcome.energy_start, rel=1e-12)
    gained = outcome.velocities.sum() + 300 * scene.impact_velocity
    assert outcome.impulses.sum() == pytest.approx(gained, rel=1e-12)


def test_frames_are_states_of_the_motion():
    scene = harmonic(20)
    exact = modal.run(scene.problem, frame_interval=0.37)
    stepped = stepping.run(
        scene.problem, Numerics(scheme="order8", timestep=0.05), frame_interval=0.37
    )
    assert exact.frames is not None
    assert stepped.frames is not None
    shared = min(len(exact.frames.times), len(stepped.frames.times))
    assert shared > 100
    for name in ("times", "displacements", "velocities"):
        difference = getattr(exact.frames, name)[:shared] - getattr(stepped.frames, name)[:shared]
        assert np.abs(difference).max() < 1e-12


def test_single_particle():
    outcome = modal.run(harmonic(1).problem)
    assert outcome.velocities.tolist() == [0.1]
    assert outcome.scheme == "modal"


def test_refuses_other_bonds():
    with pytest.raises(SceneError, match="harmonic bonds"):
        modal.run(Scene(potential="lj").problem)


def test_path_expansion_is_the_sum_of_sines():
    rng = np.random.default_rng(1)
    n = 50
    omega = 2.0 * np.sin(0.5 * np.pi * np.arange(n) / n)
    e, p, c = rng.normal(size=(3, n))
    path = np.empty(TERMS)
    expand_path((e, p, omega, c), 0.0, path, np.empty((2, n)))
    time = 0.9
    moved = np.divide(
        e * (np.cos(omega * time) - 1.0) + p * np.sin(omega * time),
        omega,
        out=p * time,
        where=omega > 0,
    )
    # The remainder after TERMS terms is below 2^25 0.9^26/26! = 5e-21 per mode, so that only
    # rounding remains.
    assert np.polyval(path[::-1], time) == pytest.approx(float(c @ moved), abs=1e-13)


@pytest.mark.parametrize(
    ("roots", "end", "expected"),
    [
        ((0.3, 0.7), 1.0, 0.3),
        ((0.5, 0.5000001), 1.0, 0.5),
        ((1.5,), 1.0, -1.0),
        ((0.0, -0.4, 0.6), 1.0, 0.6),
        ((-0.5, -0.2), 1.0, -1.0),
    ],
)
def test_first_root_is_never_passed(roots, end, expected):
    coefficients = np.polynomial.polynomial.polyfromroots(roots)
    sign = coefficients[0] if coefficients[0] != 0 else coefficients[1]
    coefficients = coefficients * np.sign(sign)
    # The error of a nearly double root is the rounding error divided by the distance between the
    # two roots.
    assert first_root(coefficients, end) == pytest.approx(expected, abs=1e-9)
