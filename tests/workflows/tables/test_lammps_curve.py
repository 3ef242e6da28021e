"""Test the model of LAMMPS's tables against the installed LAMMPS."""

import numpy as np
import pytest

from chaincor.workflows.tables.lammps_curve import TableData, bitmap_lengths, lammps_curve
from chaincor.workflows.tables.lammps_run import run_lammps

_TURN = 2.0 * np.pi


def lennard_jones(r):
    s = r**-6
    return 4.0 * (s * s - s), 24.0 * (2.0 * s * s - s) / r


def cosines(a):
    return 3.0 * np.cos(a) + np.cos(3.0 * a - 0.3), 3.0 * np.sin(a) + 3.0 * np.sin(3.0 * a - 0.3)


def _write(path, columns, header):
    rows = zip(*columns, strict=True)
    lines = [f"{i} " + " ".join(f"{x:.17g}" for x in row) for i, row in enumerate(rows, 1)]
    path.write_text("\n".join(["KEY", header, "", *lines, ""]))


def _differs(path, table, style, rows, span, bits=None):
    """Return the largest relative difference of forces or energies from those of LAMMPS."""
    kind = table.kind
    period = table.period or 360.0
    given = run_lammps(path, "KEY", kind, style, bits or rows, span, 301, period=period)
    assert given.error == ""
    curve, at = lammps_curve(table, style, rows), given.lengths
    # Rounding may put the last length into a bin that LAMMPS does not have.
    off = [
        np.max(np.abs(mine - theirs)[:-1]) / np.max(np.abs(theirs))
        for mine, theirs in ((curve.force(at), given.forces), (curve.energy(at), given.energies))
    ]
    return max(off)


@pytest.mark.parametrize("slopes", [None, (-5000.0, 0.1)])
@pytest.mark.parametrize("kind", ["bond", "pair"])
@pytest.mark.parametrize("style", ["spline", "linear", "lookup"])
def test_bonds_and_pairs(tmp_path, kind, style, slopes):
    if kind == "bond" and style == "lookup":
        pytest.skip("LAMMPS has no such style")
    r = np.linspace(0.8, 2.5, 60)
    header = "N 60 R 0.8 2.5" if kind == "pair" else "N 60"
    if slopes:
        header += " {} {:g} {:g}".format("FPRIME" if kind == "pair" else "FP", *slopes)
    _write(tmp_path / "t", (r, *lennard_jones(r)), header)
    table = TableData(kind, r, *lennard_jones(r), slopes)
    for rows in (60, 33):
        # The tolerance covers rounding of numbers that differ by four powers of ten.
        assert _differs(tmp_path / "t", table, style, rows, (0.8, 2.5)) < 1e-11


@pytest.mark.parametrize("style", ["spline", "linear"])
def test_equal_steps_of_the_square(tmp_path, style):
    r = np.sqrt(np.linspace(0.64, 6.25, 60))
    _write(tmp_path / "t", (r, *lennard_jones(r)), "N 60 RSQ 0.8 2.5")
    table = TableData("pair", r, *lennard_jones(r), None)
    assert _differs(tmp_path / "t", table, style, 60, (0.8, 2.5)) < 1e-11


@pytest.mark.parametrize("bits", [8, 10])
def test_bitmaps(tmp_path, bits):
    r = bitmap_lengths(0.8, 2.5, bits)
    _write(tmp_path / "t", (r, *lennard_jones(r)), f"N {1 << bits} BITMAP 0.8 2.5")
    r = np.sort(r)
    table = TableData("pair", r, *lennard_jones(r), None, is_bitmap=True)
    # LAMMPS stores squares in single precision.
    span = (float(r[0]) * 1.0001, 2.499)
    assert _differs(tmp_path / "t", table, "bitmap", len(r), span, bits) < 1e-6


@pytest.mark.parametrize("style", ["spline", "linear"])
@pytest.mark.parametrize("slopes", [None, (0.003, -0.004)])
def test_angles(tmp_path, style, slopes):
    degrees = np.linspace(0.0, 180.0, 37)
    energies, forces = cosines(np.radians(degrees))
    header = "N 37" + (" FP {:g} {:g}".format(*slopes) if slopes else "")
    _write(tmp_path / "t", (degrees, energies, np.radians(forces)), header)
    table = TableData("angle", degrees, energies, np.radians(forces), slopes)
    assert _differs(tmp_path / "t", table, style, 50, (1.0, 179.0)) < 1e-11


@pytest.mark.parametrize("style", ["spline", "linear"])
@pytest.mark.parametrize("unit", ["DEGREES", "RADIANS"])
@pytest.mark.parametrize("has_forces", [True, False])
def test_dihedrals(tmp_path, style, unit, has_forces):
    phi = np.linspace(-np.pi, np.pi, 73)[:-1]
    energies, forces = cosines(phi)
    turn = 360.0 if unit == "DEGREES" else _TURN
    columns = [phi * turn / _TURN, energies, forces * _TURN / turn]
    _write(tmp_path / "t", columns, f"N 72 {unit}" + (" NOF" if not has_forces else ""))
    if not has_forces:
        columns[2] = np.full(72, np.nan)
    table = TableData("dihedral", *columns, None, period=turn)
    span = (-0.47 * turn, 0.52 * turn)
    assert _differs(tmp_path / "t", table, style, 50, span) < 1e-11
