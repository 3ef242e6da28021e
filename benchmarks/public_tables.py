"""
Test estimated errors of public tables, by LAMMPS and by omitted rows.

Run: python -m benchmarks.public_tables FILE ... [--most 40] [--csv FILE]

Every second row of each section is kept, and `check_table` estimates the error of the force. The
installed LAMMPS interpolates the kept rows. LAMMPS's forces are compared with the omitted rows. The
means of these forces over seven rows are compared with the slopes of LAMMPS's energies.
"""

import argparse
import csv
import itertools
import re
import tempfile
from pathlib import Path

import numpy as np

from chaincor import check_table
from chaincor.lammps_inputs.errors import InputError, TableError
from chaincor.workflows.tables.lammps_run import run_lammps
from chaincor.workflows.tables.reading import kind_of, read_table_sections, read_text

_LEAST_ROWS = 40
_FINER = 4
_BESIDE = 7
# Smallest error: a millionth of the local force, which is the last digit that LAMMPS writes.
_LEAST = 1e-6
# Largest error: the whole local force.
_MOST = 1.0
# LAMMPS replaces the sine of an angle by 0.001 if it is smaller. Forces are therefore wrong within
# this many degrees of 0 and 180.
_NEAR_ENDS = 0.06
# A cubic spline through even rows amplifies the rounding of the rows at most by this factor.
_BETWEEN_ROWS = 1.55


def keywords(path):
    """Return the keywords of a file: the first words of the lines before lines with N."""
    lines = [line.split("#")[0].split() for line in read_text(path).splitlines()]
    lines = [words for words in lines if words]
    return [
        a[0] for a, b in itertools.pairwise(lines) if re.fullmatch("N", b[0]) and not a[0].isdigit()
    ]


def halved(path, keyword, target):
    """Write every second row of a section; return its kind, all rows, and their rounding."""
    (section, *_) = read_table_sections(path, keyword)
    data, kind = section.data, kind_of(section)
    steps = np.diff(data[:, 0])
    even = np.ptp(steps) < 1e-3 * np.mean(steps)
    if len(data) < _LEAST_ROWS or not even or kind == "dihedral" or "BITMAP" in section.header:
        return None
    data = data[: len(data) - (len(data) + 1) % 2]
    rounding = 0.5 * section.least_digits[: len(data), 1:]
    kept = data[::2]
    header = f"N {len(kept)}"
    if kind == "pair":
        header += f" R {kept[0, 0]} {kept[-1, 0]}"
    if slopes := section.header.get("FP") or section.header.get("FPRIME"):
        header += f" {'FPRIME' if kind == 'pair' else 'FP'} {slopes[0]} {slopes[1]}"
    # The shortest decimals preserve the number of digits in the file, which is a source of error.
    rows = [" ".join(map(repr, [k, *row])) for k, row in enumerate(kept.tolist(), 1)]
    target.write_text("\n".join(["KEY", header, "", *rows, ""]))
    return kind, data, rounding


def true_error(report, data, rounding, path):
    """
    Return LAMMPS's largest errors in the range of the report, relative to the local force.

    `rounding`, of shape (rows, 2), is half a unit of the last digit of energies and forces.
    Differences from the rows below this rounding are not errors.
    """
    judge = report.curves
    low, high = data[0, 0], data[-1, 0]
    count = (len(data) - 1) * _FINER + 1
    given = run_lammps(path, "KEY", report.kind, "spline", report.rows, (low, high), count)
    if given.error:
        return None
    at_rows = slice(None, None, _FINER)
    r = data[:, 0]
    margin = _NEAR_ENDS if report.kind == "angle" else 0.0
    # LAMMPS's cutoff is the last row, at which pairs have no force.
    first, last = max(report.range[0], low + margin), min(report.range[1], high - margin)
    inside = (r >= first) & (r <= last) & (r < high)
    off = np.clip(np.abs(given.forces[at_rows] - data[:, 2]) - rounding[:, 1], 0.0, None)
    missed = off[inside] / judge.size_at(r[inside])
    # Between rows at a distance of seven kept rows, the energy difference must agree with the mean
    # force.
    wide = 2 * _BESIDE * _FINER
    h = (high - low) / (count - 1)
    f = given.forces
    simpson = h / 3.0 * (f[:-2:2] + 4.0 * f[1:-1:2] + f[2::2])
    # Each window is summed separately, because cumulative sums would lose the digits of the well
    # beside the much larger core.
    windows = np.lib.stride_tricks.sliding_window_view(simpson, wide // 2)
    forces = windows.sum(axis=1) / (wide * h)
    slopes = -(given.energies[wide:] - given.energies[:-wide])[::2] / (wide * h)
    middle = given.lengths[wide // 2 : -wide // 2][::2]
    edge = 0.5 * wide * h
    inside = (middle - edge >= first) & (middle + edge <= last) & (middle + edge < high)
    ends = (middle - edge, middle + edge)
    room = _BETWEEN_ROWS * sum(np.interp(at, r, rounding[:, 0]) for at in ends)
    off = np.clip(np.abs(forces - slopes) - room / (wide * h), 0.0, None)
    parted = off[inside] / judge.size_at(middle[inside])
    return float(np.max(missed, initial=0.0)), float(np.max(parted, initial=0.0))


def main():
    """Judge sections; print how many estimated errors are right within a factor of two."""
    parser = argparse.ArgumentParser(description="Judge tables that others wrote.")
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--most", type=int, default=40)
    parser.add_argument("--csv", type=Path)
    options = parser.parse_args()
    found = []
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "half.table"
        for path in options.files:
            for keyword in dict.fromkeys(keywords(path)):
                if len(found) >= options.most:
                    break
                try:
                    half = halved(path, keyword, target)
                    if half is None:
                        continue
                    kind, data, rounding = half
                    report = check_table(target, kind=kind)
                    if report.curves is None or not report.error:
                        continue
                    true = true_error(report, data, rounding, target)
                except (InputError, TableError) as error:
                    print(f"{path.name} {keyword}: {error}")
                    continue
                if true is None:
                    continue
                ratio = np.clip(report.error, _LEAST, _MOST) / np.clip(max(true), _LEAST, _MOST)
                found.append((path.name, keyword, kind, report.rows, report.error, *true, ratio))
                print(
                    f"{path.name:<30} {keyword:<16} {kind:<6} {report.rows:>6} said "
                    f"{report.error:.2e}, rows {true[0]:.2e}, energies {true[1]:.2e}, ratio "
                    f"{ratio:.2f} {report.cause}",
                    flush=True,
                )
    within = sum(0.5 <= row[-1] <= 2.0 for row in found)
    print(f"{within} of {len(found)} errors are within a factor of two of LAMMPS's")
    if options.csv:
        with options.csv.open("w", newline="") as file:
            csv.writer(file).writerows(found)


if __name__ == "__main__":
    main()
