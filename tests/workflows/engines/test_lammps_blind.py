"""Running blind between contacts changes nothing, to the last bit."""

import numpy as np
import pytest

from lammps_inputs.numerics import Numerics
from lammps_inputs.scene import Scene
from workflows.engines import lammps
from workflows.engines.lammps_chain import LammpsChain
from workflows.engines.lammps_flight import BlindBound


def random_scene(seed):
    """Return a scene over all potentials, slow and fast, with coarse and fine steps."""
    rng = np.random.default_rng(seed)
    potential = str(rng.choice(["harmonic", "lj", "toda", "log", "power"]))
    fields = {"potential": potential, "particles": int(rng.integers(2, 40))}
    if potential == "power":
        order = int(rng.integers(3, 7))
        fields |= {"power_order": order, "power_c": 1.0 if order % 2 == 0 else -1.0}
    if potential == "harmonic":
        fields["velocity"] = 0.1
    else:
        fastest = {"power": -1.0, "log": 0.1}.get(potential, 0.7)
        fields["speed"] = float(10.0 ** rng.uniform(-2.5, fastest))
    # Fast chains need finer steps to stay stable at all.
    fine = 1.0 + fields.get("speed", 0.0)
    return Scene(**fields), float(10.0 ** rng.uniform(-2.3, -1.2)) / fine


def bitwise_equal(one, two):
    arrays = ("contact_times", "contact_speeds", "velocities", "displacements")
    return all(np.array_equal(getattr(one, name), getattr(two, name)) for name in arrays)


@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize("seed", range(24))
def test_blind_is_bit_equal_to_asking_every_step(seed, wall):
    scene, timestep = random_scene(seed)
    numerics = Numerics(wall=wall, scheme="verlet", timestep=timestep)
    blind = lammps.run(scene, numerics)
    asking = lammps.run(scene, numerics, ask_every_step=True)
    assert bitwise_equal(blind, asking)
    assert (blind.ending, blind.duration) == (asking.ending, asking.duration)


@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize(("potential", "speed"), [("lj", 6.0), ("toda", 6.0), ("log", 1.2)])
def test_also_at_high_speed(potential, speed, wall):
    scene = Scene(potential=potential, particles=40, speed=speed)
    numerics = Numerics(wall=wall, scheme="verlet", timestep=0.002)
    asking = lammps.run(scene, numerics, ask_every_step=True)
    assert bitwise_equal(lammps.run(scene, numerics), asking)


def test_blind_runs_do_run_blind(monkeypatch):
    # With the bound, LAMMPS is called far less often than once a step.
    calls = []
    run = LammpsChain.run
    monkeypatch.setattr(LammpsChain, "run", lambda self, n: (calls.append(n), run(self, n))[1])
    scene = Scene(potential="lj", particles=100, speed=0.1)
    lammps.run(scene, Numerics(scheme="verlet", timestep=0.0125))
    assert max(calls) > 50
    assert len(calls) < 0.25 * sum(calls)


def test_a_bound_that_fails_is_noticed_and_taken_back(monkeypatch):
    # Bound the remainder by far too little: LAMMPS then finds particle 1 elsewhere than promised.
    scene = Scene(potential="lj", particles=20, speed=1.0)
    numerics = Numerics(scheme="verlet", timestep=0.01)
    truth = lammps.run(scene, numerics, ask_every_step=True)
    monkeypatch.setattr(BlindBound, "SAFETY", 0.02)
    taken_back = []
    restore = LammpsChain.restore
    monkeypatch.setattr(
        LammpsChain, "restore", lambda self, s: (taken_back.append(1), restore(self, s))[1]
    )
    misled = lammps.run(scene, numerics)
    assert taken_back, "nothing was taken back, so nothing was tested"
    assert bitwise_equal(misled, truth)


def test_windows_that_fail_again_and_again_get_shorter(monkeypatch):
    # Sharp bonds collide beyond the particles that the bound looks at: with windows of full length
    # LAMMPS took a hundred times more steps than it kept.
    calls = []
    run = LammpsChain.run
    monkeypatch.setattr(LammpsChain, "run", lambda self, n: (calls.append(n), run(self, n))[1])
    scene = Scene(potential="log", particles=10, speed=2.0)
    numerics = Numerics(scheme="verlet", timestep=1e-4, bond_range=(0.005, 1.1))
    outcome = lammps.run(scene, numerics)
    assert sum(calls) < 2.0 * outcome.duration / numerics.timestep
