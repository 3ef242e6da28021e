"""Test the adaptive engine: agreement with stepping, extreme compression, errors."""

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines import end_watch
from chaincor.workflows.engines.reference import adaptive as stiff
from chaincor.workflows.engines.reference import modal, stepping
from chaincor.workflows.engines.reference.adaptive_loops import array_rates, looped_rates
from chaincor.workflows.errors import BarrierError, CrossingError, UnfinishedCollisionError
from tests.programs import python


def restitution(outcome, scene):
    return (outcome.velocities.mean() / scene.impact_velocity) ** 2


@pytest.mark.parametrize(
    "fields",
    [
        {"potential": "lj", "speed": 0.4},
        pytest.param({"potential": "log", "speed": 0.4}, marks=pytest.mark.slow),
        pytest.param({"potential": "toda", "speed": 0.4}, marks=pytest.mark.slow),
        pytest.param(
            {"potential": "power", "power_order": 4, "power_c": 1.0, "speed": 0.4},
            marks=pytest.mark.slow,
        ),
    ],
)
def test_agrees_with_stepping(fields):
    scene = Scene(particles=20, **fields)
    adaptive = stiff.run(scene.problem, 1e-12)
    stepped = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.02))
    v0 = scene.impact_velocity
    # The two methods share only the force. Each has a rounding error of 1e-13.
    assert restitution(adaptive, scene) == pytest.approx(restitution(stepped, scene), abs=2e-12)
    assert np.abs(adaptive.velocities - stepped.velocities).max() < 1e-11 * v0
    assert np.abs(adaptive.contact_times - stepped.contact_times).max() < 1e-10
    assert adaptive.bond_min == pytest.approx(stepped.bond_min, abs=1e-3)


@pytest.mark.slow
def test_agrees_with_modes_at_any_speed():
    for velocity in (1e-13, 0.1):
        scene = Scene(potential="harmonic", particles=20, velocity=velocity)
        adaptive, exact = stiff.run(scene.problem, 1e-12), modal.run(scene.problem)
        assert np.abs(adaptive.velocities - exact.velocities).max() < 1e-11 * velocity


@pytest.mark.parametrize(
    "fields",
    [
        pytest.param({"potential": "log", "speed": 5.0}, marks=pytest.mark.slow),
        pytest.param({"potential": "log", "speed": 10.0}, marks=pytest.mark.slow),
        {"potential": "lj", "speed": 30.0},
        {"potential": "lj", "speed": 1000.0},
        pytest.param({"potential": "toda", "toda_b": 100.0, "speed": 10.0}, marks=pytest.mark.slow),
    ],
)
def test_extremes_within_accuracy(fields):
    scene = Scene(particles=20, **fields)
    finest = stiff.run(scene.problem, 1e-11)
    coarse = stiff.run(scene.problem, 1e-8)
    assert restitution(coarse, scene) == pytest.approx(restitution(finest, scene), abs=1e-8)
    assert len(coarse.contact_times) == len(finest.contact_times) == 20
    # The energy after the last contact is an independent measure of the error.
    assert finest.energy_end == pytest.approx(finest.energy_start, rel=1e-10)
    if fields["potential"] == "log":
        # A single head-on pair would stop where U = v0^2, which is at r near exp(-1 - v0^2).
        stop = np.exp(-1.0 - scene.impact_velocity**2)
        assert 0.1 * stop < finest.bond_min < stop


@pytest.mark.parametrize("accuracy", [1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.slow_cases
def test_error_is_within_the_accuracy_asked(accuracy):
    scene = Scene(potential="lj", particles=50, speed=1.0)
    exact = restitution(stiff.run(scene.problem, 1e-13), scene)
    assert restitution(stiff.run(scene.problem, accuracy), scene) == pytest.approx(
        exact, abs=accuracy
    )


def test_frames():
    scene = Scene(particles=8, speed=2.0)
    bare, filmed = (
        stiff.run(scene.problem, 1e-9),
        stiff.run(scene.problem, 1e-9, frame_interval=0.01),
    )
    assert np.array_equal(bare.velocities, filmed.velocities)
    frames = filmed.frames
    assert frames is not None
    assert np.allclose(frames.times, 0.01 * np.arange(len(frames.times)), rtol=1e-14)
    assert frames.times[-1] + 0.02 > filmed.duration
    assert np.all(frames.displacements[:, 0] >= 0.0)
    # The last particle moves freely until sound arrives.
    assert frames.displacements[10, -1] == pytest.approx(-0.1 * scene.impact_velocity)


def test_single_particle():
    outcome = stiff.run(Scene(particles=1, speed=10.0).problem, 1e-8)
    assert len(outcome.contact_times) == 1
    assert outcome.scheme == stiff.SCHEME
    assert outcome.timestep is None


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"potential": "power", "power_order": 3, "power_c": -1.0, "speed": 1.0}, BarrierError),
        ({"potential": "toda", "toda_b": 1.0, "speed": 5.0}, CrossingError),
    ],
)
@pytest.mark.slow
def test_named_failures(fields, error):
    with pytest.raises(error):
        stiff.run(Scene(particles=20, **fields).problem, 1e-8)


def test_cap_on_the_length(monkeypatch):
    for module in (end_watch, stiff):
        monkeypatch.setattr(module, "longest_collision", lambda _n, _k, _last: 3.0)
    # Without this change, the engine would wait longer, because the whole chain still approaches
    # the wall.
    monkeypatch.setattr(end_watch, "CERTAIN_CROSSINGS", 0.0)
    with pytest.raises(UnfinishedCollisionError, match="3 after the first contact"):
        stiff.run(Scene(particles=20).problem, 1e-8)


def test_equations_of_motion_in_loops_and_arrays():
    rng = np.random.default_rng(3)
    state = rng.uniform(-0.1, 0.1, 14)
    bond = LennardJones()
    loops, arrays = np.empty(14), np.empty(14)
    looped_rates(lambda s, _: (float(bond.force(s)), 1.0))(state, loops, bond.parameters)
    array_rates(bond.force)(state, arrays, bond.parameters)
    assert np.allclose(loops, arrays, rtol=1e-14, atol=1e-16)
    # Only the wall changes the momentum.
    assert loops[7:].sum() == pytest.approx(0.0, abs=1e-15)


@pytest.mark.slow
def test_what_was_just_compiled_gives_the_bits_of_what_is_loaded(tmp_path):
    program = (
        "from chaincor import Scene, collide\n"
        "fields = dict(potential='log', particles=15, speed=4.294111380315183)\n"
        "result = collide(Scene(engine='reference', **fields), tolerance=1.37e-9)\n"
        "print(result.scheme, result.restitution.hex(), result.restitution_error.hex())"
    )
    said = [python(program, NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2)]
    assert said[0].startswith("adaptive8")
    assert said[0] == said[1]


def test_bond_that_cannot_be_compiled():
    named = Scene(potential="lj", particles=4, speed=0.4)
    bond = UserBond(named.bond.energy, named.bond.force)
    scene = Scene(potential=bond, particles=4, velocity=named.impact_velocity)
    assert restitution(stiff.run(scene.problem, 1e-9), scene) == pytest.approx(
        restitution(stiff.run(named.problem, 1e-9), named), abs=1e-9
    )
