"""Test properties that hold for every chain at every bond, speed and length."""

import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.sweep_file import read_sweep
from chaincor.workflows.collision import collide

ETA_TOLERANCE = 1e-7


@st.composite
def scenes(draw, **fixed):
    """Draw chains of named bonds that are too slow to break bonds or to exchange particles."""
    bond = draw(st.sampled_from(("harmonic", "lj", "toda", "log", "power")))
    fields = {"potential": bond, "particles": draw(st.integers(1, 40)), "engine": "reference"}
    if bond == "toda":
        fields["toda_b"] = draw(st.floats(5.0, 30.0))
    if bond == "power":
        fields["power_order"] = draw(st.sampled_from((4, 6, 8)))
        fields["power_c"] = draw(st.floats(1.0, 100.0))
    if bond == "harmonic":
        fields["velocity"] = draw(st.floats(1e-6, 0.6))
    else:
        fields["speed"] = draw(st.floats(1e-4, 0.5))
    return Scene(**fields | fixed)


@pytest.mark.slow
@settings(max_examples=400)
@given(scene=scenes())
def test_balances_and_bounds(scene):
    result = collide(scene, tolerance=ETA_TOLERANCE)
    bar, n = result.restitution_error, scene.particles
    assert result.tolerance_met
    assert 0.0 <= result.restitution <= 1.0 + bar
    # The wall gives twice the incoming speeds as momentum, up to rounding. Each step rounds by
    # about 1e-16, and a collision takes a few thousand steps.
    assert result.momentum_residual < 1e-12
    # eta is a fraction of the energy and comes from the same velocities. The error of the energy
    # therefore cannot be much larger than that of eta. A factor of a hundred allows for errors that
    # the mean in eta averages out.
    assert abs(result.energy_drift) < 100.0 * ETA_TOLERANCE
    # The contact at t = 0 is included. The incoming speeds sum to n v0 (1 + e)/2 <= n v0. They are
    # v0 or more on average, because stretched bonds only pull particle 1 towards the wall. There
    # are therefore at most n contacts; hard spheres have n.
    assert 1 <= result.contacts <= n
    gained = 0.5 * n * scene.impact_velocity * (1.0 + result.kinematic_restitution)
    assert result.contact_speeds.sum() == pytest.approx(gained, rel=1e-10)
    # The translation is mode 0, and no mode has a negative energy.
    translation = 0.5 * n * scene.impact_velocity**2 * result.restitution
    assert result.mode_energies[0] == pytest.approx(translation, rel=1e-9)
    assert np.all(result.mode_energies >= 0.0)


@settings(max_examples=150)
@given(scene=scenes())
@pytest.mark.slow
def test_a_refined_result_lies_within_the_coarser_bar(scene):
    coarse, fine = (collide(scene, tolerance=tolerance) for tolerance in (1e-4, 1e-8))
    apart = abs(coarse.restitution - fine.restitution)
    assert apart <= coarse.restitution_error + fine.restitution_error
    assert coarse.contacts == fine.contacts


@settings(max_examples=150)
@given(
    order=st.sampled_from((3, 4, 5, 6)),
    c=st.floats(1.0, 100.0),
    factor=st.floats(1.0, 100.0),
    particles=st.integers(2, 25),
    speed=st.floats(0.01, 0.4),
)
@pytest.mark.slow
def test_power_bonds_know_no_other_scale_than_their_own(order, c, factor, particles, speed):
    # u -> k u with c -> c k^(2 - order) leaves the equations of motion unchanged, and v*, the only
    # speed, scales with u. At a speed in units of v*, eta therefore does not depend on c.
    sign = -1.0 if order % 2 else 1.0
    if order % 2:  # Bonds of these chains are stretched over their barrier from about 0.2 v* on.
        speed *= 0.25
    base = {"potential": "power", "power_order": order, "engine": "reference"}
    base |= {"particles": particles, "speed": speed}
    first, second = (
        collide(Scene(**base, power_c=sign * value), tolerance=ETA_TOLERANCE)
        for value in (c, c * factor)
    )
    bars = first.restitution_error + second.restitution_error
    assert abs(first.restitution - second.restitution) <= bars
    ratio = factor ** (-1.0 / (order - 2))
    assert Power(order, sign * c * factor).natural_speed == pytest.approx(
        ratio * Power(order, sign * c).natural_speed,
        rel=1.1e-12,  # both are rounded to 5e-13
    )


@pytest.mark.slow
@settings(max_examples=150)
@given(particles=st.integers(1, 200), velocity=st.floats(1e-9, 0.6), factor=st.floats(0.1, 1.0))
def test_springs_know_no_speed(particles, velocity, factor):
    scene = Scene(potential="harmonic", particles=particles, velocity=velocity, engine="reference")
    first, second = collide(scene), collide(scene.replace(velocity=factor * velocity))
    # Modes are exact to rounding errors, which add up in some hundred contacts.
    assert first.restitution == pytest.approx(second.restitution, abs=1e-11)
    assert first.contacts == second.contacts


@settings(max_examples=60)
@given(scene=scenes(), tolerance=st.floats(1e-12, 1e-2))
def test_a_scene_written_as_toml_is_read_as_it_was(scene, tolerance):
    scene = scene.replace(tolerance=tolerance)
    again = Scene.model_validate(tomllib.loads(scene.to_toml()))
    assert again == scene
    assert again.sha256 == scene.sha256


@settings(max_examples=30)
@given(values=st.lists(st.floats(1e-6, 0.6), min_size=1, max_size=5, unique=True))
def test_a_sweep_asks_for_the_numbers_of_its_file(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("sweep") / "sweep.toml"
    path.write_text(
        f'[scene]\npotential = "harmonic"\n[axes]\nvelocity = {[float(v) for v in values]}\n'
    )
    assert [scene.velocity for scene in read_sweep(path).scenes] == values
