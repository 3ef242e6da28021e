"""Test the runs without one source of error, and the error budget from these runs."""

import numpy as np
import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.tradeoff.budget import (
    measure_budget,
    measure_tables,
    printed_restitution,
)
from chaincor.workflows.tradeoff.oracles import (
    lepton_formula,
    restitution_with_exact_bonds,
    restitution_without_rounding,
    wider_floats,
)
from chaincor.workflows.tradeoff.reference_solution import find_reference

SCENE = Scene(particles=6)
needs_wider_floats = pytest.mark.skipif(not wider_floats(), reason="long double is a double")


@pytest.fixture(scope="module")
def reference_value():
    return find_reference(SCENE)


@pytest.mark.parametrize("scheme", ["verlet", "order6"])
def test_exact_bonds_agree_with_a_spline_table_of_many_rows(scheme):
    numerics = Numerics(scheme=scheme, timestep=0.05, bond_range=(0.9, 1.2))
    outcome = lammps.run(SCENE.problem, numerics)
    exact = restitution_with_exact_bonds(SCENE, numerics, outcome)
    # The tolerance is the certified force error, 3e-14, divided by v0 = 0.05, times some tens of
    # time units.
    assert outcome.eta == pytest.approx(exact, abs=1e-10)


@needs_wider_floats
@pytest.mark.parametrize("potential", ["harmonic", "lj", "toda", "log"])
@pytest.mark.parametrize("scheme", ["verlet", "order8"])
def test_wider_floats_take_the_same_steps(potential, scheme):
    fields = {"velocity": 0.1} if potential == "harmonic" else {"speed": 0.2}
    scene = Scene(potential=potential, particles=6, **fields)
    numerics = Numerics(scheme=scheme, timestep=0.1)
    outcome = lammps.run(scene.problem, numerics)
    smooth = restitution_without_rounding(scene, numerics, outcome)
    # The tolerance is the rounding of coordinates of 6, 1e-15, divided by v0 = 0.03, in some
    # hundred steps. The error of the steps, which is common to both runs, is at least 1e-8.
    assert outcome.eta == pytest.approx(smooth, abs=1e-11)


def test_a_bond_given_by_a_file_has_no_formula(tmp_path):
    assert "^" in lepton_formula(SCENE)
    lengths = np.linspace(0.8, 1.5, 200)
    rows = "\n".join(
        f"{k} {r:.17g} {0.5 * (r - 1) ** 2:.17g} {1 - r:.17g}" for k, r in enumerate(lengths, 1)
    )
    (tmp_path / "bond.table").write_text(f"BOND\nN 200\n\n{rows}\n")
    scene = Scene(
        potential="table", bond_file=str(tmp_path / "bond.table"), particles=4, velocity=0.1
    )
    assert lepton_formula(scene) is None


@needs_wider_floats
def test_the_parts_of_an_event_wall_budget_make_up_its_error(reference_value):
    numerics = Numerics(scheme="order6", timestep=0.2, bond_range=(0.9, 1.2))
    budget = measure_budget(reference_value, "advised", numerics, phases=1, oracle_seconds=5.0)
    assert budget.wall is None
    assert budget.integrator > 1e3 * max(budget.table, budget.rounding)
    parts = budget.integrator + budget.table + budget.rounding
    assert budget.total == pytest.approx(parts, rel=1e-2)
    assert budget.output_exact == 0.0
    assert budget.output > 0.0


def test_the_stock_recipes_error_is_the_walls(reference_value):
    numerics = Numerics(wall="reflect", scheme="verlet", timestep=0.005, bond_range=(0.9, 1.2))
    budget = measure_budget(reference_value, "stock", numerics, phases=4, oracle_seconds=0.0)
    assert budget.wall > 10.0 * abs(budget.total - budget.wall)
    # Without time for the slow oracles, their parts are unknown.
    assert budget.table is None
    assert budget.integrator is None
    assert budget.rounding is None


def test_six_digits_cost_more_than_seventeen():
    outcome = lammps.run(SCENE.problem, Numerics(scheme="order6", timestep=0.1))
    eta = outcome.eta
    assert printed_restitution(SCENE, outcome, "%.17g") == eta
    # The error is half a unit of the sixth digit of velocities near v0, relative, times two because
    # eta is a square.
    assert 0.0 < abs(printed_restitution(SCENE, outcome, "%g") - eta) < 2e-5


@pytest.mark.slow
def test_errors_of_tables_fall_with_their_rows_and_with_a_narrower_range(reference_value):
    numerics = Numerics(scheme="order6", timestep=0.1, bond_range=reference_value.bond_range)
    outcome = lammps.run(SCENE.problem, numerics)
    exact = restitution_with_exact_bonds(SCENE, numerics, outcome)
    points = {
        (p.style, p.bond_range, p.rows): p
        for p in measure_tables(reference_value, numerics, exact, quick=False)
    }
    narrow = points["linear", "scene", 1001].force_error
    wide = points["linear", "wide", 1001].force_error
    # Linear interpolation has an error of U''' times the squared spacing divided by 8.
    assert points["linear", "scene", 101].force_error == pytest.approx(100 * narrow, rel=0.3)
    ratio = (1.0 / np.ptp(reference_value.bond_range)) ** 2
    assert wide > ratio * narrow
    assert points["spline", "scene", 1001].force_error < 1e-5 * narrow
    assert points["linear", "scene", 101].restitution_error > 1e-7
    assert points["spline", "scene", 1001].restitution_error < 1e-10
