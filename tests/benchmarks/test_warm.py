"""Test that warm chains obey detailed balance and the second law, and have the right cold limit."""

import math

import numpy as np
import pytest

from benchmarks.warm.detailed_balance import measure
from benchmarks.warm.fixed_steps import carry
from benchmarks.warm.gain import broken, measure_bounds, measure_gain
from benchmarks.warm.throughput import compare
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign import groups as module
from chaincor.workflows.campaign.collide_many import collide_many
from chaincor.workflows.collision import collide

# For a right program, one set of seeds in a thousand would give a p-value below this.
LEAST_P = 1e-3
WARM = Scene(
    potential="toda",
    particles=4,
    velocity=0.03,
    temperature=1e-3,
    engine="reference",
    tolerance=1e-3,
)


@pytest.mark.slow
@pytest.mark.parametrize("potential", ["harmonic", "toda", "log"])
def test_thermal_speeds_come_back_thermal(potential):
    found = measure(WARM.replace(potential=potential), 3000, workers=1)
    assert found["failed"] == found["inexact"] == 0
    assert min(found["p_after"], found["p_mean"], found["p_symmetry"]) > LEAST_P
    # Every collision must change the velocities: a mirror would also pass the tests above.
    assert found["correlation"] < 0.95


@pytest.mark.slow
def test_thermal_speeds_of_long_chains_come_back_thermal_at_one_step():
    # For 100 log particles and a time step of 0.2, no sample has to reach the tolerance.
    found = measure(WARM.replace(potential="log", particles=100), 300, timestep=0.2)
    assert found["failed"] == 0
    assert found["ends"] == {"proved": 300}
    assert min(found["p_after"], found["p_mean"], found["p_symmetry"]) > LEAST_P


@pytest.mark.slow
def test_samples_at_one_step_are_those_of_collisions_by_themselves():
    seeds = range(1, 9)
    alone = [collide(WARM.replace(seed=seed, tolerance=1e-8)) for seed in seeds]
    carried = carry(WARM, len(seeds), 0.05)
    expected = [found.kinematic_restitution for found in alone]
    # For order 8 and chains of four particles, the error of the step is far below the tolerance of
    # the comparison.
    np.testing.assert_allclose(carried.e, expected, rtol=0.0, atol=1e-6)
    assert carried.contacts.tolist() == [found.contacts for found in alone]


@pytest.mark.slow
def test_thermal_speeds_come_back_thermal_from_lammps():
    found = measure(WARM.replace(engine="lammps"), 100, workers=2)
    assert found["failed"] == found["inexact"] == 0
    assert min(found["p_after"], found["p_mean"], found["p_symmetry"]) > LEAST_P
    # With these seeds and speeds, the reference engine gives equal energies within the sum of the
    # error bars, 1e-3 each.
    ours = measure(WARM, 100, workers=1)
    assert found["mean"] == pytest.approx(ours["mean"], abs=2e-3)


@pytest.mark.slow
def test_detailed_balance_tells_wrong_states_from_right_ones(monkeypatch):
    # The bonds are at another temperature than the velocities. The difference, 1.3 T, is far beyond
    # the error of 3000 samples.
    draw = module.draw
    monkeypatch.setattr(module, "draw", lambda bond, t, *rest: draw(bond, 1.3 * t, *rest))
    found = measure(WARM, 3000, workers=1)
    assert found["p_mean"] < LEAST_P


@pytest.mark.slow
@pytest.mark.parametrize("window", [0.0, 4.0])
def test_gains_are_within_the_bounds(window):
    row = measure_bounds(WARM, window, 2000, 0.1)
    assert row["samples"] == 2000
    assert broken(row) == []
    assert row["entropy_margin"] > 0.0


@pytest.mark.slow
def test_chains_come_back_faster_where_they_are_slower_than_a_particle():
    thermal = math.sqrt(1e-3)
    chain = WARM.replace(particles=10)
    slow = measure_gain(chain.replace(velocity=0.2 * thermal), 300, 0.2)
    fast = measure_gain(chain.replace(velocity=10.0 * thermal), 300, 0.2)
    assert slow["low"] > 0.2
    assert fast["high"] < 0.02
    assert slow["mean_e"] - 4.0 * slow["standard_error"] > 1.0 > fast["mean_e"]


@pytest.mark.parametrize("potential", ["toda", "lj"])
@pytest.mark.slow_cases
def test_without_warmth_every_sample_is_the_cold_number(potential):
    scene = Scene(
        potential=potential, particles=5, velocity=0.02, engine="reference", tolerance=1e-8
    )
    cold = collide(scene)
    away = []
    for temperature in (1e-14, 1e-12):
        found = collide_many(scene.replace(temperature=temperature), 6, workers=1)
        assert not found.failures
        away.append(found.restitution - cold.restitution)
        # Thermal speeds are sqrt(T)/v0 times the impact speed. Their relative effect has this size,
        # up to a factor of ten in a chain of five particles.
        assert np.max(np.abs(away[-1])) < 10.0 * math.sqrt(temperature) / 0.02
    # The same draws ten times as large have a linear effect, up to sqrt(T)/v0 = 5e-5 and the error
    # bars.
    np.testing.assert_allclose(away[1], 10.0 * away[0], rtol=1e-2, atol=2.2e-7)


def test_an_ensemble_is_compared_with_the_same_collisions():
    found = compare(WARM, 20, 10, workers=1)
    assert (found["samples"], found["singles"], found["met"]) == (20, 10, 1.0)
    assert found["worst_difference_in_bars"] <= 1.0


@pytest.mark.slow
def test_late_contacts_count(monkeypatch):
    # If a collision is stopped at the first pause between contacts, final speeds are too large.
    monkeypatch.setattr("chaincor.workflows.engines.whole_end.reach", lambda *_: -math.inf)
    # With 1500 samples, p is 7e-7.
    found = measure(WARM, 1500, workers=1)
    assert found["p_after"] < 0.1 * LEAST_P
