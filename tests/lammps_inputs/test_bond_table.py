"""Test the numbers and the text of bond tables."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chaincor.lammps_inputs.bond_table import (
    FEWEST_ROWS,
    FORCE_TARGET,
    MARGIN_BINS,
    MOST_ROWS,
    choose_rows,
    rows_on_kinks,
    tabulate,
)
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones, Logarithmic, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.lammps_inputs.bonds.table_bond import read_bond_table
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.errors import TableError

BONDS = [LennardJones(), Toda(), Logarithmic(), Power(3, -1.0)]


@given(
    low=st.floats(0.3, 1.0),
    width=st.floats(0.0, 3.0),
    rows=st.integers(3 * MARGIN_BINS, 3000),
    bond=st.sampled_from(BONDS),
)
def test_more_than_one_bin_of_margin(low, width, rows, bond):
    table = tabulate(bond, (low, low + width), "spline", rows)
    assert table.rows == rows
    # Lengths near 1 are rounded to 1e-16. Bins of a narrow table are about 1e-9/rows.
    margin = (1.0 - 1e-3) * MARGIN_BINS * table.spacing
    above = table.lengths[-1] - (low + width)
    below = low - table.lengths[0]
    assert above >= margin
    # There is no room for a margin at length 0, where log and lj bonds end.
    assert below >= margin or table.lengths[0] < 0.5 * low + 1e-12
    assert table.lengths[0] > 0.0
    assert np.all(np.diff(table.lengths) > 0.0)


@pytest.mark.parametrize("bond", BONDS, ids=lambda bond: bond.name)
def test_columns_and_slopes_are_the_potential(bond):
    table = tabulate(bond, (0.9, 1.2), rows=501)
    strains = table.lengths - 1.0
    assert np.array_equal(table.energies, bond.energy(strains))
    assert np.array_equal(table.forces, bond.force(strains))
    # FP is the derivative of the force.
    h = 1e-5
    for edge, slope in zip(strains[[0, -1]], table.edge_slopes, strict=True):
        derivative = (bond.force(edge + h) - bond.force(edge - h)) / (2.0 * h)
        # The truncation error is h^2/6 F''', with F''' below 1e4 in this range; the rounding error
        # is 1e-16/h.
        assert slope == pytest.approx(derivative, abs=h * h / 6.0 * 1e4 + 1e-10)


def test_text_reads_back_to_the_same_bits():
    table = tabulate(LennardJones(), (0.87654321, 1.3), rows=777)
    text = table.to_text()
    header = re.search(r"^N (\d+) FP (\S+) (\S+) EQ 1\.0$", text, re.MULTILINE)
    assert int(header[1]) == table.rows
    assert (float(header[2]), float(header[3])) == table.edge_slopes
    rows = np.array(
        [line.split() for line in text.splitlines() if line[:1].isdigit()], dtype=float
    ).T
    assert np.array_equal(rows[0], np.arange(1, 778))
    for column, values in zip(rows[1:], (table.lengths, table.energies, table.forces), strict=True):
        assert np.array_equal(column, values)


@pytest.mark.parametrize("style", ["spline", "linear"])
@pytest.mark.parametrize("bond", BONDS, ids=lambda bond: bond.name)
def test_rows_follow_the_force_error_asked_for(bond, style):
    order = {"spline": 4, "linear": 2}[style]
    span = (0.85, 1.4)
    coarse, fine = (choose_rows(bond, span, style, error) for error in (1e-6, 1e-8))
    if coarse > FEWEST_ROWS and fine < MOST_ROWS:
        assert fine / coarse == pytest.approx(100.0 ** (1.0 / order), rel=0.01)
    assert FEWEST_ROWS <= coarse <= fine <= MOST_ROWS


def test_a_straight_force_needs_few_rows():
    assert choose_rows(Harmonic(), (0.5, 1.5), "spline") == FEWEST_ROWS


def test_rows_stop_where_rounding_does():
    span = (0.85, 1.4)
    assert choose_rows(LennardJones(), span, "spline", 1e-30) == choose_rows(
        LennardJones(), span, "spline", FORCE_TARGET["spline"] * 1e-9
    )


@pytest.mark.parametrize("bond_range", [(1.2, 0.8), (np.nan, 1.0), (0.9, np.inf)])
def test_empty_ranges_are_refused(bond_range):
    with pytest.raises(TableError, match="the bond range is"):
        tabulate(LennardJones(), bond_range)


def test_too_few_rows_leave_no_margin():
    with pytest.raises(TableError, match=r"table_points is 5\. Give at least 8"):
        tabulate(LennardJones(), (0.9, 1.1), rows=5)


# ---- a user's own table --------------------------------------------------------------------------


def write_rows(path, rows):
    path.write_text(f"# mine\n\nMINE\nN {len(rows)} EQ 1.0\n\n" + "\n".join(rows) + "\n")
    return path


def test_a_user_table_is_the_potential_it_was_made_of(tmp_path):
    lj = LennardJones()
    table = tabulate(lj, (0.85, 1.3), rows=2001)
    path = tmp_path / "own.table"
    path.write_text(table.to_text())
    bond = read_bond_table(path)
    assert bond.name == "own"
    inside = np.linspace(-0.12, 0.25, 333)
    # A "not-a-knot" cubic spline has an error of 5/384 h^4 |F''''|, with h = 2.4e-4 and F'''' about
    # 1e5 at 0.85.
    assert bond.force(inside) == pytest.approx(lj.force(inside), abs=1e-11)
    assert bond.energy(inside) == pytest.approx(lj.energy(inside), abs=1e-12)
    assert bond.natural_speed == pytest.approx(lj.natural_speed, rel=1e-6)
    assert np.isnan(bond.energy(5.0)), "beyond its data it knows nothing"


GOOD = [f"{k} {0.8 + 0.1 * k} 0.0 {0.2 - 0.1 * k}" for k in range(5)]


@pytest.mark.parametrize(
    ("rows", "line"),
    [
        ([], "has 0 usable rows. Give at least 4"),
        (GOOD[:3], "has 3 usable rows"),
        ([*GOOD, "9 1.1 0.0 0.1"], "let the lengths increase"),
        ([*GOOD, "9 nan 0.0 0.1"], "Give a finite length"),
        ([*GOOD, "9 1.5 abc 0.1"], "has the row '9 1.5 abc 0.1'"),
        ([f"{k} {2 + 0.1 * k} 0.0 0.0" for k in range(5)], "the natural length 1 is inside"),
        ([*GOOD, "9 1.1 0.0 0.1"], "has '1.1 0 0.1' in row 6. Give"),
        ([*GOOD, "9 nan 0.0 0.1"], "has 'nan 0 0.1' in row 6. Give"),
        ([*GOOD, "9 1.5 0.0 1e308"], "too large to interpolate smoothly"),
        (
            [f"{row}e+120" for row in GOOD],
            "forces up to 2e.119. Choose units in which forces are between 1e-100 and 1e.100",
        ),
        (
            [f"{row}e-120" for row in GOOD],
            "forces up to 2e-121. Choose units in which forces are between 1e-100 and 1e.100",
        ),
    ],
)
def test_a_malformed_table_is_one_line(tmp_path, rows, line):
    path = write_rows(tmp_path / "bad.table", rows)
    with pytest.raises(TableError, match=line) as caught:
        read_bond_table(path)
    assert "\n" not in str(caught.value)


def test_a_table_made_of_a_table_ends_where_the_data_end(tmp_path):
    bond = read_bond_table(write_rows(tmp_path / "own.table", GOOD))
    assert bond.stiffness == pytest.approx(1.0, abs=1e-9)
    for bond_range in ((0.9, 1.19), (0.9, 1.2), (0.81, 1.1)):
        table = tabulate(bond, bond_range)
        assert np.all(np.isfinite(table.forces))
        assert np.all(np.isfinite(table.edge_slopes))
        assert table.lengths[0] > 0.8
        assert min(bond_range[1], 1.2 - 2e-9) < table.lengths[-1] < 1.2


def test_bonds_shorter_than_numbers_tell_are_refused():
    with pytest.raises(TableError, match=r"no finite stiffness.*engine 'reference'"):
        tabulate(Logarithmic(), (0.0, 2.0))


def test_an_unreadable_table_is_one_line(tmp_path):
    with pytest.raises(TableError, match="No such file"):
        read_bond_table(tmp_path / "absent")
    (tmp_path / "binary").write_bytes(b"\xff\x00")
    with pytest.raises(TableError, match="UnicodeDecodeError"):
        read_bond_table(tmp_path / "binary")


def test_ends_move_out_by_a_tenth_of_their_own_distance_from_rest():
    table = tabulate(LennardJones(), (0.9, 11.0), rows=100_001)
    bins = (MARGIN_BINS + 1) * table.spacing
    assert table.lengths[0] == pytest.approx(0.89, abs=bins)
    assert table.lengths[-1] == pytest.approx(12.0, abs=bins)
    # Two particles stretch their bond only by rounding and by the error of the time step.
    assert tabulate(LennardJones(), (0.9, 1.0), rows=10_001).lengths[-1] > 1.001


def test_rows_lie_on_kinks():
    for kinks in ((0.0,), (0.03,), (0.099,), (-0.0123456789, 0.03), (-0.02, 0.0, 0.03)):
        bond = UserBond(Harmonic().energy, Harmonic().force, kinks=kinks)
        for rows in (51, 1000, 4001):
            low, high = rows_on_kinks(bond, (0.9, 1.1), rows)
            spacing = (high - low) / (rows - 1)
            at = (1.0 + np.array(kinks) - low) / spacing
            # Lengths are rounded to 2e-16, which is about 1e-11 spacings for 4000 rows.
            assert at == pytest.approx(np.round(at), abs=1e-9 if len(kinks) < 3 else 0.1)
            # A margin of four bins that moves by at most one bin keeps three bins.
            assert low < 0.9 + 1.01 * spacing
            assert high > 1.1 - 1.01 * spacing


def test_straight_tables_hold_a_kink():
    bond = UserBond(
        lambda s: 0.5 * s**2 + 2.0 * np.maximum(s - 0.03, 0.0) ** 2,
        lambda s: -s - 4.0 * np.maximum(s - 0.03, 0.0),
    )
    table = tabulate(bond, (0.95, 1.08), "linear")
    lengths = np.linspace(0.95, 1.08, 12347)
    between = np.interp(lengths, table.lengths, table.forces)
    # The force is piecewise linear, so that only rounding errors remain.
    assert between == pytest.approx(bond.force(lengths - 1.0), abs=1e-14)
    assert table.rows == FEWEST_ROWS
