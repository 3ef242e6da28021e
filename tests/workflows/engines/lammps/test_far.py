"""Test bonds that change to the far table, and several runs in one LAMMPS instance."""

from dataclasses import replace

import numpy as np
import pytest

from chaincor.lammps_inputs.bond_table import (
    FAR_BACK,
    FAR_OUT,
    FAR_START,
    NEAR_END,
    tabulate_near_and_far,
)
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps.instance import LammpsChain

RANGE = (0.8, 25.0)


def eta(outcome, scene):
    return (outcome.velocities.mean() / scene.impact_velocity) ** 2


def test_two_tables_overlap_where_bonds_change_over():
    table = tabulate_near_and_far(LennardJones(), RANGE)
    assert table.lengths[0] < 0.8
    assert table.far.lengths[0] < FAR_START < FAR_BACK < FAR_OUT < NEAR_END < table.lengths[-1]
    assert table.far.lengths[-1] == table.longest > 25.0
    assert table.far.rows == table.rows
    assert tabulate_near_and_far(LennardJones(), (0.8, 3.0)).far is None


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["verlet", "order8"])
@pytest.mark.parametrize("speed", [0.85, 2.0])
def test_two_tables_give_the_result_of_one(scheme, speed):
    scene = Scene(particles=25, speed=speed)
    step = {"verlet": 0.005, "order8": 0.05}[scheme]
    numerics = Numerics(scheme=scheme, timestep=step, bond_range=RANGE)
    two = lammps.run(scene.problem, numerics)
    one = lammps.run(scene.problem, replace(numerics, table_points=150_001))
    assert two.details["table"]["rows"] < 30_000
    assert len(two.contact_times) == len(one.contact_times)
    # The limit is the sum of force errors of the two tables, below 1e-9 here, divided by v0: see
    # TABLE_SENSITIVITY.
    allowed = sum(run.details["table"]["force_error"] for run in (one, two))
    assert allowed < 1e-9
    assert abs(eta(two, scene) - eta(one, scene)) < 10 * allowed / scene.impact_velocity


def test_bonds_go_out_and_come_back(tmp_path):
    scene = Scene(particles=3)
    table = tabulate_near_and_far(scene.bond, RANGE)
    with LammpsChain(
        scene.problem, Numerics(scheme="verlet", timestep=1e-6), table, tmp_path
    ) as chain:
        chain.v[:] = 0.0
        for length, far in ((2.0, False), (2.2, True), (24.0, True), (1.95, True), (1.85, False)):
            chain.x[2] = chain.x[1] + length
            chain.far_bonds.change_tables()
            assert chain.far_bonds.far.tolist() == [False, far]
            chain.run(1)
            # The force on the last particle is that of its bond; in a step of 1e-6, particles
            # hardly move.
            expected = scene.bond.force(length - 1.0)
            assert chain.f[2] == pytest.approx(expected, abs=1e-11)


def test_a_state_put_back_has_its_tables_back(tmp_path):
    """Restore the state from before a look ahead in which a bond broke."""
    scene = Scene(particles=3)
    table = tabulate_near_and_far(scene.bond, RANGE)
    with LammpsChain(
        scene.problem, Numerics(scheme="verlet", timestep=1e-6), table, tmp_path
    ) as chain:
        chain.v[:] = 0.0
        chain.x[2] = chain.x[1] + 0.9
        chain.run(1)
        state = chain.snapshot()
        chain.x[2] = chain.x[1] + 24.0
        chain.far_bonds.change_tables()
        chain.restore(state)
        for now, then in zip((chain.x, chain.v, chain.f), state[:3], strict=True):
            np.testing.assert_array_equal(now, then)
        chain.run(1)  # out of range of the far table
        assert chain.f[2] == pytest.approx(scene.bond.force(-0.1), abs=1e-11)
        # This also works for a length in the range of both tables.
        chain.x[2] = chain.x[1] + 0.5 * (FAR_BACK + FAR_OUT)
        state = chain.snapshot()
        chain.x[2] = chain.x[1] + 24.0
        chain.far_bonds.change_tables()
        chain.restore(state)
        assert not chain.far_bonds.far.any()


@pytest.mark.slow
def test_a_chain_that_breaks_and_hits_again_is_followed():
    """Compare log, n = 100, 1.122 v*, with the reference engine: 0.78340539076 to 2e-10."""
    result = collide(Scene(potential="log", particles=100, speed=1.12201845), tolerance=1e-5)
    assert result.fragments == 1
    assert abs(result.restitution - 0.78340539) < result.restitution_error < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.1, 2.0])
@pytest.mark.parametrize("scheme", ["verlet", "order6"])
def test_runs_in_one_instance_are_those_of_their_own(scheme, speed):
    scene = Scene(particles=12, speed=speed)
    numerics = Numerics(scheme=scheme, bond_range=RANGE)
    steps = (0.02, 0.01, 0.02)
    together = lammps.run_at_steps(scene.problem, numerics, steps)
    for step, outcome in zip(steps, together, strict=True):
        alone = lammps.run(scene.problem, replace(numerics, timestep=step))
        np.testing.assert_array_equal(outcome.velocities, alone.velocities)
        np.testing.assert_array_equal(outcome.contact_times, alone.contact_times)
        assert outcome.timestep == step
