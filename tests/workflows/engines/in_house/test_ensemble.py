"""Many collisions side by side: the motion of single ones, at the same step."""

import numpy as np
import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.in_house_runs import eta_of
from chaincor.workflows.engines.in_house import stepping
from chaincor.workflows.engines.in_house.lines.ensemble import ManyCollisions, serves
from chaincor.workflows.engines.in_house.lines.many_states import StartStates, chain_energies
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
@pytest.mark.slow
def test_it_is_the_motion_of_single_collisions(scheme, step):
    # More than lanes, so that some are filled again, and not a multiple of them.
    lines = lines_of(WARM, 21)
    many = ManyCollisions(lines[0], WARM.bond, scheme)
    found = many.run(StartStates.of(lines), step, None)
    assert np.all(found.settled)
    assert np.all(found.proved)
    for k in range(len(lines)):
        scene = WARM.replace(seed=k + 1)
        single = stepping.run(scene, Numerics(scheme=scheme, timestep=step))
        assert found.contacts[k] == len(single.contact_times)
        eta = (found.speeds[k] / WARM.impact_velocity) ** 2
        # Two programs of one map: they differ by roundings, which a dozen contacts amplify.
        assert eta == pytest.approx(eta_of(scene, single), rel=1e-9)
        assert found.last_contact_times[k] == pytest.approx(single.contact_times[-1], abs=1e-7)
        assert found.bond_min[k] == pytest.approx(single.bond_min, abs=1e-9)
        assert found.bond_max[k] == pytest.approx(single.bond_max, abs=1e-9)


@pytest.mark.slow
def test_a_comparison_ends_soon_after_the_known_last_contact():
    lines = lines_of(WARM, 5)
    many = ManyCollisions(lines[0], WARM.bond, "extrapolated14")
    starts = StartStates.of(lines)
    fine = many.run(starts, 0.1, None)
    again = many.run(starts, 0.1, fine)
    np.testing.assert_array_equal(again.speeds, fine.speeds)
    np.testing.assert_array_equal(again.contacts, fine.contacts)


@pytest.mark.slow
def test_bonds_that_break_are_looked_at_one_by_one():
    scene = Scene(potential="lj", particles=5, velocity=0.12, temperature=1e-3)
    lines = lines_of(scene, 6)
    energies = chain_energies(lines[0], scene.bond, StartStates.of(lines))
    assert np.all(energies > scene.bond.dissociation), "energy alone proves nothing here"
    found = ManyCollisions(lines[0], scene.bond, "extrapolated14").run(
        StartStates.of(lines), 0.1, None
    )
    assert np.any(found.settled)
    for k in np.flatnonzero(found.settled).tolist():
        one = scene.replace(seed=k + 1)
        single = stepping.run(one, Numerics(scheme="extrapolated14", timestep=0.1))
        # Alone, a chain whose bonds break is also followed by other motions, which may disagree.
        assert single.ending.kind in ("proved" if found.proved[k] else "argued", "open")
        assert found.contacts[k] == len(single.contact_times)


@pytest.mark.slow
def test_steps_that_resolve_nothing_settle_nothing():
    lines = lines_of(WARM.replace(velocity=3.0), 3)
    found = ManyCollisions(lines[0], WARM.bond, "extrapolated14").run(
        StartStates.of(lines), 1.1, None
    )
    assert not np.any(found.settled)


def test_stopped_collisions_are_left_at_once():
    lines = lines_of(WARM, 3)
    many = ManyCollisions(lines[0], WARM.bond, "extrapolated14")
    many.stopped[0] = True
    with pytest.raises(RunError, match="stopped"):
        many.run(StartStates.of(lines), 0.1, None)


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
    assert serves(scene.line, scene.bond) == served
