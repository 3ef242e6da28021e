"""Test that many collisions give the results of single collisions, on any number of workers."""

import json
import re

import numpy as np
import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.warm import WarmSolver
from chaincor.workflows.campaign.collide_many import collide_many
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.reference.batch.chains import StartStates
from chaincor.workflows.errors import CostError
from tests.interrupting import interrupted

WARM = Scene(
    potential="toda",
    particles=6,
    velocity=0.08,
    temperature=1e-3,
    engine="reference",
    tolerance=1e-6,
)
OTHERS = {
    "harmonic": {"potential": "harmonic"},
    "hot lj, which breaks": {"potential": "lj", "temperature": 1.5e-3, "particles": 8},
    "log": {"potential": "log", "tolerance": 1e-4},
    "masses": {"masses": (1.0, 3.0)},
    "slow": {"velocity": 0.01},
    "fast": {"velocity": 0.5},
    "almost cold": {"temperature": 1e-9},
}


def assert_same(sample, single):
    """Assert that two results of a collision agree within the sum of their error bars."""
    bars = sample.restitution_error + single.restitution_error
    assert abs(sample.restitution - single.restitution) <= bars
    assert sample.tolerance_met == (sample.restitution_error <= single.tolerance)
    if sample.scheme == single.scheme and "open" not in (sample.ending, single.ending):
        assert sample.contacts == single.contacts
        # The last contact may be grazing. Its time is then less exact than eta.
        assert sample.last_contact_time == pytest.approx(single.last_contact_time, abs=1e-2)


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) for name in OTHERS])
def test_samples_are_what_collide_gives(name):
    scene = WARM.replace(**OTHERS[name])
    found = collide_many(scene, 12, workers=1)
    for seed, sample in enumerate(found.samples, 1):
        assert sample.seed == seed
        assert_same(sample, collide(scene.replace(seed=seed)))


@pytest.mark.parametrize("changes", [{}, {"particles": 8, "masses": (1.0,) * 7 + (3.0,)}])
def test_a_warm_chain_has_the_same_digits_and_bar_alone(changes):
    scene = WARM.replace(**changes)
    for seed, sample in enumerate(collide_many(scene, 4, workers=1).samples, 1):
        single = collide(scene.replace(seed=seed))
        assert (single.scheme, single.timestep) == (sample.scheme, sample.timestep)
        # The two loops round differently; chains as short as these amplify rounding by less than
        # 1e3.
        assert single.restitution == pytest.approx(sample.restitution, abs=1e-12)
        assert single.restitution_error == pytest.approx(sample.restitution_error, abs=1e-11)


def test_a_few_samples_are_what_collide_gives():
    found = collide_many(WARM.replace(seed=41), 3, workers=1)
    assert [sample.seed for sample in found.samples] == [41, 42, 43]
    assert {sample.ending for sample in found.samples} == {"proved"}
    for sample in found.samples:
        assert_same(sample, collide(WARM.replace(seed=sample.seed)))
        assert sample.restitution_error <= 1e-6


def test_workers_and_batches_change_no_bit():
    one = collide_many(WARM, 40, workers=1)
    assert collide_many(WARM, 40, workers=3).samples == one.samples
    assert collide_many(WARM.replace(seed=11), 7, workers=2).samples == one.samples[10:17]
    # The list has the scenes in another order, and a scene of another kind.
    seeds = [5, 3, 4]
    scenes = [WARM.replace(seed=seed) for seed in seeds] + [WARM.replace(seed=1, velocity=0.1)]
    listed = collide_many(scenes, workers=1)
    assert listed.samples[:3] == tuple(one.samples[seed - 1] for seed in seeds)
    assert listed.samples[3].velocity == 0.1
    assert "seed" not in listed.scene


def test_each_sample_may_have_a_speed_of_its_own():
    velocities = [0.05, 0.08, 0.1]
    found = collide_many(WARM, 3, velocities=velocities, workers=1)
    scenes = [WARM.replace(seed=k + 1, velocity=v) for k, v in enumerate(velocities)]
    assert found.samples == collide_many(scenes, workers=1).samples
    # Samples that no batch computes may also have different speeds.
    sharp = WARM.without("velocity").replace(tolerance=1e-9, speed=0.3)
    found = collide_many(sharp, 2, velocities=velocities[:2], workers=1)
    single = collide(sharp.without("speed").replace(seed=2, velocity=0.08))
    assert found.samples[1].restitution == single.restitution


@pytest.mark.parametrize("velocities", [[0.1], [0.1, -0.1], [0.1, np.inf], [[0.1, 0.1]]])
def test_speeds_that_are_none_are_refused(velocities):
    with pytest.raises(InputError, match=r"velocities of the shape .* Give 2 finite"):
        collide_many(WARM, 2, velocities=velocities)
    with pytest.raises(InputError, match="velocities needs one scene"):
        collide_many([WARM], velocities=velocities)


def test_a_cold_scene_in_a_list_is_collided_by_itself():
    cold = Scene(potential="toda", particles=4, velocity=0.08, engine="reference")
    found = collide_many([cold, WARM], workers=1)
    assert found.samples[0].seed is None
    assert found.samples[0].restitution == collide(cold).restitution
    assert found.samples[1] == collide_many(WARM, 1, workers=1).samples[0]


@pytest.mark.slow
def test_lammps_gives_the_same_ensemble():
    ours = collide_many(WARM, 6)
    lammps = collide_many(WARM.replace(engine="lammps"), 6, workers=2)
    for one, other in zip(ours.samples, lammps.samples, strict=True):
        assert other.tolerance_met
        bars = one.restitution_error + other.restitution_error
        assert abs(one.restitution - other.restitution) <= bars
        assert one.contacts == other.contacts
    # Extrapolated steps are used only for chains without vibrations.
    assert lammps.samples[0].scheme in ("order6", "order8", "verlet")


@pytest.mark.slow
def test_bars_are_honest_against_sharper_ones():
    # Random warm scenes are compared with single collisions at a tolerance that is a thousand times
    # smaller.
    rng = np.random.default_rng(20)
    wrong = []
    for _ in range(12):
        scene = WARM.replace(
            potential=str(rng.choice(["toda", "lj", "log", "harmonic"])),
            particles=int(rng.integers(2, 30)),
            temperature=float(10.0 ** rng.uniform(-6.0, -3.0)),
            velocity=float(10.0 ** rng.uniform(-2.0, -0.5)),
            seed=int(rng.integers(1000)),
        )
        for sample in collide_many(scene, 4, workers=1).samples:
            if sample.restitution_error is None:
                continue
            sharp = collide(scene.replace(seed=sample.seed, tolerance=1e-9))
            bars = sample.restitution_error + sharp.restitution_error
            if abs(sample.restitution - sharp.restitution) > bars:
                wrong.append((scene, sample))
    assert wrong == []


def test_a_step_that_is_too_large_is_found_out(monkeypatch):
    # Without refinement, a first step that is ten times too large must give no result.
    warm_solver = WarmSolver(WARM.problem, WARM.asked_tolerance)
    line = WARM.line
    starts, v = StartStates.of([line]), np.array([0.08])
    good = warm_solver.solve(starts, v)
    monkeypatch.setattr("chaincor.workflows.accuracy.warm._LARGEST_STEP", 1.1)
    # The first step is too large; finer steps are allowed.
    monkeypatch.setattr(WarmSolver, "_rungs_of", lambda *_: (0, 30))
    coarse = WarmSolver(WARM.problem, WARM.asked_tolerance).solve(starts, v)
    assert not coarse.met[0] or coarse.timestep[0] < 0.8
    if coarse.met[0]:
        bars = coarse.step_error[0] + good.step_error[0]
        assert abs(coarse.restitution[0] - good.restitution[0]) <= bars


@pytest.mark.parametrize(
    ("fields", "least"),
    [
        # The end of this collision comes later than a batch is followed.
        ({"particles": 50, "seed": 1348, "velocity": 3.077e-3, "tolerance": 1e-3}, 0.1),
        # The chain is so slow that the last digits decide. Below this step, the error of srkn14 is
        # smaller than rounding.
        pytest.param(
            {"particles": 12, "velocity": 9.13e-5, "tolerance": 1e-6}, 0.015, marks=pytest.mark.slow
        ),
    ],
)
def test_what_finer_steps_do_not_help_is_left_to_be_met_alone(monkeypatch, fields, least):
    steps = []
    compare = WarmSolver._compare
    monkeypatch.setattr(
        WarmSolver,
        "_compare",
        lambda self, starts, step, *given: (
            steps.append(step.min()) or compare(self, starts, step, *given)
        ),
    )
    scene = Scene(potential="toda", temperature=1e-3, engine="reference", **fields)
    velocity = np.array([scene.velocity])
    warm_solver = WarmSolver(scene.problem, scene.asked_tolerance)
    met = warm_solver.solve(StartStates.of([scene.line]), velocity)
    assert not met.met[0]
    assert min(steps) > least


def test_states_are_those_of_the_scenes(monkeypatch):
    seen = []
    solve = WarmSolver.solve
    monkeypatch.setattr(
        WarmSolver, "solve", lambda self, starts, v: seen.append(starts) or solve(self, starts, v)
    )
    scene = WARM.replace(masses=(1.0, 2.0, 3.0))
    collide_many(scene, 3, workers=1)
    for k, seed in enumerate((1, 2, 3)):
        line = scene.replace(seed=seed).line
        np.testing.assert_array_equal(seen[-1].strains[k], line.strains)
        np.testing.assert_array_equal(seen[-1].velocities[k], line.velocities[1:])


def test_no_memory_costs_the_sample_that_met_it(monkeypatch):
    solve = WarmSolver.solve

    def solve_first(self, starts, velocities):
        if np.array_equal(starts.strains[0], WARM.line.strains):
            return solve(self, starts, velocities)
        raise MemoryError("no memory")

    monkeypatch.setattr(WarmSolver, "solve", solve_first)
    first, second = collide_many(WARM, 2, workers=2).samples
    assert (first.seed, first.tolerance_met, first.reason) == (1, True, None)
    assert (second.seed, second.restitution, second.reason) == (2, None, "no memory")


@pytest.mark.parametrize(
    ("scene", "samples", "message"),
    [
        (WARM.without("temperature"), 10, "samples needs a temperature"),
        (WARM, None, "samples is None"),
        (WARM, True, "samples is True"),
        (WARM, 0, "samples is 0"),
        (WARM.replace(seed=2**63 - 3), 4, "exceed the largest seed, 9223372036854775807"),
        (WARM.replace(arrays="a.npz"), 4, "arrays is given"),
        ([WARM], 4, "samples needs one scene"),
        ([], None, "no scenes"),
        ([WARM, 1], None, "Give a scene"),
    ],
)
def test_what_makes_no_ensemble_is_refused_by_name(scene, samples, message):
    with pytest.raises(InputError, match=message):
        collide_many(scene, samples)


def test_samples_may_be_a_whole_number_of_numpy():
    assert len(collide_many(WARM, np.int64(2), workers=1).samples) == 2


def test_no_workers_are_refused():
    with pytest.raises(InputError, match="workers is 0"):
        collide_many(WARM, 2, workers=0)


@pytest.mark.slow
def test_what_takes_too_long_is_not_begun():
    with pytest.raises(CostError, match="10000000 collisions would take"):
        collide_many(WARM, 10_000_000, workers=1, most_seconds=10.0)


def test_all_samples_are_in_the_json():
    found = json.loads(json.dumps(collide_many(WARM, 5, workers=1).to_dict(), allow_nan=False))
    assert found["count"] == 5
    assert [sample["seed"] for sample in found["samples"]] == [1, 2, 3, 4, 5]
    assert found["eta"]["mean"] == pytest.approx(
        np.mean([sample["restitution"] for sample in found["samples"]]), rel=1e-12
    )
    assert found["scene"]["temperature"] == 1e-3
    assert found["versions"]["chaincor"]


SESSION = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from chaincor import Scene, collide_many
scene = Scene(potential="toda", particles=6, velocity=0.08, temperature=1e-3, engine="reference")
collide_many(scene, 2)
print("BEGINS", flush=True)
try:
    collide_many(scene, 1_000_000)
except KeyboardInterrupt:
    print("STOPPED", flush=True)
"""


@pytest.mark.slow
def test_an_interrupt_stops_at_once(tmp_path):
    assert interrupted(tmp_path, SESSION, 0.5) == "STOPPED\n"


def test_an_ensemble_shows_itself_in_a_notebook():
    found = collide_many(WARM, 5, workers=1)
    shown = found._repr_html_()
    assert "<caption>5 collisions, 0 without a number, 0 beyond the tolerance</caption>" in shown
    mean, error = re.search(r"<th>mean</th><td>(\S+) \+- (\S+)</td>", shown).groups()
    # The mean and its error are rounded to the first digits of the error.
    assert float(mean) == pytest.approx(found.eta.mean, abs=found.eta.standard_error)
    assert float(error) == pytest.approx(found.eta.standard_error, rel=0.5)
    one = collide_many(WARM, 1, workers=1)._repr_html_()
    assert "<td>unknown</td>" in one


def test_an_executor_is_refused():
    with pytest.raises(InputError, match=r"takes no executor.*Give workers instead"):
        collide_many(WARM, 2, executor=object())
