"""Test faults of real files against LAMMPS's messages, and how reports are shown."""

import json
import re
import subprocess

import numpy as np
import pytest

from chaincor import check_table
from chaincor.workflows.engines.lammps.library import find_lmp_command, lmp_environment
from chaincor.workflows.tables.lammps_curve import bitmap_lengths
from chaincor.workflows.tables.lammps_run import run_lammps
from tests.workflows.tables.test_check import lennard_jones, morse, write


def _signs(path, low, beyond, rows=150):
    """Write a Lennard-Jones table whose forces have the wrong sign beyond a distance."""
    r = np.linspace(low, 3.0, rows)
    energy, force, _ = lennard_jones(r)
    force = np.where(r > beyond, -force, force)
    lines = [
        f"{k} {a:.12g} {e:.12g} {f:.12g}"
        for k, (a, e, f) in enumerate(zip(r, energy, force, strict=True), 1)
    ]
    path.write_text("\n".join(["LJ", f"N {rows} R {low} 3", "", *lines, ""]))
    return path


@pytest.mark.parametrize("low", [0.02, 0.3, 0.5, 0.8])
def test_a_core_does_not_hide_a_reversed_well(tmp_path, low):
    """Find the wrong sign in the well although the force in the core is up to 1e23 times larger."""
    faulty = check_table(_signs(tmp_path / "t", low, 0.9))
    assert "the forces have the wrong sign" in faulty.summary
    assert faulty.error > 1.0
    sound = check_table(_signs(tmp_path / "t", low, 9.0))
    assert sound.faults == ()
    # A steep core disturbs LAMMPS's spline far from the core, which the bottom line reports.
    assert sound.summary.startswith("Good" if low >= 0.5 else "The rows are sound, but LAMMPS's")


@pytest.mark.parametrize("side", ["next", "last"])
def test_one_sided_differences_are_named(tmp_path, side):
    def spoil(data, header):
        slopes = -np.diff(data[:, 1]) / np.diff(data[:, 0])
        data = data.copy()
        data[:, 2] = (
            np.append(slopes, slopes[-1]) if side == "next" else np.append(slopes[0], slopes)
        )
        return data

    path = write(tmp_path / "t", rows=100, spoil=spoil, head={"FP": [-60, -0.3]})
    report = check_table(path)
    assert f"differences of the energy to the {side} row" in " ".join(report.faults)


def test_trailing_zeros_change_nothing(tmp_path):
    one = write(tmp_path / "a", "pair", rows=161)
    text = one.read_text()
    two = tmp_path / "b"
    rows = [line.split() for line in text.splitlines()[5:]]
    padded = [f"{k} {float(r):.9f} {e} {f}" for k, r, e, f in rows]
    two.write_text("\n".join([*text.splitlines()[:5], *padded, ""]))
    first, second = check_table(one), check_table(two)
    assert second.error == pytest.approx(first.error, rel=1e-9)
    assert second.summary == first.summary


CAUSES = {
    "the factor between kcal and kJ": lambda d, h: d * [1, 4.184, 1],
    "the wrong sign": lambda d, h: d * [1, -1, 1],
    "exchange the third and the fourth": lambda d, h: d[:, [0, 2, 1]],
    "shifted down by 1 row": lambda d, h: np.column_stack([d[:, :2], np.roll(d[:, 2], 1)]),
    "shifted up by 2 rows": lambda d, h: np.column_stack([d[:, :2], np.roll(d[:, 2], -2)]),
    "take the root of the r column": lambda d, h: np.column_stack([d[:, 0] ** 2, d[:, 1:]]),
    "the forces are divided by r": lambda d, h: np.column_stack([d[:, :2], d[:, 2] / d[:, 0]]),
    "the forces belong to other energies": lambda d, h: np.column_stack(
        [d[:, :2], morse(d[:, 0] - 0.05)[1]]
    ),
}


@pytest.mark.parametrize("said", CAUSES)
def test_causes_are_found_by_undoing_them(tmp_path, said):
    path = write(tmp_path / "t", spoil=lambda d, h: h.pop("FP") and CAUSES[said](d, h))
    report = check_table(path)
    assert not report.is_good
    assert said.lower() in report.faults[0].lower()


def _reversed_between(data, low, high):
    r, energies, forces = data.T
    return np.stack([r, energies, np.where((r > low) & (r < high), -forces, forces)], axis=1)


# The remedy must name only the rows that are wrong.
PARTS = {
    (0.9, 1.6): lambda d: _reversed_between(d, 0.9, 1.6),
    (1.4, 2.0): lambda d: _reversed_between(d, 1.4, 3.0),
    (0.6, 0.8): lambda d: _reversed_between(d, 0.0, 0.8),
}


@pytest.mark.parametrize("part", PARTS)
def test_a_part_of_reversed_forces_is_located(tmp_path, part):
    path = write(tmp_path / "t", spoil=lambda d, h: h.pop("FP") and PARTS[part](d))
    report = check_table(path)
    found = re.search(r"wrong sign between (\S+) and (\S+)\. Multiply these forces", report.summary)
    # The tolerance is two rows, plus rounding to four digits.
    assert [float(x) for x in found.groups()] == pytest.approx(part, abs=2 * 1.4 / 399 + 1e-3)


def _changed(data, change):
    energies = data[:, 1].copy()
    change(energies)
    return np.column_stack([data[:, 0], energies, data[:, 2]])


def _negate(energies):
    energies[250:300] *= -1.0


def _raise_one(energies):
    energies[150] += 0.5


def _raise_beyond(energies):
    energies[150:] += 0.5


def _shift_beyond(energies):
    energies[150:-1] = energies[151:]


# Advice to change the forces would spoil them.
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_negate, "the energies have the wrong sign between"),
        (_raise_one, "but the energies jump between"),
        (_raise_beyond, "but the energies jump between"),
        (_shift_beyond, "but the energies jump between"),
    ],
)
def test_smooth_forces_are_not_blamed_for_wrong_energies(tmp_path, change, said):
    path = write(tmp_path / "t", spoil=lambda d, h: h.pop("FP") and _changed(d, change))
    assert said in check_table(path).summary


@pytest.mark.parametrize("rows", [4, 5, 6, 8])
def test_contradictions_in_few_rows_are_reported(tmp_path, rows):
    path = write(tmp_path / "t", rows=rows, spoil=lambda d, h: h.pop("FP") and d * [1, 1, -1])
    assert not check_table(path).is_good


def test_a_table_that_ends_in_the_well_says_so(tmp_path):
    """Cut a Morse bond of depth 100, in which only the sound table reaches 10 kT."""

    def morse_to(high):
        r = np.linspace(0.7, high, 50)
        x = np.exp(-2.0 * (r - 1.0))
        columns = (r, 100.0 * (1.0 - x) ** 2, -400.0 * (1.0 - x) * x)
        rows = [f"{k} " + " ".join(map(str, row)) for k, row in enumerate(np.transpose(columns), 1)]
        (tmp_path / "t").write_text("\n".join(["KEY", "N 50", "", *rows, ""]))
        return " ".join(check_table(tmp_path / "t", kind="bond").notes)

    assert "at 1.1, the energy is less than 10 kT above" in morse_to(1.1)
    assert "10 kT" not in morse_to(1.3)


def test_a_shift_of_half_a_column_is_no_factor(tmp_path):
    def spoil(data, header):
        header.pop("FP")
        shifted = np.roll(data[:, 2], 1)
        half = len(data) // 2
        return np.column_stack([data[:, :2], np.append(data[:half, 2], shifted[half:])])

    report = check_table(write(tmp_path / "t", spoil=spoil, rows=100))
    assert "the force column is shifted down by 1 row between 1.3" in report.summary


def test_reversed_energies_are_distinguished_from_reversed_forces(tmp_path):
    """Use a bond, whose first force must push particles apart."""
    path = write(tmp_path / "t", spoil=lambda d, h: h.pop("FP") and d * [1, -1, 1])
    assert "Multiply the energy column by -1" in check_table(path).summary


def test_rounded_lengths_are_named_as_the_cause(tmp_path):
    path = write(
        tmp_path / "t",
        spoil=lambda d, h: h.pop("FP") and np.column_stack([np.round(d[:, 0], 2), d[:, 1:]]),
        rows=90,
    )
    assert "the r column is rounded. Write r with all digits" in check_table(path).summary


def _dihedral(path, header, unit=1.0, slope=0.0):
    angles = np.arange(-180.0, 180.0, 2.0)
    phase = 3.0 * np.radians(angles) - 0.3
    energies = 2.0 * (1.0 + np.cos(phase)) + slope * angles
    forces = (6.0 * np.sin(phase) * np.pi / 180.0 - slope) / unit
    columns = [angles * unit, energies] + ([] if "no force" in header else [forces])
    rows = [
        f"{k} " + " ".join(f"{x:.12g}" for x in row)
        for k, row in enumerate(zip(*columns, strict=True), 1)
    ]
    path.write_text("\n".join(["KEY", header.replace(" no force", ""), "", *rows, ""]))
    return check_table(path)


def test_units_and_periods_of_dihedrals(tmp_path):
    path, radian = tmp_path / "t", np.pi / 180.0
    assert _dihedral(path, "N 180 DEGREES").is_good
    assert _dihedral(path, "N 180 RADIANS", radian).is_good
    assert "Write RADIANS after N" in _dihedral(path, "N 180 NOF no force", radian).summary
    assert "Replace RADIANS by DEGREES" in _dihedral(path, "N 180 RADIANS").summary
    assert "NOF after N in a dihedral table" in _dihedral(path, "N 180 no force").summary
    assert "the energy is not periodic: it jumps by" in _dihedral(path, "N 180", slope=0.01).summary


@pytest.mark.parametrize("reach", [2.0, 2.5, 4.0])
def test_energies_that_vanish_at_the_end_are_those_of_pairs(tmp_path, reach):
    r = np.linspace(0.85, reach, 300)
    rows = [
        f"{k} {a:.12g} {e:.12g} {f:.12g}"
        for k, (a, e, f) in enumerate(zip(r, *lennard_jones(r)[:2], strict=True), 1)
    ]
    (tmp_path / "t").write_text("\n".join(["KEY", "N 300", "", *rows, ""]))
    assert check_table(tmp_path / "t").kind == "pair"


@pytest.mark.parametrize(
    ("power", "header", "remedy"),
    [
        (1, "RSQ 0.85 2.5", "Write 'R 0.85 2.5' after N"),
        (2, "R 0.85 2.5", "Write 'RSQ 0.85 2.5' after N"),
        (1, "R 0.8 2.5", "Write 'R 0.85 2.5' after N"),
        (0.5, "R 0.85 2.5", "The r column holds r squared: take its root"),
    ],
)
def test_distances_of_another_header_get_one_fault_and_its_remedy(tmp_path, power, header, remedy):
    r = np.linspace(0.85**power, 2.5**power, 300) ** (1.0 / power)
    if power == 0.5:
        r = np.linspace(0.85, 2.5, 300)
    energies, forces, _ = lennard_jones(r)
    column = r**2 if power == 0.5 else r
    rows = [
        f"{k} {a:.12g} {e:.12g} {f:.12g}"
        for k, (a, e, f) in enumerate(zip(column, energies, forces, strict=True), 1)
    ]
    (tmp_path / "t").write_text("\n".join(["KEY", f"N 300 {header}", "", *rows, ""]))
    report = check_table(tmp_path / "t")
    assert len(report.faults) == 1
    assert remedy in report.summary


@pytest.mark.parametrize(
    ("spoil", "remedy"),
    [
        (lambda d: d[::-1], "Reverse the order of the rows"),
        (lambda d: np.insert(d, 100, d[100], axis=0)[:-1], "Keep one of the rows"),
        (lambda d: d[:, [1, 0, 2]], "The third column rises evenly: exchange it"),
        (lambda d: np.roll(d, 7, axis=0), "Sort the rows by length"),
    ],
)
def test_rows_in_disorder_are_put_right(tmp_path, spoil, remedy):
    path = write(tmp_path / "t", spoil=lambda d, h: h.pop("FP") and spoil(d))
    assert remedy in check_table(path).summary


REFUSED = {
    "decimal commas": lambda text: text.replace(".", ","),
    "separated by commas": lambda text: (
        re.sub(r"(?<=\d) (?=[-\d])", ",", text.split("\n\n")[0])
        + "\n\n"
        + text.split("\n\n", 1)[1].replace(" ", ",")
    ),
    "exponents with D": lambda text: re.sub(r"(?m)^(\d+ \S+ \S+ \S+)$", r"\1D+00", text),
    "carriage return": lambda text: text.replace("\n", "\r"),
    "rows have no index": lambda text: "\n".join(
        line.split(maxsplit=1)[1] if line[:1].isdigit() else line for line in text.splitlines()
    ),
    "says N 401": lambda text: text.replace("N 400", "N 401"),
    "Insert an empty line": lambda text: text.replace("\n\n1 ", "\n1 "),
    "refuses in bond tables": lambda text: text.replace("N 400", "N 400 R 0.6 2"),
}


@pytest.mark.parametrize("said", REFUSED)
def test_what_is_called_refused_lammps_refuses(tmp_path, said):
    path = write(tmp_path / "t")
    path.write_bytes(REFUSED[said](path.read_text()).encode())
    report = check_table(path, kind="bond")
    assert said in " ".join(report.faults)
    assert run_lammps(path, "KEY", "bond", "spline", 400, (0.7, 1.9), 50).error


@pytest.mark.parametrize(("low", "high"), [(1.0, 180.0), (0.0, 179.0), (0.0, 180.0)])
def test_angles_are_no_bonds(tmp_path, low, high):
    degrees = np.linspace(low, high, 180)
    rows = enumerate(
        zip(degrees, 0.01 * (degrees - 110) ** 2, -0.02 * (degrees - 110), strict=True), 1
    )
    lines = [f"{k} {a:.12g} {e:.12g} {f:.12g}" for k, (a, e, f) in rows]
    path = tmp_path / "t"
    path.write_text("\n".join(["KEY", "N 180", "", *lines, ""]))
    report = check_table(path)
    assert report.kind == "angle"
    refusal = run_lammps(path, "KEY", "angle", "spline", 180, (10.0, 170.0), 20).error
    assert report.is_good == (refusal == "")
    assert report.is_good == ((low, high) == (0.0, 180.0))


@pytest.mark.parametrize("form", ["r", "rsq", "bitmap"])
def test_tables_of_pair_write_are_good(tmp_path, form):
    """Accept tables of LAMMPS's own writer, which end by zeros at the cutoff."""
    count = 8 if form == "bitmap" else 500
    (tmp_path / "in.write").write_text(
        "units lj\nboundary f f f\nregion b block 0 10 0 10 0 10\ncreate_box 1 b\n"
        "create_atoms 1 single 5 5 5\nmass 1 1\npair_style lj/cut 2.5\npair_coeff 1 1 1 1\n"
        f"pair_write 1 1 {count} {form} 0.8 2.5 t.table LJ\n"
    )
    command = [find_lmp_command(), "-in", "in.write", "-log", "none"]
    subprocess.run(command, cwd=tmp_path, env=lmp_environment(), check=True, capture_output=True)
    report = check_table(tmp_path / "t.table")
    assert report.faults == ()
    assert report.error < 0.005
    assert "kT = 1, lj units" in report.range_reason


@pytest.mark.parametrize("kind", ["bond", "pair", "angle"])
def test_compare_prints_both_forces_and_counts_warnings(tmp_path, kind, chaincor):
    path = write(tmp_path / "t", kind, rows=60)
    status, out, _ = chaincor("table", path, "--kind", kind, "--compare", "--json")
    plain = json.loads(out)
    assert status == 0
    found = plain["comparison"]
    assert found["refusal"] is None
    assert found["model_error"] < 1e-9
    assert found["warnings"] == plain["warnings"]
    # The two errors are the largest at some thousand distances and at a thousand other distances.
    assert found["error"] == pytest.approx(plain["error"], rel=0.2)
    assert (
        "LAMMPS's force differs from the rows by"
        in chaincor("table", path, "--kind", kind, "--compare")[1]
    )


def test_a_report_shows_itself(tmp_path):
    report = check_table(write(tmp_path / "t"), range=(0.8, 1.4))
    assert len(repr(report).splitlines()) == 1
    assert report.summary in repr(report)
    assert "<table>" in report._repr_html_()
    axes = report.plot()
    assert [line.get_label() for line in axes.lines][-1] == "LAMMPS, spline 400"
    assert axes.lines[-1].get_xdata()[0] == 0.8


def test_rows_of_a_bitmap_are_numbered_as_in_the_file(tmp_path):
    """Move the third row of a bitmap, whose rows begin inside its range."""
    r = bitmap_lengths(0.9, 2.5, 8)
    assert r[0] > 0.9
    data = np.stack([r, *lennard_jones(r)[:2]], axis=1)
    data[2, 0] *= 1.01
    path = tmp_path / "t"
    text = [f"{k} {a:.12g} {e:.12g} {f:.12g}" for k, (a, e, f) in enumerate(data, 1)]
    path.write_text("\n".join(["T", "N 256 BITMAP 0.9 2.5", "", *text, ""]))
    assert any("row 3 is at" in fault for fault in check_table(path).faults)


# Each entry has a line, its replacement, and the words of the fault. LAMMPS skips the line after
# the header, uses the last of two equal keywords, and refuses other lines among the rows.
HEADER_LINES = [
    ("N 40\n\n", "N 40\nFP -60 -0.3\n", "LAMMPS skips the line 'FP -60 -0.3'"),
    ("N 40\n\n", "N 40\nN 40\n", "LAMMPS skips the line 'N 40'"),
    ("N 40\n\n", "N 40\n\nEQ 1\n", "has the line 'EQ 1' among its rows, which LAMMPS refuses"),
    ("N 40\n\n", "N 40\n\nsome words\n", "has the line 'some words' among its rows"),
    ("\n7 ", "\nword\n7 ", "has the line 'word' among its rows"),
    ("N 40", "N 40 N 40", "its header has N twice"),
    ("N 40", "N 40 EQ 1 EQ 1.1", "its header has EQ twice"),
    ("N 40", "N 40.0", "Write the number of rows as a whole number"),
    ("N 40", "N 40 NAME", "has the line 'N 40 NAME'"),
]


def _plain(path):
    """Write a sound table whose header has only N."""
    r = np.linspace(0.6, 1.4, 40)
    rows = [f"{k} {a:.12g} {(a - 1) ** 2:.12g} {2 - 2 * a:.12g}" for k, a in enumerate(r, 1)]
    path.write_text("\n".join(["KEY", "N 40", "", *rows, ""]))
    return path


@pytest.mark.parametrize(("line", "written", "said"), HEADER_LINES)
def test_lines_that_lammps_ignores_or_refuses_are_named(tmp_path, line, written, said):
    path = _plain(tmp_path / "t")
    text = path.read_text()
    assert check_table(path, kind="bond").faults == ()
    assert text.count(line) == 1
    path.write_text(text.replace(line, written))
    report = check_table(path, kind="bond")
    assert any(said in fault for fault in report.faults), report.faults
    assert not report.is_good


def test_of_two_forms_of_a_range_one_is_asked_for(tmp_path):
    path = tmp_path / "t"
    text = _signs(path, 0.8, 9.0).read_text()
    path.write_text(text.replace("R 0.8 3", "RSQ 0.8 3 R 0.8 3"))
    assert "its header has RSQ and R, and LAMMPS takes the last" in check_table(path).summary


def test_harmless_lines_are_noted(tmp_path):
    path = _plain(tmp_path / "t")
    path.write_text("OTHER\n" + path.read_text().replace("N 40\n\n", "N 40\nsome words\n"))
    report = check_table(path, kind="bond")
    assert report.faults == ()
    assert "LAMMPS does not read the line 'OTHER' before the keyword KEY" in report.notes
    assert "LAMMPS skips the line 'some words' after the line 'N rows'" in report.notes


def test_a_dihedral_table_has_no_line_that_lammps_skips(tmp_path):
    phi = np.linspace(-180.0, 176.0, 90)
    rows = [f"{k} {x} {np.cos(np.radians(x)):.12g}" for k, x in enumerate(phi, 1)]
    path = tmp_path / "t"
    path.write_text("\n".join(["KEY", "N 90 NOF", "some words", *rows, ""]))
    said = "has the line 'some words' among its rows, which LAMMPS refuses"
    assert said in check_table(path, kind="dihedral").summary
