"""Test the stepping engine: known values, orders, reversal, rounding, named failures."""

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import COMPOSITIONS, SCHEMES
from chaincor.workflows.collision import collide
from chaincor.workflows.engines import end_watch
from chaincor.workflows.engines.contact_search import narrow
from chaincor.workflows.engines.reference import bookkeeping, stepping
from chaincor.workflows.engines.reference.kernels import kernels_for
from chaincor.workflows.engines.reference.moving import Motion, Stepper
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import (
    BarrierError,
    CrossingError,
    TimestepError,
    UnfinishedCollisionError,
)
from tests.reference_cases import CASES, case_name, case_scene


def restitution(outcome, scene):
    return (outcome.velocities.mean() / scene.impact_velocity) ** 2


def sufficient_step(scene):
    """Return an order-8 step with an error of 1e-9: fast impacts make bonds stiffer."""
    speed = scene.speed or 0.0
    if speed <= 0.2:
        return 0.1
    if speed < 1.0:
        return 0.05
    return 0.025 if speed <= 2.0 else 0.0125


@pytest.mark.parametrize(
    ("case", "scheme", "longer"),
    [(case, "order8", 1.0) for case in CASES]
    + [(case, "extrapolated14", 3.0) for case in CASES if case["potential"] == "lj"],
    ids=lambda value: case_name(value) if isinstance(value, dict) else None,
)
@pytest.mark.slow_cases
def test_reference_values(case, scheme, longer):
    scene = case_scene(case)
    numerics = Numerics(scheme=scheme, timestep=longer * sufficient_step(scene))
    outcome = stepping.run(scene.problem, numerics)
    # The published values and the run each have an error of 1e-9.
    assert restitution(outcome, scene) == pytest.approx(case["restitution"], abs=2e-9)
    assert len(outcome.contact_times) == case["contacts"]
    # Published times have an error of 5e-8. Contact times are a thousand times more sensitive than
    # the restitution.
    assert outcome.contact_times[-1] == pytest.approx(case["last_contact_time"], abs=2e-6)


@pytest.mark.parametrize(
    ("scheme", "steps"),
    [
        ("verlet", (0.02, 0.01, 0.005)),
        ("order4", (0.2, 0.1, 0.05)),
        ("order6", (0.2, 0.1, 0.05)),
        ("order8", (0.4, 0.28, 0.2)),
        ("srkn14", (0.4, 0.28, 0.2)),
        ("extrapolated12", (0.6, 0.5, 0.4)),
    ],
)
def test_order_of_convergence(scheme, steps):
    scene = Scene(potential="lj", particles=20, speed=0.1)
    exact = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.02)).velocities
    errors = []
    for step in steps:
        found = stepping.run(scene.problem, Numerics(scheme=scheme, timestep=step)).velocities
        errors.append(np.linalg.norm(found - exact))
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    # At finite steps, the next even order changes the slope slightly.
    assert slope == pytest.approx(
        STEP_SCHEMES[scheme].order, abs=0.08 * STEP_SCHEMES[scheme].order + 0.2
    )


@pytest.mark.parametrize("scheme", [*COMPOSITIONS, "srkn14"])
@pytest.mark.parametrize("potential", ["lj", "toda", "log"])
def test_time_reversal(scheme, potential):
    scene = Scene(potential=potential, particles=30, speed=0.5)
    step = min(SCHEMES[scheme].usual_step, 0.1)
    stepper = Stepper.of(scene.line, scene.bond, scheme, step)
    chain = Motion.at_start(scene.problem, stepper)
    chain.run_state.argue_after = np.inf
    chain.run_state.patience = np.inf
    chain.run_state.active = 29
    target_steps = round(50.0 / step)
    assert chain.advance(1) == bookkeeping.DONE
    early = chain.copy()
    assert chain.advance(target_steps) == bookkeeping.DONE
    assert chain.run_state.contacts > 20
    forward = chain.contact_times[1:].copy()

    back = chain.copy()
    back.velocity[:] *= -1.0
    back.run_state.steps = 0
    assert back.advance(target_steps - 1) == bookkeeping.DONE
    # A symmetric map is its own inverse, including the partial steps to the wall and from it. Only
    # rounding remains: a random epsilon per stage, which contacts amplify thirtyfold.
    allowed = 30.0 * np.finfo(float).eps * np.sqrt(2 * target_steps * stepper.scheme.evaluations)
    v0 = scene.impact_velocity
    assert np.abs(back.velocity + early.velocity).max() < allowed * v0
    assert np.abs(back.strain - early.strain).max() < allowed * v0
    assert back.run_state.position == pytest.approx(early.run_state.position, abs=allowed * v0)
    backward = target_steps * step - back.contact_times[1:][::-1]
    assert np.abs(backward - forward).max() < 10.0 * allowed


@pytest.mark.parametrize("particles", [20, 100])
@pytest.mark.parametrize("fields", [{"potential": "harmonic", "velocity": 1e-13}, {"speed": 1e-12}])
def test_no_floor_at_low_speed(particles, fields):
    limit = {20: 0.86850360724, 100: 0.97247093353}[particles]
    scene = Scene(particles=particles, **fields)
    outcome = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.1))
    assert restitution(outcome, scene) == pytest.approx(limit, abs=1e-10)


@pytest.mark.parametrize("potential", ["lj", "log"])
def test_balances(potential):
    scene = Scene(potential=potential, particles=50, speed=0.6)
    outcome = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.05))
    v0 = scene.impact_velocity
    gained = outcome.velocities.sum() + 50 * v0
    assert outcome.impulses.sum() == pytest.approx(gained, rel=1e-12)
    # At this step, the energy error of the method is as small as rounding.
    assert outcome.energy_end == pytest.approx(outcome.energy_start, rel=1e-9)
    assert outcome.displacements[0] == 0.0
    assert np.all(np.diff(outcome.contact_times) > 0.0)


@pytest.mark.parametrize("interval", [0.05, 0.1, 0.37, 7.0])
def test_frames_change_nothing(interval):
    scene = Scene(potential="lj", particles=12, speed=0.5)
    numerics = Numerics(scheme="order8", timestep=0.1)
    bare = stepping.run(scene.problem, numerics)
    filmed = stepping.run(scene.problem, numerics, frame_interval=interval)
    assert np.array_equal(bare.velocities, filmed.velocities)
    assert np.array_equal(bare.contact_times, filmed.contact_times)
    frames = filmed.frames
    assert frames is not None
    assert np.allclose(frames.times, np.arange(len(frames.times)) * interval, rtol=1e-15)
    assert frames.times[-1] + interval > filmed.duration - 0.1
    # Each frame is an exact state, which a run at a quarter of the step also gives.
    finer = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.025), interval).frames
    shared = min(len(frames.times), len(finer.times))
    for name in ("displacements", "velocities"):
        assert np.allclose(
            getattr(frames, name)[:shared], getattr(finer, name)[:shared], rtol=0.0, atol=1e-9
        )
    assert np.all(frames.displacements[:, 0] >= 0.0)


def test_particles_ahead_of_the_front_may_be_left_out():
    scene = Scene(potential="lj", particles=300, speed=0.5)
    stepper = Stepper.of(scene.line, scene.bond, "order8", 0.1)
    states = []
    for active in (None, 299):
        chain = Motion.at_start(scene.problem, stepper)
        if active is not None:
            chain.run_state.active = active
        chain.advance(1000)
        states.append(chain)
        if active is None:
            assert chain.run_state.active < 299  # some bonds were left out
    restricted, full = states
    # The omitted motion is 1e-24 v0 per step. Only fused multiply-adds at the end of vector loops
    # may round differently.
    v0 = scene.impact_velocity
    assert np.abs(restricted.velocity - full.velocity).max() < 1e-13 * v0
    assert np.abs(restricted.strain - full.strain).max() < 1e-13 * v0


def test_contacts_do_not_depend_on_the_step():
    # At this step, particle 1 leaves and returns within one or two steps. No contact may be missed.
    scene = Scene(potential="harmonic", particles=40)
    coarse = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.9))
    fine = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.05))
    assert len(coarse.contact_times) == len(fine.contact_times)
    assert np.abs(coarse.contact_times - fine.contact_times).max() < 0.02


@pytest.mark.parametrize("scheme", list(STEP_SCHEMES))
def test_one_two_three_particles(scheme):
    numerics = Numerics(scheme=scheme, timestep=0.01)
    single = stepping.run(Scene(potential="lj", particles=1).problem, numerics, frame_interval=1.0)
    assert restitution(single, Scene(potential="lj", particles=1)) == 1.0
    assert single.frames is not None
    assert len(single.contact_times) == 1
    for particles, expected in ((2, 1.0), (3, 0.94356222)):
        scene = Scene(potential="lj", particles=particles)
        outcome = stepping.run(scene.problem, numerics)
        assert len(outcome.contact_times) == particles
        assert restitution(outcome, scene) == pytest.approx(expected, abs=2e-5)


def test_harmonic_chain_that_crosses_is_flagged():
    scene = Scene(potential="harmonic", particles=20, velocity=0.8)
    outcome = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.1))
    assert outcome.crossed
    assert restitution(outcome, scene) == pytest.approx(0.86850360724, abs=1e-10)


@pytest.mark.parametrize(
    ("fields", "step", "error", "words"),
    [
        ({"potential": "power", "power_order": 3, "power_c": -1.0, "speed": 1.0}, 0.05,
         BarrierError, "barrier at 1.33333"),
        ({"potential": "toda", "toda_b": 1.0, "speed": 5.0}, 0.01,
         CrossingError, "toda bond cannot keep them apart"),
        ({"potential": "lj", "speed": 20.0}, 0.2, TimestepError, "smaller timestep than 0.2"),
        ({"potential": "log", "speed": 8.0}, 0.2, TimestepError, "smaller timestep than 0.2"),
    ],
)  # fmt: skip
@pytest.mark.slow
def test_named_failures(fields, step, error, words):
    with pytest.raises(error, match=words):
        stepping.run(
            Scene(particles=20, **fields).problem, Numerics(scheme="order8", timestep=step)
        )


def test_cap_on_the_length(monkeypatch):
    monkeypatch.setattr(end_watch, "longest_collision", lambda _n, _k, _last: 10.0)
    with pytest.raises(UnfinishedCollisionError, match=r"10(\.\d)? after the first contact"):
        stepping.run(Scene(particles=20).problem, Numerics(scheme="order6", timestep=0.1))


def lj_force_that_compiles(s):
    return -(1.0 - (1.0 + s) ** -6.0) * (1.0 + s) ** -7.0 / 6.0


def lj_force_that_does_not(s):
    return np.vectorize(lj_force_that_compiles)(s)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("force", "compiled"), [(lj_force_that_compiles, True), (lj_force_that_does_not, False)]
)
@pytest.mark.parametrize("scheme", ["order8", "extrapolated14"])
def test_bonds_of_users(force, compiled, scheme):
    named = Scene(potential="lj", particles=10, speed=0.4)
    bond = UserBond(lambda s: named.bond.energy(s), force)
    assert kernels_for(bond, STEP_SCHEMES["order8"]).compiled is compiled
    scene = Scene(potential=bond, particles=10, velocity=named.impact_velocity)
    numerics = Numerics(scheme=scheme, timestep=0.2)
    ours, theirs = stepping.run(named.problem, numerics), stepping.run(scene.problem, numerics)
    # The two forces differ only by rounding. Cancellation of 1e-16/s in the user's formula is
    # 1e-13.
    assert np.abs(ours.velocities - theirs.velocities).max() < 1e-11 * named.impact_velocity


def test_a_chain_after_its_last_contact_goes_the_same_way():
    scene = Scene(potential="lj", particles=48, speed=1.3505)
    stepper = Stepper.of(scene.line, scene.bond, "order8", 0.02)
    chain = Motion.at_start(scene.problem, stepper)
    assert chain.advance(10**6) == bookkeeping.ARGUE
    last, steps = float(chain.run_state["last_contact"]), int(chain.run_state["steps"])
    again = chain.after_last_contact()
    assert (again.run_state["contacts"], again.run_state["position"]) == (1, 0.0)
    kept = chain.strain.copy()
    count = 100
    again.run_state["argue_after"] = np.inf
    again.stepper = stepper.of_size((0.02 * steps - last) / count)
    assert again.advance(count) == bookkeeping.DONE
    # At this time, each motion has an error of 1e-10.
    assert again.strain == pytest.approx(chain.strain, abs=1e-9)
    assert again.velocity == pytest.approx(chain.velocity, abs=1e-9)
    assert again.run_state["position"] == pytest.approx(chain.run_state["position"], abs=1e-9)
    assert np.array_equal(chain.strain, kept)


def test_a_zero_is_settled_in_a_few_moves():
    # No floating-point number is a zero of x = 2 - t^2. Newton's method from 1 has errors of 0.09,
    # 2e-3, 2e-6, 2e-12.
    low, high, time, settled, moves = 0.0, 2.0, 1.0, False, 0
    while not settled and moves < 20:
        low, high, time, settled = narrow(low, high, time, (2.0 - time**2, -2.0 * time, -2.0))
        moves += 1
    assert time == pytest.approx(2.0**0.5, rel=1e-15)
    assert moves <= 6


@pytest.mark.parametrize("fields", [{"compression": 1e-12}, {"temperature": 1e-5}])
def test_a_motion_whose_energy_overflows_is_refused_by_name(fields):
    # Masses of 1e20 with springs of stiffness 1 act as a speed of 1e10 v*.
    scene = Scene(particles=3, potential="toda", engine="reference", masses=[1e20], **fields)
    with pytest.raises(TimestepError, match="is not resolved at time"):
        collide(scene, tolerance=1e-4)
