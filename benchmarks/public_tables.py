"""
Errors of tables that others wrote, judged by LAMMPS and by rows that were held out.

Run: python -m benchmarks.public_tables FILE ... [--most 40] [--csv FILE]

Every second row of each section is kept, and `check_table` gives the error of the force. The
installed LAMMPS interpolates the kept rows. Its forces are compared with the rows that were held
out, and their means with the slopes of its energies over seven rows.
"""

import argparse
import csv
import itertools
import re
import tempfile
from pathlib import Path

import numpy as np

from chaincor import check_table
from chaincor.lammps_inputs.bonds.table_text import section_text
from chaincor.lammps_inputs.errors import InputError, TableError
from chaincor.workflows.tables.lammps_run import run_lammps
from chaincor.workflows.tables.reading import kind_of, read_sections, read_text

_LEAST_ROWS = 40
_FINER = 4
_BESIDE = 7
# Errors below these are equal: a millionth of the local force, the last digits of LAMMPS's writers.
_LEAST = 1e-6


def keywords(path):
    """Return the keywords of a file: the first words before lines with N."""
    lines = [line.split("#")[0].split() for line in read_text(path).splitlines()]
    lines = [words for words in lines if words]
    return [
        a[0] for a, b in itertools.pairwise(lines) if re.fullmatch("N", b[0]) and not a[0].isdigit()
    ]


def halved(path, keyword, target):
    """Write every second row of a section; return its kind and all rows."""
    (section, *_) = read_sections(path, keyword)
    data, kind = section.data, kind_of(section)
    steps = np.diff(data[:, 0])
    even = np.ptp(steps) < 1e-3 * np.mean(steps)
    if len(data) < _LEAST_ROWS or not even or kind == "dihedral" or "BITMAP" in section.header:
        return None
    data = data[: len(data) - (len(data) + 1) % 2]
    kept = data[::2]
    header = f"N {len(kept)}"
    if kind == "pair":
        header += f" R {kept[0, 0]:.17g} {kept[-1, 0]:.17g}"
    if slopes := section.header.get("FP") or section.header.get("FPRIME"):
        header += f" {'FPRIME' if kind == 'pair' else 'FP'} {slopes[0]:.17g} {slopes[1]:.17g}"
    target.write_text(section_text("KEY", header, kept.T))
    return kind, data


def true_error(report, data, path):
    """Return LAMMPS's largest error in the report's range, as a part of the local force."""
    judge = report.curves
    low, high = data[0, 0], data[-1, 0]
    count = (len(data) - 1) * _FINER + 1
    given = run_lammps(path, "KEY", report.kind, "spline", report.rows, (low, high), count)
    if given.error:
        return None
    at_rows = slice(None, None, _FINER)
    r = data[:, 0]
    # LAMMPS's cutoff is the last row, where its pairs have no force any more.
    inside = (r >= report.range[0]) & (r <= report.range[1]) & (r < high)
    missed = np.abs(given.forces[at_rows] - data[:, 2])[inside] / judge.size_at(r[inside])
    # Between rows that are seven kept rows apart, energies and mean forces must agree.
    wide = 2 * _BESIDE * _FINER
    h = (high - low) / (count - 1)
    f = given.forces
    simpson = h / 3.0 * (f[:-2:2] + 4.0 * f[1:-1:2] + f[2::2])
    # Sums over windows: cumulated ones would lose the well behind the core.
    windows = np.lib.stride_tricks.sliding_window_view(simpson, wide // 2)
    forces = windows.sum(axis=1) / (wide * h)
    slopes = -(given.energies[wide:] - given.energies[:-wide])[::2] / (wide * h)
    middle = given.lengths[wide // 2 : -wide // 2][::2]
    edge = 0.5 * wide * h
    inside = (middle - edge >= report.range[0]) & (middle + edge <= report.range[1])
    inside &= middle + edge < high
    parted = np.abs(forces - slopes)[inside] / judge.size_at(middle[inside])
    return float(np.max(missed, initial=0.0)), float(np.max(parted, initial=0.0))


def main():
    """Judge sections and print how many errors are within a factor of two."""
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
                    kind, data = half
                    report = check_table(target, kind=kind)
                    if report.curves is None or not report.error:
                        continue
                    true = true_error(report, data, target)
                except (InputError, TableError) as error:
                    print(f"{path.name} {keyword}: {error}")
                    continue
                if true is None:
                    continue
                ratio = max(report.error, _LEAST) / max(*true, _LEAST)
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
