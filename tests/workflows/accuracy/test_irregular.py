"""Test that error bars are valid for bonds of unknown smoothness, or that scenes are refused."""

import math

import numpy as np
import pytest

from benchmarks.bars.user_scenes import Bend, bent_energy, bent_force
from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy import irregular
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps.certificate import certify_table
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.reference import kernels
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import BondRangeError, CrossingError
from tests.judge.kinks import judge

# These values come from steps of order 8 that end at the wall and at the kink. Results at the two
# largest steps agree to 1e-12.
SLACK_AT_0_1 = {5: 0.9024074802364, 10: 0.9347139830169, 20: 0.9598717615637}


def slack(**options):
    """Return a bond without tension."""
    return UserBond(
        lambda s: 0.5 * np.minimum(s, 0.0) ** 2, lambda s: -np.minimum(s, 0.0), **options
    )


# All tests share one bond, because each bond has its own loops, which take seconds to compile.
SLACK = slack(kinks=(0.0,))


@pytest.mark.slow
def test_the_judge_agrees_with_itself():
    # The results at the two largest steps, and the stored value, differ only by rounding.
    eta, error = judge(bent_force, Bend(0.0, 0.0), 0.0, 10, 0.1)
    assert error < 1e-11
    assert eta == pytest.approx(SLACK_AT_0_1[10], abs=1e-11)


@pytest.mark.parametrize("particles", [5, 10, pytest.param(20, marks=pytest.mark.slow)])
@pytest.mark.parametrize("engine", ["lammps", "reference"])
@pytest.mark.slow
def test_bars_hold_without_tension(engine, particles):
    scene = Scene(potential=SLACK, particles=particles, velocity=0.1, engine=engine)
    result = collide(scene, tolerance=1e-6)
    assert result.tolerance_met
    assert abs(result.restitution - SLACK_AT_0_1[particles]) <= result.restitution_error
    assert result.fragments > 1
    if engine == "lammps":
        assert result.table == "linear"


@pytest.mark.slow  # This compiles a loop.
@pytest.mark.parametrize("particles", [5, 10])
def test_rounding_of_many_small_steps_is_in_the_bar(particles):
    # At this tolerance, Verlet takes millions of steps. Their rounding error exceeds that of a
    # single eta.
    scene = Scene(potential=SLACK, particles=particles, velocity=0.1, engine="reference")
    result = collide(scene, tolerance=1e-11)
    assert result.scheme == "verlet"
    assert result.error_parts.rounding > 1e-12
    # The known values have 13 digits.
    assert abs(result.restitution - SLACK_AT_0_1[particles]) <= result.restitution_error + 5e-14


@pytest.mark.slow
def test_a_late_contact_without_tension_is_found():
    # Without a binding force, a slow particle may reach the wall arbitrarily late: the 35th contact
    # comes 130 time units after the 34th. The judge gave this eta, with an error of 3e-15.
    scene = Scene(potential=SLACK, particles=39, velocity=0.042123547374017994, engine="reference")
    result = collide(scene, tolerance=1e-5)
    assert result.contacts == 35
    assert result.ending == "proved"
    assert abs(result.restitution - 0.9579712463913247) <= result.restitution_error


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["lammps", "reference"])
@pytest.mark.parametrize(("stiffness", "strain"), [(4.0, 0.0), (0.5, -0.03)])
def test_bars_hold_with_kinks_nobody_named(engine, stiffness, strain):
    bond = UserBond(
        lambda s: bent_energy(s, Bend(stiffness, strain)),
        lambda s: (
            -s
            + (1.0 - stiffness)
            * (np.maximum(s - strain, 0.0) if strain >= 0.0 else np.minimum(s - strain, 0.0))
        ),
    )
    reference_value, _ = judge(bent_force, Bend(stiffness, strain), strain, 8, 0.1)
    scene = Scene(potential=bond, particles=8, velocity=0.1, engine=engine)
    result = collide(scene, tolerance=1e-5)
    assert result.tolerance_met
    assert abs(result.restitution - reference_value) <= result.restitution_error


@pytest.mark.slow
def test_a_kink_out_of_reach_costs_nothing():
    bond = UserBond(
        lambda s: 0.5 * s**2 + 4.0 * s**4 + np.maximum(s - 0.5, 0.0) ** 2,
        lambda s: -s - 16.0 * s**3 - 2.0 * np.maximum(s - 0.5, 0.0),
    )
    assert bond.kinks == (0.5,)
    result = collide(
        Scene(potential=bond, particles=5, velocity=0.1, engine="reference"), tolerance=1e-7
    )
    assert result.tolerance_met
    assert result.scheme == "order8"


@pytest.mark.slow
def test_a_tolerance_out_of_reach_is_said_to_be(monkeypatch):
    monkeypatch.setattr(irregular, "_MOST_BOND_STEPS", 2e4)
    scene = Scene(potential=SLACK, particles=5, velocity=0.1, engine="reference")
    result = collide(scene, tolerance=1e-12)
    assert not result.tolerance_met
    assert "most of it" in result.reason
    assert abs(result.restitution - SLACK_AT_0_1[5]) <= result.restitution_error


@pytest.mark.slow
@pytest.mark.parametrize(
    "force",
    [lambda s: np.where(s < 0.0, -s, -s), lambda s: -s - 0.0 * math.exp(-s)],
    ids=["where", "exp"],
)
@pytest.mark.parametrize("engine", ["lammps", "reference"])
def test_any_function_runs(engine, force):
    bond = UserBond(lambda s: 0.5 * s**2, force, strain_max=5.0)
    plain = Scene(potential="harmonic", particles=3, velocity=0.1, engine="reference")
    scene = Scene(potential=bond, particles=3, velocity=0.1, engine=engine)
    result = collide(scene, tolerance=1e-4)
    reference_value = collide(plain).restitution
    assert abs(result.restitution - reference_value) <= result.restitution_error <= 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["lammps", "reference"])
def test_particles_that_would_pass_through_each_other_are_named(engine):
    bond = UserBond(lambda s: 0.5 * s**2, lambda s: -s)
    scene = Scene(potential=bond, particles=5, velocity=0.9, engine=engine)
    with pytest.raises(CrossingError, match="two particles meet"):
        collide(scene, tolerance=1e-4)


def test_loops_of_users_bonds_do_not_pile_up():
    for cached in (kernels._kernels_for, kernels._compile):
        assert cached.cache_info().maxsize is not None
    scheme = STEP_SCHEMES["verlet"]
    bonds = [slack(name=f"bond {k}") for k in range(2)]
    assert kernels.kernels_for(bonds[0], scheme) is kernels.kernels_for(bonds[0], scheme)
    assert kernels.kernels_for(bonds[0], scheme) is not kernels.kernels_for(bonds[1], scheme)


def test_the_certificate_looks_at_kinks(tmp_path):
    # Within two rows of a kink, a spline has an error of 0.08 times the jump of the stiffness times
    # the spacing. With 20001 rows, a sample of 4001 lengths may miss this error.
    bond = SLACK
    scene = Scene(potential=bond, particles=3, velocity=0.1)
    errors = {}
    for style in ("spline", "linear"):
        table = tabulate(bond, (0.9, 1.1), style, 20_001)
        with LammpsChain(scene.problem, Numerics(table=style), table, tmp_path) as chain:
            errors[style] = certify_table(chain, table, bond).force_error
    assert 0.03 * table.spacing < errors["spline"] < 0.3 * table.spacing
    assert errors["linear"] < 1e-13


@pytest.mark.slow
def test_given_numerics_have_bars_that_hold_past_kinks():
    scene = Scene(potential=SLACK, particles=5, velocity=0.1, engine="reference", scheme="verlet")
    for step in np.geomspace(0.01, 0.1, 12).tolist():
        result = collide(scene.replace(timestep=step))
        assert abs(result.restitution - SLACK_AT_0_1[5]) <= result.restitution_error


def test_a_table_that_is_too_narrow_is_named_at_once(tmp_path, monkeypatch):
    table = tabulate(Scene().bond, (0.98, 1.02), "spline", 101)
    (tmp_path / "narrow.table").write_text(table.to_text())
    # Each halving of the step doubles the time until the refusal.
    monkeypatch.setattr(irregular, "_MOST_REFINEMENTS", 6)
    scene = Scene(
        potential="table", bond_file=tmp_path / "narrow.table", particles=20, velocity=0.05
    )
    with pytest.raises(BondRangeError, match="its data reach from"):
        collide(scene)
