"""Test that objects that cannot be pickled are refused with one message for all destinations."""

import pytest

from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.pool import ProcessPool
from chaincor.workflows.errors import SweepError
from chaincor.workflows.validation.user_integrator import UserIntegratorError, run_user_integrator

WORDS = r"cannot be sent to {} \(.*<lambda>.*\)\. Define the functions of bonds at the "


def test_to_a_worker_and_to_an_integrator_of_the_users():
    bond = UserBond(energy=lambda s: 0.5 * s**2, force=lambda s: -s)
    scene = Scene(potential=bond, particles=3, velocity=0.1)
    with (
        ProcessPool(1) as pool,
        pytest.raises(SweepError, match="^a task " + WORDS.format("a worker process")),
    ):
        pool.submit(repr, scene).result()
    with pytest.raises(UserIntegratorError, match="^the scene " + WORDS.format("mine:function")):
        run_user_integrator("mine:function", scene, timeout=600.0)
