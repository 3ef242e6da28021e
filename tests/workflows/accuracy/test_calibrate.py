"""Calibration: costs that are a machine's, and that foretell the time of a run."""

import time
from dataclasses import asdict

import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.calibrate import calibrate
from chaincor.workflows.engines.lammps import engine as lammps


@pytest.fixture(scope="module")
def model():
    return calibrate(repeats=2)


def test_every_cost_is_positive_and_splines_cost_more_than_springs(model):
    costs = {k: v for k, v in asdict(model).items() if k != "measured_on"}
    assert min(costs.values()) > 0.0
    # A spring is three operations, a table a look-up and an interpolation.
    assert model.spline_bond > model.harmonic_bond
    # The commands of a stage cost more than the bonds of a short chain: why blind windows pay.
    assert model.stage > 20 * model.spline_bond


@pytest.mark.parametrize(("scheme", "step"), [("verlet", 0.0125), ("order8", 0.2)])
def test_the_time_of_a_run_is_foretold(model, scheme, step):
    scene = Scene(particles=60)
    numerics = Numerics(scheme=scheme, timestep=step, bond_range=(0.92, 1.17))
    seconds = []
    for _ in range(3):
        times = []
        # What two runs with one set-up take longer than one is a run.
        for runs in (1, 2):
            started = time.thread_time()
            outcome, *_ = lammps.run_at_steps(scene, numerics, (step,) * runs)
            times.append(time.thread_time() - started)
        seconds.append(times[1] - times[0])
    expected = model.integration(
        scene, numerics, outcome.duration, float(outcome.contact_times[-1])
    )
    # Other sizes of chain, and contacts that cost more or less: within a factor of two.
    assert 0.5 < min(seconds) / expected < 2.0
