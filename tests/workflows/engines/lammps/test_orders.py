"""Test that the error of eta has the declared order of each composition."""

import numpy as np
import pytest

from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import COMPOSITIONS
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.engines.schemes import STEP_SCHEMES

SCENE = Scene(potential="lj", particles=10, speed=0.4)
BOND_RANGE = (0.85, 1.3)
# These are eight steps within 3 %. After five or more steps, contacts have a different phase in
# each run. The mean square of the errors is thus an average over the phases of contacts.
PHASES = 1.0 + 0.03 * np.linspace(-0.5, 0.5, 8)
RANGES = {
    "verlet": (0.005, 0.05),
    "order4": (0.02, 0.2),
    "order6": (0.05, 0.2),
    "order8": (0.15, 0.4),
}


def restitution_of(run, scheme, timestep):
    outcome = run(SCENE.problem, Numerics(scheme=scheme, timestep=timestep, bond_range=BOND_RANGE))
    return float(restitution(outcome.velocities, SCENE.impact_velocity))


@pytest.fixture(scope="module")
def reference_value():
    """Return eta by the reference engine, with an error of 1e-13."""
    return restitution_of(stepping.run, "order8", 0.03)


def rms_errors(scheme, timesteps, reference_value):
    return [
        np.sqrt(
            np.mean(
                [
                    (restitution_of(lammps.run, scheme, h * p) - reference_value) ** 2
                    for p in PHASES.tolist()
                ]
            )
        )
        for h in timesteps.tolist()
    ]


@pytest.mark.slow
@pytest.mark.parametrize("scheme", RANGES)
def test_fitted_order(scheme, reference_value):
    timesteps = np.geomspace(*RANGES[scheme], 8)
    errors = rms_errors(scheme, timesteps, reference_value)
    slope = np.polyfit(np.log(timesteps), np.log(errors), 1)[0]
    # Irregular phases of contacts give a fit over eight steps an uncertainty of 0.3.
    assert slope == pytest.approx(COMPOSITIONS[scheme].order, abs=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["extrapolated12", "extrapolated14"])
def test_extrapolated_steps_converge_at_their_order_down_to_rounding(scheme, reference_value):
    timesteps = np.geomspace(0.34, 1.0, 10)
    slope = np.polyfit(
        np.log(timesteps), np.log(rms_errors(scheme, timesteps, reference_value)), 1
    )[0]
    # The steps are as long as the time between contacts. The position of a contact in its step
    # changes the error by a factor of ten; over a range of steps of three, this changes the slope
    # by 2.
    assert slope == pytest.approx(STEP_SCHEMES[scheme].order, abs=2.0)
    # Extrapolation multiplies the rounding of coordinates up to 10 by up to 60, relative to v0 =
    # 0.05.
    assert rms_errors(scheme, np.array([0.25]), reference_value)[0] < 1e-10


def test_the_reflecting_wall_is_far_from_second_order(reference_value):
    # The error of the stock wall is of first order and of either sign.
    def error(wall, timestep):
        numerics = Numerics(wall=wall, scheme="verlet", timestep=timestep, bond_range=BOND_RANGE)
        outcome = lammps.run(SCENE.problem, numerics)
        return abs(restitution(outcome.velocities, SCENE.impact_velocity) - reference_value)

    steps = (0.005 * PHASES).tolist()
    stock = np.sqrt(np.mean([error("reflect", h) ** 2 for h in steps]))
    event = np.sqrt(np.mean([error("event", h) ** 2 for h in steps]))
    assert stock > 10.0 * event
