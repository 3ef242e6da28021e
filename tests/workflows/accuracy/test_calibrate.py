"""Test that calibrated costs belong to a machine and predict the time of a run."""

from dataclasses import asdict

import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.cost_model import CostModel, calibrate
from chaincor.workflows.engines.lammps import engine as lammps


@pytest.fixture(scope="module")
def model():
    return calibrate(repeats=2)


@pytest.mark.slow
def test_every_cost_is_positive_and_splines_cost_more_than_springs(model):
    costs = {k: v for k, v in asdict(model).items() if k != "measured_on"}
    assert min(costs.values()) > 0.0
    # A harmonic bond takes three operations, a table a look-up and an interpolation.
    assert model.spline_bond > model.harmonic_bond
    # The commands of a stage cost more than the bonds of a short chain, so that blind windows save
    # time.
    assert model.stage > 20 * model.spline_bond


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "step"), [("verlet", 0.0125), ("order8", 0.2)])
def test_the_work_of_a_run_is_predicted(scheme, step):
    # Seconds depend on the machine and its load, but the number of force evaluations does not.
    counted = CostModel("no machine", 1.0, 0.0, 0.0, 0.0, stage=0.0, contact=0.0)
    scene = Scene(particles=60)
    numerics = Numerics(scheme=scheme, timestep=step, bond_range=(0.92, 1.17))
    (outcome,) = lammps.run_at_steps(scene.problem, numerics, (step,))
    expected = counted.integration(scene.problem, numerics, float(outcome.contact_times[-1]))
    # The prediction leaves out the flight after the last contact, 3.5 of 90, and the search for
    # contacts.
    assert 0.9 < outcome.force_evaluations / expected < 1.3
