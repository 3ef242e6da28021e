"""The spline of a table as compiled loops evaluate it is SciPy's."""

import numpy as np
from scipy.interpolate import CubicSpline

from chaincor.lammps_inputs.bonds.table_bond import SplineBond, spline_force


def bond_through(rows, reach=0.0):
    # Unevenly far apart, so that no row is found by dividing.
    strains = np.sort(np.concatenate(([0.0], np.random.default_rng(2).uniform(-0.3, 0.5, rows))))
    return SplineBond(CubicSpline(strains, -strains + strains**2), "rows", reach)


def test_the_kernel_is_the_spline_at_rows_between_them_and_beyond():
    bond = bond_through(23, reach=0.05)
    knots = bond.force_spline.x
    strains = np.concatenate((knots, np.linspace(bond.strain_min, bond.strain_max, 501)))
    found = [spline_force(float(s), bond.parameters) for s in strains]
    # Four roundings of numbers below 1.
    np.testing.assert_allclose(found, bond.force(strains), rtol=1e-14, atol=4e-16)


def test_there_is_no_force_beyond_the_reach():
    bond = bond_through(9)
    for strain in (bond.strain_min - 1e-9, bond.strain_max + 1e-9, np.nan):
        assert np.isnan(spline_force(strain, bond.parameters))


def test_all_tables_share_compiled_loops():
    # Compiled once and kept, where each spline would otherwise be stepped by NumPy.
    assert bond_through(9).force_kernel is bond_through(12).force_kernel is spline_force
