"""Test the estimate of rounding errors."""

from dataclasses import replace

import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.engines.rounding import rounding_of


def test_rounding_grows_with_the_root_of_the_number_of_steps():
    scene = Scene(potential="lj", particles=3, engine="reference")
    coarse = stepping.run(scene.problem, Numerics(scheme="verlet", timestep=0.01))
    # The step is so short that the random walk exceeds the minimum rounding error.
    short = replace(coarse, timestep=1e-8)
    shorter = replace(coarse, timestep=1e-10)
    assert rounding_of(coarse) <= rounding_of(short)
    assert rounding_of(shorter) == pytest.approx(10.0 * rounding_of(short))
