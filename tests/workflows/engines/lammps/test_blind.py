"""Test that runs without wall checks between contacts change no bit."""

from contextlib import contextmanager

import numpy as np
import pytest

from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps import flight
from chaincor.workflows.engines.lammps.flight import flight_of
from chaincor.workflows.engines.lammps.guard import WallGuard
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.reference import modal
from tests.workflows.engines.lammps import blind_steps


def random_scene(seed):
    """Return a random scene of any potential, slow or fast, with coarse or fine steps."""
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
    # Fast chains need finer steps to be stable.
    fine = 1.0 + fields.get("speed", 0.0)
    return Scene(**fields), float(10.0 ** rng.uniform(-2.3, -1.2)) / fine


def bitwise_equal(one, two):
    arrays = ("contact_times", "contact_speeds", "velocities", "displacements")
    return all(np.array_equal(getattr(one, name), getattr(two, name)) for name in arrays)


@pytest.mark.slow
@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize("seed", range(24))
def test_blind_is_bit_equal_to_asking_every_step(seed, wall):
    scene, timestep = random_scene(seed)
    numerics = Numerics(wall=wall, scheme="verlet", timestep=timestep)
    blind = lammps.run(scene.problem, numerics)
    with blind_steps.asking_every_step():
        asking = lammps.run(scene.problem, numerics)
    assert bitwise_equal(blind, asking)
    assert (blind.ending, blind.duration) == (asking.ending, asking.duration)


@pytest.mark.slow
@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize(("potential", "speed"), [("lj", 6.0), ("toda", 6.0), ("log", 1.2)])
def test_also_at_high_speed(potential, speed, wall):
    scene = Scene(potential=potential, particles=40, speed=speed)
    numerics = Numerics(wall=wall, scheme="verlet", timestep=0.002)
    with blind_steps.asking_every_step():
        asking = lammps.run(scene.problem, numerics)
    assert bitwise_equal(lammps.run(scene.problem, numerics), asking)


def test_blind_runs_do_run_blind(monkeypatch):
    # The number of LAMMPS calls is far below the number of steps.
    calls = []
    run = LammpsChain.run
    monkeypatch.setattr(LammpsChain, "run", lambda self, n: (calls.append(n), run(self, n))[1])
    scene = Scene(potential="lj", particles=100, speed=0.1)
    lammps.run(scene.problem, Numerics(scheme="verlet", timestep=0.0125))
    assert max(calls) > 50
    assert len(calls) < 0.25 * sum(calls)


@pytest.mark.slow
def test_coarse_steps_of_the_benchmark_too():
    # These are the first scenes of `python -m tests.workflows.engines.lammps.blind_steps`.
    for k in range(12):
        scene, numerics = blind_steps.random_scene(np.random.default_rng([1, k]), longest=30)
        same, _ = blind_steps.compare(scene, numerics)
        assert same, (k, scene, numerics)


@pytest.mark.parametrize("wall", ["event", "reflect"])
def test_a_forecast_that_fails_is_noticed_and_taken_back(wall, monkeypatch):
    # The forecast is replaced by one that always promises a distant wall. In most windows, particle
    # 1 is then behind the wall, and often in front of it again at the end.
    scene = Scene(potential="lj", particles=20, speed=1.0)
    numerics = Numerics(wall=wall, scheme="verlet", timestep=0.01, bond_range=(0.7, 8.0))
    with blind_steps.asking_every_step():
        reference_value = lammps.run(scene.problem, numerics)
    kept = []

    class Misled(WallGuard):
        def __init__(self, *given):
            super().__init__(*given)
            self.longest = 3.0

        def _time_left(self, now):
            return 4.0 if super()._time_left(now) > 0.0 else 0.0

        def run(self, steps):
            kept.append(super().run(steps))
            return kept[-1]

    monkeypatch.setattr(flight, "WallGuard", Misled)
    misled = lammps.run(scene.problem, numerics)
    assert kept.count(False) >= 5, "hardly a window was taken back, so little was tested"
    assert bitwise_equal(misled, reference_value)


def test_windows_that_fail_again_and_again_get_shorter(monkeypatch):
    # Present accelerations do not predict collisions of sharp bonds. With windows of full length,
    # LAMMPS took a hundred times more steps than it kept.
    calls = []
    run = LammpsChain.run
    monkeypatch.setattr(LammpsChain, "run", lambda self, n: (calls.append(n), run(self, n))[1])
    scene = Scene(potential="log", particles=10, speed=2.0)
    numerics = Numerics(scheme="verlet", timestep=1e-4, bond_range=(0.005, 1.1))
    outcome = lammps.run(scene.problem, numerics)
    assert sum(calls) < 2.0 * outcome.duration / numerics.timestep


def place(chain, positions, velocities):
    """Place a chain and compute its forces."""
    chain.x[:], chain.v[:] = positions, velocities
    chain.commands("run 0 post no")


@contextmanager
def chain_of(bond, particles, timestep, folder, wall="event"):
    """Set up a chain; bonds other than harmonic bonds have a wide table."""
    scene = Scene(potential=bond, particles=particles, velocity=0.1)
    numerics = Numerics(wall=wall, scheme="verlet", timestep=timestep)
    table = None if bond == "harmonic" else tabulate(scene.bond, (0.3, 4.0), rows=4000)
    with LammpsChain(scene.problem, numerics, table, folder) as chain:
        yield chain


def random_state(rng, particles):
    """Return positions and velocities of a chain near the wall, or leaving it."""
    amplitude = 10.0 ** rng.uniform(-2.5, -0.9)
    strains = np.clip(amplitude * rng.normal(size=particles - 1), -0.4, 0.6)
    velocities = amplitude * rng.normal(size=particles)
    distance = amplitude * 10.0 ** rng.uniform(-3.0, 0.0) * abs(rng.normal())
    if rng.uniform() < 0.2:
        distance, velocities[0] = 0.0, abs(velocities[0])
    return distance + np.concatenate(([0.0], np.cumsum(1.0 + strains))), velocities


@pytest.mark.parametrize("timestep", [0.01, 0.005])
def test_all_contacts_of_a_chain_whose_last_one_is_slow(timestep):
    scene = Scene(potential="harmonic", particles=87, velocity=0.1)
    numerics = Numerics(scheme="verlet", timestep=timestep)
    exact = modal.run(scene.problem)
    outcome = lammps.run(scene.problem, numerics)
    assert len(outcome.contact_times) == len(exact.contact_times) == 76
    # Verlet's frequencies, up to 2, have a relative error of omega^2 h^2/24; errors of times are up
    # to h^2 t/6.
    latest = exact.contact_times[-1]
    assert abs(outcome.contact_times[-1] - latest) < latest * timestep**2 / 6.0


@pytest.mark.slow
def test_a_tolerance_finds_the_slow_contact():
    scene = Scene(potential="harmonic", particles=87, velocity=0.1)
    result = collide(scene, tolerance=1e-3)
    reference_value = collide(scene.replace(engine="reference"), tolerance=1e-9)
    assert result.contacts == reference_value.contacts == 76
    assert abs(result.restitution - reference_value.restitution) < result.restitution_error


# Scene of the chain that ``passage`` places.
SPRINGS = Scene(potential="harmonic", particles=3, velocity=0.1)


def passage(chain):
    """Place three particles so that the first is behind the wall for a while, from 0.12 to 0.39."""
    place(chain, np.array([0.01, 1.35, 2.3]), np.array([-0.1, 0.0, 0.0]))


def test_lammps_sees_a_passage_behind_the_wall_that_ended(tmp_path):
    with chain_of("harmonic", 3, 0.01, tmp_path) as chain:
        passage(chain)
        guard = WallGuard(chain, SPRINGS.problem, False)
        start = chain.snapshot()
        chain.run(50)
        assert chain.x[0] > guard.position
        chain.restore(start)
        assert not guard.run(50)
        # The guard watches only guarded runs, and not the motion after these runs.
        chain.restore(start)
        chain.run(20)
        assert chain.x[0] < 0.0
        chain.run(60)
        assert guard.run(10)


def test_the_stock_wall_mirrors_nothing_unseen(tmp_path):
    with chain_of("harmonic", 3, 0.01, tmp_path, wall="reflect") as chain:
        passage(chain)
        guard = WallGuard(chain, SPRINGS.problem, True)
        start = chain.snapshot()
        assert not guard.run(50)
        chain.restore(start)
        chain.run(50)
        assert chain.x[0] > 0.0
        assert chain.v.sum() > -0.1 + 1e-3, "the wall gave the chain momentum"


@pytest.mark.parametrize("guarded", [False, True])
def test_a_contact_within_a_step_that_ends_in_front_of_the_wall(guarded, tmp_path):
    # A step of 0.3 begins before the passage and ends after it.
    with chain_of("harmonic", 3, 0.3, tmp_path) as chain:
        place(chain, np.array([0.004, 1.35, 2.3]), np.array([-0.0541, 0.0, 0.0]))
        x, v, a = chain.x[0], chain.v[0], chain.f[0]
        assert x + 0.3 * v + 0.5 * 0.09 * a > 0.0, "the step ends in front of the wall"
        numerics = Numerics(scheme="verlet", timestep=0.3)
        contact = flight_of(chain, SPRINGS.problem, numerics, guarded).advance(1.0)
        assert contact is not None
        # This is the first root of x + v t + a t^2/2 = 0.
        moment = (-v - np.sqrt(v * v - 2.0 * x * a)) / a
        assert contact.time == pytest.approx(moment, rel=1e-12)


def contacts_from(chain, guarded, state, scene, wall):
    """Return times and speeds of all contacts up to t = 6, and the state at this time."""
    numerics = Numerics(wall=wall, scheme="verlet", timestep=chain.timestep)
    flight = flight_of(chain, scene.problem, numerics, guarded)
    chain.restore(state)
    found = []
    while flight.time < 6.0:
        contact = flight.advance(6.0)
        if contact is not None:
            found.append((contact.time, contact.speed))
    return found, [part.tobytes() for part in chain.snapshot()[:3]]


@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize("bond", ["harmonic", "lj"])
def test_blind_from_any_state(bond, wall, tmp_path):
    rng = np.random.default_rng(11)
    scene = Scene(potential=bond, particles=5, velocity=0.1)
    contacts = 0
    for timestep in (0.004, 0.03, 0.15):
        folder = tmp_path / str(timestep)
        folder.mkdir()
        with chain_of(bond, 5, timestep, folder, wall) as chain:
            for _ in range(12):
                place(chain, *random_state(rng, 5))
                state = chain.snapshot()
                asked = contacts_from(chain, False, state, scene, wall)
                assert contacts_from(chain, True, state, scene, wall) == asked
                contacts += len(asked[0])
    assert contacts > 30


@pytest.mark.slow
def test_bonds_change_tables_at_the_same_step():
    # A bond becomes so long that it changes to another table, which differs in the last digits.
    scene = Scene(potential="lj", particles=52, speed=1.6845117159555532)
    numerics = Numerics(scheme="verlet", timestep=0.01118142086486839, bond_range=(0.5, 40.0))
    with blind_steps.asking_every_step():
        asking = lammps.run(scene.problem, numerics)
    assert bitwise_equal(lammps.run(scene.problem, numerics), asking)
