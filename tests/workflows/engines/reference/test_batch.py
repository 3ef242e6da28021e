"""Test that collisions in a batch have the motion of single collisions at the same step."""

import numpy as np
import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.engines.reference.batch.chains import StartStates, chain_energies
from chaincor.workflows.engines.reference.batch.runner import Batch, supports
from chaincor.workflows.errors import RunError

WARM = Scene(potential="toda", particles=6, velocity=0.08, temperature=1e-3, masses=(1.0, 2.0, 0.5))


def lines_of(scene, count):
    return [scene.replace(seed=seed).line for seed in range(1, count + 1)]


@pytest.mark.parametrize(
    ("scheme", "step"),
    [
        ("extrapolated14", 0.2),
        pytest.param("order8", 0.1, marks=pytest.mark.slow),
        pytest.param("verlet", 0.01, marks=pytest.mark.slow),
    ],
)
def test_it_is_the_motion_of_single_collisions(scheme, step):
    # There are more scenes than lanes, so that some lanes are used again; their number is no
    # multiple of that of lanes. Warm chains start away from the wall, and cold chains begin with
    # their first contact.
    scenes = [WARM.replace(seed=seed) for seed in range(1, 22)]
    scenes += [WARM.without("temperature").replace(velocity=v) for v in (0.04, 0.08, 0.12)]
    lines = [scene.line for scene in scenes]
    steps = np.full(len(lines), step)
    found = Batch(lines[0], WARM.bond, scheme).follow(StartStates.of(lines), steps)
    assert np.all(found.settled)
    assert np.all(found.proved)
    for k, scene in enumerate(scenes):
        single = stepping.run(scene.problem, Numerics(scheme=scheme, timestep=step))
        # Operations have the same order, so that results are equal to the last bit.
        times, speeds = found.contacts[k][:, : found.counts[k]]
        np.testing.assert_array_equal(times, single.contact_times)
        np.testing.assert_array_equal(speeds, single.contact_speeds)
        np.testing.assert_array_equal(found.velocities[k], single.velocities)
        assert (found.bond_min[k], found.bond_max[k]) == (single.bond_min, single.bond_max)


@pytest.mark.slow
def test_a_comparison_ends_soon_after_the_known_last_contact():
    lines = lines_of(WARM, 5)
    batch = Batch(lines[0], WARM.bond, "extrapolated14")
    starts, steps = StartStates.of(lines), np.full(len(lines), 0.1)
    fine = batch.follow(starts, steps)
    again = batch.compare(starts, steps, fine.last_contact_times)
    np.testing.assert_array_equal(again.speeds, fine.speeds)
    np.testing.assert_array_equal(again.contacts, fine.contacts)
    assert np.all(again.durations < fine.last_contact_times + 6.0)


@pytest.mark.slow
def test_bonds_that_break_are_looked_at_one_by_one():
    scene = Scene(potential="lj", particles=5, velocity=0.12, temperature=1e-3)
    lines = lines_of(scene, 6)
    energies = chain_energies(lines[0], scene.bond, StartStates.of(lines))
    assert np.all(energies > scene.bond.dissociation), "energy alone proves nothing here"
    batch = Batch(lines[0], scene.bond, "extrapolated14")
    found = batch.follow(StartStates.of(lines), np.full(len(lines), 0.1))
    assert np.any(found.settled)
    for k in np.flatnonzero(found.settled).tolist():
        one = scene.replace(seed=k + 1)
        single = stepping.run(one.problem, Numerics(scheme="extrapolated14", timestep=0.1))
        # In a single collision, a chain whose bonds break is also followed with other steps, which
        # may give another ending.
        assert single.ending.kind in ("proved" if found.proved[k] else "argued", "open")
        assert found.counts[k] == len(single.contact_times)


@pytest.mark.slow
def test_steps_that_resolve_nothing_settle_nothing():
    lines = lines_of(WARM.replace(velocity=3.0), 3)
    batch = Batch(lines[0], WARM.bond, "extrapolated14")
    found = batch.follow(StartStates.of(lines), np.full(3, 1.1))
    assert not np.any(found.settled)


def test_stopped_collisions_are_left_at_once():
    lines = lines_of(WARM, 3)
    batch = Batch(lines[0], WARM.bond, "extrapolated14")
    batch.stopped = True
    with pytest.raises(RunError, match="stopped"):
        batch.follow(StartStates.of(lines), np.full(3, 0.1))


@pytest.mark.parametrize(
    ("fields", "served"),
    [
        ({}, True),
        ({"target_particles": 3}, False),
        ({"target_particles": 1}, False),
        ({"contact": "power"}, False),
        ({"particles": 1, "masses": (2.0,)}, False),
    ],
)
def test_hard_rigid_walls_are_served(fields, served):
    scene = WARM.replace(**fields)
    assert supports(scene.line, scene.bond) == served
