"""Test good and spoiled tables of known functions; no good table is refused."""

import json
import re

import numpy as np
import pytest

from chaincor import check_table
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.tables.lammps_curve import bitmap_lengths
from chaincor.workflows.tables.rewrite import rewrite_table
from tests.workflows.tables.spoiled import true_error


def morse(r):
    x = np.exp(-2.0 * (r - 1.0))
    return (1.0 - x) ** 2, -4.0 * (1.0 - x) * x, 8.0 * x * (1.0 - 2.0 * x)


def lennard_jones(r):
    s = r**-6
    energy, force = 4.0 * (s * s - s), 24.0 * (2.0 * s * s - s) / r
    return energy, force, -24.0 * (26.0 * s * s - 7.0 * s) / r**2


def cosine(degrees):
    a, unit = np.radians(degrees), np.pi / 180.0
    return 3.0 * (1.0 + np.cos(a)), 3.0 * np.sin(a) * unit, 3.0 * np.cos(a) * unit**2


FUNCTIONS = {
    "bond": (morse, 0.6, 2.0, "FP"),
    "pair": (lennard_jones, 0.9, 2.5, "FPRIME"),
    "angle": (cosine, 0.0, 180.0, "FP"),
}


def write(path, kind="bond", rows=400, form="%.15g", spoil=None, head=None, power=1, name="KEY"):
    """Write a table of a known function, spoilt or not."""
    function, low, high, slopes = FUNCTIONS[kind]
    r = np.linspace(low**power, high**power, rows) ** (1.0 / power)
    energy, force, _ = function(r)
    ends = function(np.array([low, high]))[2]
    header = {"N": [rows], slopes: list(ends)}
    if kind == "pair":
        header["R" if power == 1 else "RSQ"] = [low, high]
    data = np.transpose([r, energy, force])
    if spoil is not None:
        data = spoil(data, header)
    header |= head or {}
    line = " ".join(f"{key} {' '.join(f'{x:.12g}' for x in v)}" for key, v in header.items())
    body = [f"{k} " + " ".join(form % x for x in row) for k, row in enumerate(data, 1)]
    path.write_text("\n".join(["# made by a test", "", name, line, "", *body, ""]))
    return path


GOOD = [
    *({"kind": kind} for kind in FUNCTIONS),
    *({"kind": kind, "rows": 2000} for kind in FUNCTIONS),
    {"kind": "pair", "power": 2},
    {"rows": 100},
    {"form": "%.7g"},
    # LAMMPS warns of these distances, which differ from those of the keyword R in the last digit.
    {"kind": "pair", "spoil": lambda d, h: np.column_stack([np.round(d[:, 0], 5), d[:, 1:]])},
    # These distances are equal after rounding; LAMMPS recomputes them from the header.
    *(
        {
            "kind": "pair",
            "rows": 2000,
            "power": power,
            "spoil": lambda d, h: np.column_stack([np.round(d[:, 0], 2), d[:, 1:]]),
        }
        for power in (1, 2)
    ),
    {"head": {"EQ": [1.0]}},
    {"spoil": lambda d, h: d + np.array([0.0, 7.5, 0.0])},
    # This table has no interaction, like a placeholder.
    {"spoil": lambda d, h: d * [1, 0, 0], "head": {"FP": [0, 0]}},
]


@pytest.mark.parametrize("made", GOOD)
def test_good_tables_are_good(tmp_path, made):
    report = check_table(write(tmp_path / "t.table", **made))
    assert report.faults == ()
    assert report.is_good
    # The error is relative to the local force, for a spline with its end slopes through rows at
    # this spacing.
    assert report.error < 1e-3
    assert report.summary.startswith("Good")


def _with(data, row, column, value):
    data = data.copy()
    data[row, column] = value
    return data


def _noisy(data, column, size):
    data = data.copy()
    largest = np.max(np.abs(data[:, 2]))
    data[:, column] += size * largest * np.random.default_rng(1).normal(size=len(data))
    return data


def _kinked(data):
    """Add a force that begins to grow at 1.2, and its energy."""
    beyond = np.maximum(data[:, 0] - 1.2, 0.0)
    return data + 20.0 * np.transpose([0.0 * beyond, -(beyond**2) / 2.0, beyond])


FAULTY = {
    "N too large": ({"head": {"N": [401]}}, "says N 401 but has 400"),
    "N too small": ({"head": {"N": [399]}}, "says N 399"),
    "a row missing": ({"spoil": lambda d, h: np.delete(d, 77, 0)}, "says N 400 but has 399"),
    "a row twice": (
        {"spoil": lambda d, h: h.update(N=[401]) or np.insert(d, 5, d[5], 0)},
        "not increasing",
    ),
    "lengths fall": ({"spoil": lambda d, h: d[::-1]}, "not increasing"),
    "two rows changed": ({"spoil": lambda d, h: d[[*range(9), 10, 9, *range(11, 400)]]}, "row 11"),
    "sign of the force": ({"spoil": lambda d, h: d * [1, 1, -1]}, "the energies give a force of"),
    "force of twice the energy": (
        {"spoil": lambda d, h: d * [1, 1, 2]},
        "the energies give a force of",
    ),
    "kcal and kJ": ({"spoil": lambda d, h: d * [1, 4.184, 1]}, "the energies give a force of"),
    "columns exchanged": ({"spoil": lambda d, h: d[:, [0, 2, 1]]}, "the energies give a force of"),
    "an outlier of the force": (
        {"spoil": lambda d, h: _with(d, 200, 2, 3.0 * d[200, 2] + 1.0)},
        "Correct or remove this row",
    ),
    "an outlier of the energy": (
        {"spoil": lambda d, h: _with(d, 200, 1, d[200, 1] + 0.5)},
        "the energies give a force of",
    ),
    "a digit lost": (
        {"spoil": lambda d, h: _with(d, 30, 2, d[30, 2] / 10.0)},
        "Correct or remove this row",
    ),
    "no energies": ({"spoil": lambda d, h: d * [1, 0, 1]}, "energies are the same"),
    "no forces": ({"spoil": lambda d, h: d * [1, 1, 0]}, "all forces are 0"),
    "not a number": (
        {"spoil": lambda d, h: _with(d, 3, 2, np.nan)},
        "row 4 says '0.610526 1.39046 nan'",
    ),
    "a gap": (
        {"spoil": lambda d, h: h.update(N=[320]) or np.delete(d, slice(20, 100), 0)},
        "between rows 20 and 21",
    ),
    "a kink": (
        {"spoil": lambda d, h: h.pop("FP") and _kinked(d)},
        "rows leave an error near 1.1",
    ),
    "rows in one place": (
        {
            "kind": "angle",
            "spoil": lambda d, h: h.update(N=[401]) or np.insert(d, 1, [1e-310, *d[0, 1:]], axis=0),
        },
        "rows 1 and 2 are closer than 1e-30",
    ),
    "infinite": ({"kind": "pair", "spoil": lambda d, h: _with(d, 0, 1, np.inf)}, "finite numbers"),
    "EQ where no force vanishes": ({"head": {"EQ": [1.4]}}, "EQ 1.4, where the force is"),
    "a header of pairs": ({"head": {"R": [0.6, 2.0]}}, "refuses in bond tables"),
    "slopes of the other sign": ({"head": {"FP": [97.8, -0.3]}}, "dF/dr"),
    "8 rows": ({"rows": 8}, "rows leave an error"),
    "noise": ({"spoil": lambda d, h: _noisy(d, 2, 1e-3)}, "noisy"),
    "one decimal": (
        {"rows": 100, "spoil": lambda d, h: np.column_stack([d[:, :2], np.round(d[:, 2], 1)])},
        "error of",
    ),
    "angles of radians": ({"kind": "angle", "spoil": lambda d, h: d * [np.pi / 180, 1, 1]}, "180"),
    "half an angle": ({"kind": "angle", "spoil": lambda d, h: d[:200]}, "180"),
    "R of another range": ({"kind": "pair", "head": {"R": [0.9, 2.6]}}, "distance values differ"),
    "R for RSQ": (
        {"kind": "pair", "power": 2, "spoil": lambda d, h: h.update(R=h.pop("RSQ")) or d},
        "distance values differ",
    ),
    "EQ outside": ({"head": {"EQ": [3.0]}}, "EQ 3"),
    "two rows": ({"rows": 2}, "it has 2 rows. Give"),
    "a keyword of digits": ({"name": "12"}, "has no keyword"),
    "a pair at no distance": (
        {"kind": "pair", "spoil": lambda d, h: h.pop("R") and _with(d, 0, 0, 0.0)},
        "distances begin at 0",
    ),
    "a header of words": ({"head": {"ROWS": [3]}}, "Write 'N rows'"),
}


@pytest.mark.parametrize("name", FAULTY)
def test_faulty_tables_are_reported(tmp_path, name):
    made, said = FAULTY[name]
    path = write(tmp_path / "t.table", **made)
    kind = made.get("kind", "bond")
    report = check_table(path, kind=kind, tolerance=1e-3)
    assert not report.is_good
    assert said in " ".join(report.faults)
    # Without a tolerance, the report has the same content, and the user judges it.
    printed = check_table(path, kind=kind)
    assert printed.is_good == (name in ("8 rows", "noise", "one decimal", "a gap", "a kink"))
    assert said in " ".join(printed.faults + printed.notes)


def test_a_file_without_a_header_or_rows(tmp_path):
    path = tmp_path / "t.table"
    path.write_text("1 0.9 1 2\n2 1.0 0 1\n3 1.1 0 0\n4 1.2 1 -1\n5 1.3 2 -2\n")
    assert "no line 'N rows'" in check_table(path).faults[0]
    with pytest.raises(InputError, match="has the sections one without a keyword, and none is 'B'"):
        check_table(path, "B")
    path.write_text("nothing at all\n")
    assert not check_table(path).is_good


@pytest.mark.parametrize("kind", FUNCTIONS)
@pytest.mark.parametrize("rows", [20, 160])
@pytest.mark.parametrize("form", ["%.5g", "%.15g"])
@pytest.mark.parametrize("noise", [0.0, 1e-4])
@pytest.mark.parametrize("style", ["spline", "linear"])
def test_the_error_is_that_of_the_function(tmp_path, kind, rows, form, noise, style):
    """
    Compare LAMMPS's force with the function from which the table was made.

    The interpolation error is estimated within a factor of two. Noise and rounding are estimated
    from seven rows, and the largest estimate is used. This may be too small by a factor of 2.5, or
    too large by 6 if numbers lose further digits.
    """
    path = write(
        tmp_path / "t.table", kind, rows, form, lambda d, h: _noisy(d, 2, noise) if noise else d
    )
    # For the cosine, an energy of ten kT exceeds the range.
    report = check_table(path, kind=kind, style=style, range=FUNCTIONS[kind][1:3])
    exact = FUNCTIONS[kind][0]
    true = true_error(report, lambda at: exact(at)[1])
    low, high = (0.5, 2.0) if form == "%.15g" and not noise else (0.4, 6.0)
    assert low * true <= report.error <= max(high * true, 1e-12)


def test_forces_beyond_what_can_be_squared_are_a_fault(tmp_path):
    path = write(tmp_path / "t.table", spoil=lambda data, header: data * [1.0, 1e300, 1e300])
    (fault,) = check_table(path).faults
    assert fault.startswith("row 1 says '0.6 ")
    assert fault.endswith("Give finite numbers of at most 1e+100")


def test_sections_are_chosen_by_keyword(tmp_path):
    one, two = write(tmp_path / "a", name="ONE"), write(tmp_path / "b", name="TWO", rows=8)
    both = tmp_path / "both.table"
    both.write_text(one.read_text() + two.read_text())
    assert check_table(both, "ONE").is_good
    assert check_table(both, "TWO").is_good
    assert not check_table(both, "TWO", tolerance=1e-3).is_good
    for keyword in (None, "THREE"):
        with pytest.raises(InputError, match="sections ONE, TWO"):
            check_table(both, keyword)


def test_sections_of_one_name_are_a_fault(tmp_path):
    one = write(tmp_path / "a", name="ONE")
    path = tmp_path / "both.table"
    path.write_text(one.read_text() + one.read_text())
    for keyword in (None, "ONE"):
        assert "2 sections named ONE" in check_table(path, keyword).faults[0]


def test_angles_and_pairs_are_not_called_bonds(tmp_path):
    for kind in ("angle", "pair"):
        report = check_table(write(tmp_path / kind, kind, spoil=lambda d, h: d * [1, 3, 1]))
        assert "the energies give a force of" in report.faults[0]
        assert "bond" not in " ".join(report.faults)


def test_what_pair_write_and_bitmaps_look_like(tmp_path):
    """Accept a table that ends by 0 at its cutoff, and rows that begin in the middle."""
    cut = write(
        tmp_path / "cut",
        "pair",
        spoil=lambda d, h: d * (np.arange(400) < 399)[:, None] ** [0, 1, 1],
    )
    report = check_table(cut)
    assert report.is_good
    assert "the energy jumps by 0.0165" in report.notes[-1]
    r = bitmap_lengths(0.9, 2.5, 8)
    rolled = write(
        tmp_path / "rolled",
        "pair",
        rows=256,
        head={"BITMAP": [0.9, 2.5]},
        spoil=lambda d, h: (
            h.pop("R") and h.pop("FPRIME") and np.transpose([r, *lennard_jones(r)[:2]])
        ),
    )
    report = check_table(rolled)
    assert report.is_good
    # The new table has the rows that were read, in the order of their distances.
    new = tmp_path / "new"
    rewrite_table(report, new, report.rows)
    assert check_table(new).faults == ()
    written = np.array([x.split()[1:] for x in new.read_text().splitlines()[3:]], dtype=float)
    read = np.array([x.split()[1:] for x in rolled.read_text().splitlines()[5:]], dtype=float)
    assert np.argmin(r) > 0
    exact = lennard_jones(written[:, 0])[1]
    np.testing.assert_allclose(written[:, 2], exact, atol=1e-4 * np.max(np.abs(read[:, 2])))


def test_rounded_distances_are_rewritten_with_all_digits(tmp_path):
    """Use distances that are equal after rounding, through which no spline exists."""
    rounded = write(
        tmp_path / "t",
        "pair",
        rows=2000,
        spoil=lambda d, h: np.column_stack([np.round(d[:, 0], 2), d[:, 1:]]),
    )
    new = tmp_path / "new"
    rewrite_table(check_table(rounded), new, 2000)
    written = np.array([x.split()[1:] for x in new.read_text().splitlines()[3:]], dtype=float)
    # The force column has 15 digits, and the spline goes through all rows.
    np.testing.assert_allclose(written[:, 2], lennard_jones(written[:, 0])[1], atol=1e-10)


def test_a_bitmap_in_the_order_of_its_distances_is_refused(tmp_path):
    """Refuse such a table: LAMMPS uses row i for the distance with the bits of i."""
    r = np.sort(bitmap_lengths(0.9, 2.5, 8))
    sorted_rows = write(
        tmp_path / "sorted",
        "pair",
        rows=256,
        head={"BITMAP": [0.9, 2.5]},
        spoil=lambda d, h: (
            h.pop("R") and h.pop("FPRIME") and np.transpose([r, *lennard_jones(r)[:2]])
        ),
    )
    report = check_table(sorted_rows)
    assert "255 of 256 distance values differ" in report.faults[0]


def test_lines_beyond_all_need_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("chaincor.workflows.tables.reading.MOST_LINES", 100)
    with pytest.raises(InputError, match="more than 100 lines"):
        check_table(write(tmp_path / "t.table"))


def test_keywords_of_the_header_in_any_order_and_eq_is_kept(tmp_path, chaincor):
    path = write(tmp_path / "t.table", head={"EQ": [1.0]})
    text = path.read_text()
    line = next(line for line in text.splitlines() if line.startswith("N "))
    words = line.split()
    path.write_text(text.replace(line, " ".join([*words[2:], *words[:2]])))
    assert check_table(path).is_good
    new = tmp_path / "new.table"
    assert chaincor("table", path, "--write", new)[0] == 0
    assert "EQ 1" in new.read_text()
    assert check_table(new).is_good


def test_the_command_says_good_and_faulty(tmp_path, chaincor):
    good, faulty = write(tmp_path / "good.table"), write(tmp_path / "faulty.table", rows=8)
    status, out, _ = chaincor("table", good, "--json")
    plain = json.loads(out)
    assert status == 0
    assert (plain["rows"], plain["faults"]) == (400, [])
    assert 0.0 < plain["error"] < 1e-3
    assert {"kind", "range", "summary", "error", "core_error", "rows_wanted"} <= set(plain)
    status, out, _ = chaincor("table", faulty, "--tolerance", "1e-3")
    assert status == 1
    assert out.splitlines()[-1].startswith("Not good: 8 rows leave an error near")
    status, out, _ = chaincor("table", faulty)
    assert status == 0
    assert re.match(r"Good to \S+ % of the local force between 0.6 and 2\.", out.splitlines()[-1])
    assert chaincor("table", tmp_path / "none.table")[0] == 2
    assert chaincor("table", good, "--rows", "3")[0] == 2
    assert chaincor("table", good, "--range", "2")[0] == 2


@pytest.mark.parametrize("kind", FUNCTIONS)
def test_what_is_written_is_a_good_table_of_the_same_force(tmp_path, kind, chaincor):
    """Correct energies in another unit, and keep the forces, whose spline has 400 rows."""
    path = write(tmp_path / "t.table", kind, spoil=lambda d, h: d * [1, 4.184, 1])
    new = tmp_path / "new.table"
    words = ["table", path, "--kind", kind, "--write", new, "--rows", "1000"]
    assert chaincor(*words)[0] == 1
    report = check_table(new, kind=kind)
    assert report.faults == ()
    assert report.rows == 1000
    rows = np.array([x.split()[1:] for x in new.read_text().splitlines()[3:]], dtype=float)
    exact = FUNCTIONS[kind][0](rows[:, 0])[1]
    assert rows[:, 2] == pytest.approx(exact, abs=1e-5 * report.largest_force)
    for target, line in (
        (new, "exists already"),
        (new / "new", "Give another path, inside a folder"),
    ):
        words[words.index("--write") + 1] = target
        status, out, err = chaincor(*words)
        assert (status, out) == (2, "")
        assert line in err


def test_a_kink_beside_smaller_forces_counts_at_its_own_place(tmp_path):
    """Use a local force that falls by a factor of four within the seven rows for the noise."""
    kink, push, core, well = 0.85, 1.5, 400.0, 10.0
    r = np.linspace(0.7, 1.4, 71)

    def force(at):
        inside = np.minimum(at - kink, 0.0)
        return np.where(at < kink, push - core * inside, -well * (at - 1.0))

    inside = np.minimum(r - kink, 0.0)
    energy = 0.5 * well * (np.maximum(r, kink) - 1.0) ** 2
    energy += 0.5 * core * inside**2 - push * inside
    rows = zip(r, energy, force(r), strict=True)
    lines = [f"{k} {a:.15g} {e:.15g} {f:.15g}" for k, (a, e, f) in enumerate(rows, 1)]
    (tmp_path / "t").write_text("\n".join(["KEY", "N 71", "", *lines, ""]))
    report = check_table(tmp_path / "t", kind="bond")
    true = true_error(report, force)
    assert 0.5 * true < report.error < 2.0 * true
