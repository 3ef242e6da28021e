"""Test that error bars of explicit numerics are valid for both walls and every scheme."""

import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.bounded_run import PROOF_SHARE, error_bar
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.reference import modal


def exact(scene):
    """Return eta by modes, or by the reference engine to 1e-11."""
    return collide(scene.replace(engine="reference"), tolerance=1e-11)


# LAMMPS's Verlet has an error of c h^2 in harmonic chains, with a small c. Contacts that graze the
# wall add an error of this size. At these lengths, the difference to a single run at h/2 is far too
# small.
@pytest.mark.parametrize("particles", [pytest.param(42, marks=pytest.mark.slow), 65, 80])
def test_near_grazing_contacts_are_in_the_bar_of_the_event_wall(particles):
    scene = Scene(potential="harmonic", particles=particles)
    reference_value = exact(scene)
    result = collide(scene.replace(scheme="verlet", timestep=0.005))
    error = abs(result.restitution - reference_value.restitution)
    assert error <= result.restitution_error + reference_value.restitution_error
    # The error bar is not too wide, because the error is c h^2 with c below 1.
    assert result.restitution_error <= 0.005**2


@pytest.mark.parametrize("timestep", [0.01, 0.014233, 0.01873, 0.0237])
def test_the_bar_of_the_stock_wall_holds(timestep):
    scene = Scene(potential="lj", particles=10, speed=0.4)
    reference_value = exact(scene)
    result = collide(
        scene.replace(wall="reflect", scheme="verlet", timestep=timestep, table="linear")
    )
    error = abs(result.restitution - reference_value.restitution)
    assert error <= result.restitution_error + reference_value.restitution_error
    # Each of up to n contacts has an error of up to 2 a h/(n v0), with a below v0. If all errors
    # have the same sign, their sum is 2 h. The error bar multiplies the difference between runs by
    # PROOF_SHARE.
    assert result.restitution_error <= 2.0 * PROOF_SHARE["reflect"] * timestep


@pytest.mark.slow
def test_the_bar_of_the_stock_wall_of_the_readme_holds():
    # At this phase, the difference to the run at half the step is small by chance: three times the
    # difference is 5.9e-6.
    eta = 0.77079983
    result = collide(Scene(wall="reflect", scheme="verlet", timestep=0.01, table="linear"))
    assert abs(result.restitution - eta) <= result.restitution_error
    assert result.restitution_error <= 1e-2


def test_extrapolated_steps_in_lammps_have_a_bar():
    scene = Scene(potential="harmonic", particles=10, velocity=1e-5)
    outcome = lammps.run(scene.problem, Numerics(scheme="extrapolated14", timestep=0.4))
    bar = error_bar(outcome, 1e-12)
    reference_value = modal.run(scene.problem).eta
    assert abs(outcome.eta - reference_value) <= bar.total
    # Extrapolation amplifies rounding, 10 eps/v0 = 2e-10, by 6, and the collision by some tens at
    # most.
    assert bar.total <= 1e-7
