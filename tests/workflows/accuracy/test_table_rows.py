"""Test that the error bar covers the uncertainty from rows and digits of a bond table."""

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy import table_rows
from chaincor.workflows.collision import collide

KNOWN = Scene(potential="lj", particles=12, speed=0.4, engine="reference")


@pytest.fixture(scope="module")
def exact():
    return collide(KNOWN, tolerance=1e-9).restitution


def tabulated(folder, rows, digits=15, noise=0.0, engine="reference"):
    lengths = np.linspace(0.78, 1.6, rows)
    forces = LennardJones().force(lengths - 1.0)
    forces += noise * np.random.default_rng(3).standard_normal(rows)
    lines = [
        f"{i} {length:.15g} 0 {force:.{digits}g}"
        for i, (length, force) in enumerate(zip(lengths, forces, strict=True), 1)
    ]
    path = folder / "rows.table"
    path.write_text("\n".join(["LJ", f"N {rows}", "", *lines, ""]))
    return Scene(
        potential="table",
        bond_file=path,
        particles=KNOWN.particles,
        velocity=KNOWN.impact_velocity,
        engine=engine,
        tolerance=1e-6,
    )


@pytest.mark.parametrize(
    ("rows", "digits", "noise"),
    [
        (14, 15, 0.0),
        pytest.param(30, 15, 0.0, marks=pytest.mark.slow),
        pytest.param(200, 4, 0.0, marks=pytest.mark.slow),
        pytest.param(200, 15, 1e-5, marks=pytest.mark.slow),
    ],
)
def test_the_bar_holds_and_is_no_shrug(tmp_path, exact, rows, digits, noise):
    found = collide(tabulated(tmp_path, rows, digits, noise))
    off = abs(found.restitution - exact)
    # The uncertainty from such rows is far above 1e-6, the accuracy for the spline itself.
    assert 1e-6 < off <= found.restitution_error < 0.5
    assert found.tolerance_met is False
    assert "most of it" in found.reason
    assert "table: give a table with more rows or more digits" in found.reason


def test_a_state_with_velocities_keeps_them_with_other_rows(tmp_path):
    (tmp_path / "state.csv").write_text("strain,velocity\n0,-0.05\n0.02,-0.08\n-0.02,-0.03\n")
    moving = {"particles": 3, "initial": tmp_path / "state.csv", "velocity": None}
    scene = tabulated(tmp_path, 30).replace(**moving)
    exact = collide(KNOWN.replace(speed=None, **moving), tolerance=1e-9).restitution
    found = collide(scene)
    # The uncertainty from thirty rows exceeds the tolerance, so that altered tables are run.
    assert found.error_parts.table > 1e-7
    assert abs(found.restitution - exact) <= found.restitution_error < 0.01


def test_many_rows_with_all_digits_leave_nothing_open(tmp_path, exact, monkeypatch):
    # The rows alone show this, so that no collision is computed with altered rows.
    monkeypatch.setattr(table_rows, "_bond_of", None)
    found = collide(tabulated(tmp_path, 2000))
    assert abs(found.restitution - exact) <= found.restitution_error <= 1e-6
    assert found.tolerance_met


@pytest.mark.slow
@pytest.mark.parametrize("first", np.linspace(0.75, 0.75 + 0.9 * 1.15 / 59, 5))
def test_the_bar_holds_wherever_the_natural_length_lies_between_two_rows(tmp_path, first):
    # With sixty rows, an error bar with half the factor is too small if length 1 is near a row.
    known = Scene(potential="lj", particles=100, speed=0.4, engine="reference")
    lengths = first + np.linspace(0.0, 1.15, 60)
    rows = zip(lengths, known.bond.force(lengths - 1.0), strict=True)
    path = tmp_path / "rows.table"
    lines = [f"{i} {length:.15g} 0 {force:.15g}" for i, (length, force) in enumerate(rows, 1)]
    path.write_text("\n".join(["LJ", "N 60", "", *lines, ""]))
    table = known.replace(
        potential="table", bond_file=path, speed=None, velocity=known.impact_velocity
    )
    found, exact = collide(table, tolerance=1e-6), collide(known, tolerance=1e-9)
    off = abs(found.restitution - exact.restitution)
    assert 1e-7 < off <= found.restitution_error < 1e-3


@pytest.mark.slow
def test_both_engines_have_the_same_bar_of_the_table(tmp_path):
    parts = [
        collide(tabulated(tmp_path, 30, engine=engine)).error_parts.table
        for engine in ("reference", "lammps")
    ]
    # LAMMPS's own table adds far less than the tolerance. Each engine samples strains at the ends
    # of its own steps, which miss up to 1 % of the largest strain (``bond_error``).
    assert parts[1] == pytest.approx(parts[0], abs=1e-6, rel=0.05)


@pytest.mark.slow
def test_rows_that_may_stand_for_another_chain_are_refused_or_wide(tmp_path):
    # Near the core, rows are so far apart that the force between them is unknown.
    scene = tabulated(tmp_path, 9)
    try:
        error = collide(scene).restitution_error
    except TableError:
        error = 1.0
    assert error > 1e-2
