"""Test users' tables: few digits suffice, faults are named, and loops evaluate SciPy's spline."""

import hashlib
import pickle

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.bonds.table_bond import SplineBond, read_bond_table, spline_force
from chaincor.lammps_inputs.bonds.table_rows import BondRows
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.scene import Scene


def write_table(path, digits, scale=1.0):
    # These rows do not contain length 1, as in a scaled table.
    strains = np.linspace(-0.0987655, 0.2, 401)
    rows = zip(scale * (1.0 + strains), LennardJones().force(strains), strict=True)
    lines = [f"{i} {r:.{digits}f} 0 {f:.{digits}f}" for i, (r, f) in enumerate(rows, 1)]
    path.write_text("\n".join(["KEY", "N 401", "", *lines, ""]))
    return path


@pytest.mark.parametrize("digits", [5, 8, 12])
def test_the_zero_is_found_within_the_digits(tmp_path, digits):
    bond = read_bond_table(write_table(tmp_path / "few.table", digits))
    assert abs(float(bond.force(0.0))) < 1e-9
    # Length 1 changes only in the last digits.
    assert abs(bond.strain_max - 0.2) < 3.0 * 10.0**-digits
    # Half a unit of each column enters the force, with a factor of 1.25 and a stiffness of up to
    # 13.
    strains = np.linspace(-0.05, 0.15, 50)
    allowed = 1e-9 + 20.0 * 10.0**-digits
    assert bond.force(strains) == pytest.approx(LennardJones().force(strains), abs=allowed)


def test_a_table_scaled_wrong_is_reported_with_its_zero(tmp_path):
    path = write_table(tmp_path / "wrong.table", 8, scale=1.05)
    with pytest.raises(TableError, match=r"The force is 0 at length 1\.05\d*\. Divide"):
        read_bond_table(path)


def test_scenes_of_one_table_share_its_bond(tmp_path):
    path = write_table(tmp_path / "t.table", 8)
    scene = Scene(potential="table", bond_file=path, particles=3, velocity=0.01)
    assert scene.replace(velocity=0.02).bond is scene.bond
    write_table(path, 7)
    assert scene.replace(velocity=0.02).bond is not scene.bond


def test_a_scene_of_a_table_can_be_sent_to_another_process(tmp_path):
    path = write_table(tmp_path / "t.table", 8)
    scene = Scene(potential="table", bond_file=path, particles=3, velocity=0.01)
    content = path.read_bytes()
    path.unlink()
    sent = pickle.loads(pickle.dumps(scene))
    # A table's content identifies its bond: each process has a single bond object with its compiled
    # loops.
    assert sent.bond is scene.bond
    assert sent.sha256 == scene.sha256
    assert sent.canonical_fields["bond_file"] == hashlib.sha256(content).hexdigest()


@pytest.mark.parametrize("word", ["1e400", "-1e400"])
def test_numbers_beyond_all_are_refused(tmp_path, word):
    path = write_table(tmp_path / "huge.table", 8)
    lines = path.read_text().splitlines()
    index, length, energy, _ = lines[20].split()
    lines[20] = f"{index} {length} {energy} {word}"
    path.write_text("\n".join(lines))
    with pytest.raises(TableError, match=r"inf' in row 18. Give a finite length"):
        read_bond_table(path)
    for row in (20, 21):
        lines[row] = f"{index} {word} {energy} 0"
    path.write_text("\n".join(lines))
    with pytest.raises(TableError, match=r"inf 0 0' in row 18. Give .* lengths increase"):
        read_bond_table(path)


def honest_rows(rows=401):
    """Return lengths, energies and forces, and the slopes of the force at both ends."""
    strains, bond = np.linspace(-0.1, 0.2, rows), LennardJones()
    data = np.transpose([1.0 + strains, bond.energy(strains), bond.force(strains)])
    return data, (-bond.curvature(strains[[0, -1]])).tolist()


def write_rows(path, data, header, form="%.9g"):
    rows = [f"{i} " + " ".join(form % x for x in row) for i, row in enumerate(data, 1)]
    path.write_text("\n".join(["KEY", header, "", *rows, ""]))
    return path


@pytest.mark.parametrize("form", ["%.3f", "%.5g", "%.17g"])
@pytest.mark.parametrize("rows", [11, 50, 2000])
def test_honest_tables_contradict_themselves_nowhere(tmp_path, rows, form):
    data, slopes = honest_rows(rows)
    if rows == 2000 and form != "%.17g":
        data = data[::20]  # neighbouring rows differ by more than the last digit
    header = f"N {len(data)} FP {slopes[0]:.4g} {slopes[1]:.4g} EQ 1"
    read_bond_table(write_rows(tmp_path / "t.table", data, header, form))
    # The zero of the energy is arbitrary. Slopes of 0, as in LAMMPS's manual, mean unknown slopes.
    data[:, 1] += 0.75
    read_bond_table(write_rows(tmp_path / "t.table", data, f"N {len(data)} FP 0 0", form))


@pytest.mark.parametrize("potential", ["lj", "toda"])
@pytest.mark.parametrize("style", ["spline", "linear"])
@pytest.mark.slow_cases
def test_a_jobs_own_table_contradicts_itself_nowhere(tmp_path, potential, style):
    table = tabulate(Scene(potential=potential).bond, (0.8, 1.3), style)
    (tmp_path / "job.table").write_text(table.to_text())
    read_bond_table(tmp_path / "job.table")


@pytest.mark.parametrize(
    ("header", "line"),
    [
        ("N 400", "says N 400 and has 401 rows"),
        ("N 401.5", "has the line 'N 401.5'. Write the number of rows as a whole number"),
        ("N many", "has the line 'N many'. Write the number of rows as a whole number"),
        ("N 401 N 401", "its header has N twice, and LAMMPS takes the last. Keep one"),
        ("N 401\nEQ 1", "LAMMPS skips the line 'EQ 1' after the line 'N rows'"),
        ("N 401\n\nEQ 1", "has the line 'EQ 1' among its rows, which LAMMPS refuses"),
        ("N 401 FP 1", "has the line 'N 401 FP 1'"),
        ("N 401 R 0.9 1.2", "has the line 'N 401 R 0.9 1.2'"),
        ("N 401 FP {0} {1}", None),
        ("N 401 FP {1} {0}", "its forces change by -6[0-9.]* per length at the first row"),
        ("N 401 FP {0} 7.5", "per length at the last row. Set FP to dF/dr"),
        ("N 401 FP nan nan", "gives FP nan nan"),
    ],
)
def test_a_header_that_contradicts_the_rows_is_refused(tmp_path, header, line):
    data, slopes = honest_rows()
    path = write_rows(tmp_path / "t.table", data, header.format(*slopes))
    if line is None:
        read_bond_table(path)
        return
    with pytest.raises(TableError, match=line):
        read_bond_table(path)


def test_energies_that_are_not_those_of_the_forces_are_refused(tmp_path):
    def refused(change):
        data, _ = honest_rows()
        change(data)
        with pytest.raises(TableError, match=r"has energies that fall by .* force = -dE/dr"):
            read_bond_table(write_rows(tmp_path / "t.table", data, "N 401", "%.12g"))

    def one_off(data):
        data[200, 1] += 1e-4

    def other_units(data):
        data[:, 1] *= 1.05

    def other_sign(data):
        data[:, 1] *= -1.0

    def twice_the_forces(data):
        data[:, 2] *= 2.0

    def beyond_all(data):
        data[200:202, 1] = 1e308, -1e308

    for change in (one_off, other_units, other_sign, twice_the_forces, beyond_all):
        refused(change)


def lj_rows(path, rows=60, *, header=True, digits=15, altered=None):
    """Write forces of lj between 0.75 and 1.9; `altered` gives other forces for some rows."""
    lengths = np.linspace(0.75, 1.9, rows)
    forces = LennardJones().force(lengths - 1.0)
    for row, force in (altered or {}).items():
        forces[row] = force
    lines = ["LJ", f"N {rows}" if header else "", ""]
    lines += [
        f"{i} {length:.15g} 0 {force:.{digits}g}"
        for i, (length, force) in enumerate(zip(lengths, forces, strict=True), 1)
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_table_that_lammps_does_not_read_is_refused(tmp_path):
    with pytest.raises(TableError, match="has no line 'N rows' before its rows"):
        read_bond_table(lj_rows(tmp_path / "no_n.table", header=False))


def test_two_sections_are_reported(tmp_path):
    path = lj_rows(tmp_path / "two.table")
    path.write_text(path.read_text() + "\n" + path.read_text().replace("LJ", "AGAIN"))
    with pytest.raises(TableError, match=r"has 2 sections\. Put each"):
        read_bond_table(path)


@pytest.mark.parametrize("row", [12, 20, 55])
def test_an_outlier_is_reported_by_its_row(tmp_path, row):
    lengths = np.linspace(0.75, 1.9, 60)
    right = float(LennardJones().force(lengths[row] - 1.0))
    # The wrong force differs by at least a tenth, like a slip of a digit. Closer to the core, rows
    # are too far apart to detect this.
    path = lj_rows(tmp_path / "outlier.table", altered={row: 1.1 * right + 0.01})
    with pytest.raises(TableError, match=f"in row {row + 1}, but its other rows suggest"):
        read_bond_table(path)


@pytest.mark.parametrize("rows", [12, 20, 30, 60, 200])
def test_rows_of_a_smooth_function_have_no_outlier(tmp_path, rows):
    assert read_bond_table(lj_rows(tmp_path / "smooth.table", rows)).stiffness > 0.5


def test_noise_is_distinguished_from_unresolved_rows(tmp_path):
    rng = np.random.default_rng(1)
    lengths = np.linspace(0.8, 1.6, 200)
    forces = LennardJones().force(lengths - 1.0)
    for noise in (1e-6, 1e-4):
        noisy = forces + noise * rng.standard_normal(200)
        # A standard deviation of some ten rows is uncertain by a quarter.
        found = np.median(BondRows(lengths - 1.0, noisy, np.zeros(200)).noise())
        assert 0.5 * noise < found < 1.5 * noise
    assert np.median(BondRows(lengths - 1.0, forces, np.zeros(200)).noise()) < 1e-10


def bond_through(rows, reach=0.0):
    # The rows are unevenly spaced, so that a division does not give the row.
    strains = np.sort(np.concatenate(([0.0], np.random.default_rng(2).uniform(-0.3, 0.5, rows))))
    return SplineBond(CubicSpline(strains, -strains + strains**2), "rows", reach)


def test_the_kernel_is_the_spline_at_rows_between_them_and_beyond():
    bond = bond_through(23, reach=0.05)
    knots = bond.force_spline.x
    strains = np.concatenate((knots, np.linspace(bond.strain_min, bond.strain_max, 501)))
    found = [spline_force(float(s), bond.parameters) for s in strains]
    # The tolerance covers four rounding errors of numbers below 1.
    np.testing.assert_allclose(found, bond.force(strains), rtol=1e-14, atol=4e-16)


def test_there_is_no_force_beyond_the_reach():
    bond = bond_through(9)
    for strain in (bond.strain_min - 1e-9, bond.strain_max + 1e-9, np.nan):
        assert np.isnan(spline_force(strain, bond.parameters))


def test_all_tables_share_compiled_loops():
    # Loops for tables are compiled once; without this, NumPy would evaluate each spline.
    assert bond_through(9).force_kernel is bond_through(12).force_kernel is spline_force
