"""Test that forces are read back from LAMMPS and show the errors of a wrong table."""

from dataclasses import replace

import numpy as np
import pytest

from chaincor.lammps_inputs.bond_table import MARGIN_BINS, tabulate
from chaincor.lammps_inputs.bonds.potentials import LennardJones, Logarithmic, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps.certificate import certify_table
from chaincor.workflows.engines.lammps.instance import LammpsChain

LJ = LennardJones()


def certificate(table, bond, folder):
    scene = Scene(potential=bond, particles=2, velocity=0.01)
    with LammpsChain(scene.problem, Numerics(), table, folder) as chain:
        return certify_table(chain, table, bond)


@pytest.mark.parametrize("bond", [LJ, Toda(), Logarithmic(), Power(3, -1.0)], ids=lambda b: b.name)
def test_a_default_spline_table_is_exact_to_rounding(bond, tmp_path):
    table = tabulate(bond, (0.85, 1.25))
    found = certificate(table, bond, tmp_path)
    largest = np.max(np.abs(table.forces))
    # The number of rows is chosen for an error of 3e-13 times the largest force. Rounding of the
    # interpolation adds an error of this size.
    assert found.force_error <= 1e-12 * largest
    assert found.edge_force_error <= 1e-11 * largest
    assert found.energy_error <= 1e-12
    assert found.lengths_asked >= min(2 * table.rows, 4000)
    assert (found.style, found.rows) == ("spline", table.rows)
    assert (found.shortest, found.longest) == (table.lengths[0], table.lengths[-1])


@pytest.mark.parametrize(("style", "order"), [("spline", 4), ("linear", 2)])
def test_error_falls_with_the_order_of_the_interpolation(style, order, tmp_path):
    rows = np.array([201, 401, 801, 1601])
    errors = [
        certificate(tabulate(LJ, (0.85, 1.4), style, int(n)), LJ, tmp_path).force_error
        for n in rows
    ]
    slope = np.polyfit(np.log(1.0 / (rows - 1)), np.log(errors), 1)[0]
    # With fewer rows, the range is slightly wider, which makes the slope a few per cent steeper.
    assert slope == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("factor", [0.0, -1.0, 1.01])
def test_a_wrong_fp_is_seen_at_the_edges(factor, tmp_path):
    good = tabulate(LJ, (0.85, 1.4), rows=2001)
    wrong = replace(good, edge_slopes=tuple(factor * slope for slope in good.edge_slopes))
    right, spoilt = (certificate(table, LJ, tmp_path) for table in (good, wrong))
    # An error d of the end slope gives a force error of about 0.1 d h at the end, which falls by a
    # factor of 3.7 with each row.
    step = good.spacing * abs(factor - 1.0) * abs(good.edge_slopes[0])
    assert spoilt.edge_force_error > 0.05 * step
    assert spoilt.edge_force_error > 1e3 * right.edge_force_error
    assert spoilt.force_error < 0.1 * spoilt.edge_force_error, "the margin shields the inside"


def test_a_wrong_row_is_seen(tmp_path):
    good = tabulate(LJ, (0.85, 1.4), rows=501)
    forces = good.forces.copy()
    forces[200] += 1e-6
    found = certificate(replace(good, forces=forces), LJ, tmp_path)
    assert found.force_error > 0.5e-6


def test_lammps_reads_the_ends_within_the_margin(tmp_path):
    # Within a bin of a spline's end, LAMMPS reads beyond the table. Bonds of the range stay three
    # bins away.
    table = tabulate(LJ, (0.9, 1.1), rows=301)
    found = certificate(table, LJ, tmp_path)
    assert 0.9 - found.shortest > (MARGIN_BINS - 0.01) * table.spacing
    assert found.longest - 1.1 > (MARGIN_BINS - 0.01) * table.spacing
