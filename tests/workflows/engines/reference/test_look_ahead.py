"""Test that looking ahead changes no result, and test when it is done."""

import math

import numpy as np
import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.step_guess import guess_step
from chaincor.workflows.engines.end_watch import longest_collision
from chaincor.workflows.engines.ending import sound_round_trip
from chaincor.workflows.engines.fragments import Body
from chaincor.workflows.engines.reference import coarse_run, stepping
from chaincor.workflows.engines.reference.look_ahead import LookAhead
from chaincor.workflows.errors import RunError

LJ = Scene(potential="lj", particles=100, speed=0.4)


def random_scene(random):
    potential = str(random.choice(["harmonic", "lj", "toda", "log", "power"]))
    fields = {
        "potential": potential,
        "particles": round(10 ** random.uniform(math.log10(2), math.log10(200))),
    }
    # Above the natural speed v*, bonds break, and fragments collide with each other.
    speed = float(10 ** random.uniform(-3, math.log10(5)))
    fields |= {"velocity": 0.3 * speed} if potential == "harmonic" else {"speed": speed}
    if potential == "power":
        fields |= {"power_order": 4, "power_c": 1.0}
    return Scene(**fields)


def only_now(self, until):
    run_state = self._moving.run_state
    now = float(run_state.steps * self._stepper.step)
    return until <= now, now, int(run_state.evaluations)


def run_without_look_ahead(monkeypatch, scene, numerics, frame_interval=None):
    with monkeypatch.context() as patch:
        patch.setattr(LookAhead, "settle", lambda *_: None)
        patch.setattr(LookAhead, "stays_clear", only_now)
        return stepping.run(scene.problem, numerics, frame_interval)


@pytest.mark.slow
def test_results_are_equal_to_the_last_bit(monkeypatch):
    # These 60 scenes take 2 s. When this test was written, 1200 scenes showed no difference.
    random = np.random.default_rng(12)
    settled = 0
    for _ in range(60):
        scene = random_scene(random)
        scheme = str(random.choice(["order4", "order6", "order8"]))
        target_error = {"order4": 1e-6, "order6": 1e-8, "order8": 1e-10}[scheme]
        step = float(random.uniform(0.3, 1.0)) * guess_step(scene.problem, scheme, target_error)
        numerics = Numerics(scheme=scheme, timestep=step)
        try:
            exact = run_without_look_ahead(monkeypatch, scene, numerics)
        except RunError as error:
            with pytest.raises(type(error)):
                stepping.run(scene.problem, numerics)
            continue
        outcome = stepping.run(scene.problem, numerics)
        for field in ("displacements", "velocities", "contact_times", "contact_speeds"):
            assert np.array_equal(getattr(outcome, field), getattr(exact, field)), (scene, field)
        # Log bonds may be shortest after the last contact, and are then sampled by coarse steps.
        assert outcome.bond_min == pytest.approx(exact.bond_min, abs=1e-3)
        settled += outcome.duration != exact.duration
    assert settled > 20


def test_it_is_cheaper(monkeypatch):
    numerics = Numerics(scheme="order8", timestep=0.1)
    exact = run_without_look_ahead(monkeypatch, LJ, numerics)
    outcome = stepping.run(LJ.problem, numerics)
    # The last contact is at t = 154. From then until the end is proved, steps cost a quarter.
    assert outcome.ending == exact.ending
    assert outcome.force_evaluations < 0.6 * exact.force_evaluations
    assert outcome.bond_max == pytest.approx(exact.bond_max, rel=1e-2)
    assert outcome.fragments == exact.fragments


# The scenes have an end that the wall's impulse proves, an argued end, and an end of two bodies.
@pytest.mark.parametrize("fields", [{}, {"speed": 1.2}, {"target_particles": 5}])
def test_frames_change_nothing_and_are_exact_to_the_end(monkeypatch, fields):
    numerics = Numerics(scheme="order8", timestep=0.1)
    scene = LJ.replace(particles=20, **fields)
    plain = stepping.run(scene.problem, numerics)
    framed = stepping.run(scene.problem, numerics, frame_interval=0.7)
    exact = run_without_look_ahead(monkeypatch, scene, numerics, frame_interval=0.7)
    assert np.array_equal(framed.velocities, plain.velocities)
    for field in ("duration", "bond_max", "fragments", "ending"):
        assert getattr(framed, field) == getattr(plain, field)
    times = framed.frames.times
    # Frames continue for a round trip of sound; the end may be detected much later.
    quiet = sound_round_trip(scene.problem.longest_body, scene.problem.slow_stiffness)
    shown = min(plain.duration, plain.contact_times[-1] + quiet)
    assert np.array_equal(times, 0.7 * np.arange(math.floor(shown / 0.7) + 1))
    assert times[-1] > plain.contact_times[-1] + 1.0
    common = min(len(times), len(exact.frames.times))
    assert np.array_equal(framed.frames.velocities[:common], exact.frames.velocities[:common])
    assert np.array_equal(framed.frames.displacements[:common], exact.frames.displacements[:common])


class Drifting:
    """Two particles at a fixed distance that leave the wall, or come near it at a given time."""

    def __init__(self, distance, near_at=math.inf, velocity=1e-3):
        self.time, self._distance, self._near_at = 0.0, distance, near_at
        self._velocities = np.array([velocity, velocity])
        self.looks = []
        self.moving = self

    def fly(self, duration):
        self.time += duration
        self.looks.append(self.time)
        return self.time < self._near_at

    def bodies(self):
        return [Body(self._distance, np.array([-0.2]), self._velocities)]


def test_the_wall_comes_near():
    scene = Scene(potential="lj", particles=2, speed=0.4)
    ahead = Drifting(0.05, near_at=3.0)
    assert coarse_run.find_end(scene.problem, ahead, 0.0) is None
    assert ahead.time == pytest.approx(3.0, abs=1.5)


def test_what_is_not_proved_is_followed_to_the_cap():
    scene = Scene(potential="lj", particles=2, speed=0.4)
    # The particles are too near for a proof and too cold to break apart, so that they are followed
    # for the longest time.
    ahead = Drifting(0.05)
    assert coarse_run.find_end(scene.problem, ahead, 0.0).kind == "argued"
    cap = longest_collision(2, 1.0, 0.0)
    assert cap < ahead.time < 1.5 * cap


def test_a_chain_that_does_not_leave_is_given_up():
    scene = Scene(potential="lj", particles=2, speed=0.4)
    assert coarse_run.find_end(scene.problem, Drifting(0.05, velocity=-1e-3), 0.0) is None


def test_clearance():
    v0 = LJ.impact_velocity
    assert coarse_run.required_clearance(LJ.problem, 3.0 * v0) == pytest.approx(1.5 * v0)
    assert coarse_run.required_clearance(LJ.problem, 0.1 * v0) is None
    assert coarse_run.required_clearance(LJ.problem, -1.0) is None


def test_steps_shrink_with_the_stiffest_bond():
    bond = LJ.bond
    assert coarse_run.coarse_step(bond, 0.0) == pytest.approx(coarse_run.COARSE_STEP)
    # A stretched bond is softer, but other bonds are not.
    assert coarse_run.coarse_step(bond, 0.05) == pytest.approx(coarse_run.COARSE_STEP)
    stiff = math.sqrt(float(bond.curvature(-0.1)))
    assert coarse_run.coarse_step(bond, -0.1) == pytest.approx(coarse_run.COARSE_STEP / stiff)
