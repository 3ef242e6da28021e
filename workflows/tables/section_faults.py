"""Find faults in the header, the spacing and the numbers of a table."""

import re
from dataclasses import replace

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.named_bond import LARGEST
from chaincor.lammps_inputs.bonds.table_checks import faults_of_lines
from chaincor.lammps_inputs.bonds.table_rows import LEAST_ROWS
from chaincor.lammps_inputs.bonds.table_text import SETTINGS, Section
from chaincor.workflows.tables.lammps_curve import TableData, TableKind
from chaincor.workflows.tables.reading import (
    WHOLE_TURN,
    lengths_of_bitmap,
    lengths_of_header,
    with_lengths_of_header,
)

# For each kind of table, LAMMPS knows these words in the header.
_KNOWN: dict[TableKind, set[str]] = {
    "bond": {"N", "FP", "EQ"},
    "angle": {"N", "FP", "EQ"},
    "dihedral": {"N", "NOF", "DEGREES", "RADIANS", "CHECKU", "CHECKF"},
    "pair": {"N", "R", "RSQ", "BITMAP", "FPRIME"},
}
# LAMMPS refuses an angle table if one of its ends differs from 0 or 180 degrees by more than this.
_ANGLE_ENDS = 1e-10
# LAMMPS recomputes distances from R, RSQ or BITMAP. It warns if these differ from the distances in
# the file by more than this fraction.
_SAME_LENGTH = 1e-6
# Cubic splines overflow if two rows are closer to each other than this.
_NEAREST = 1e-30
# LAMMPS cannot read lines of these kinds. Each kind has a message with a remedy.
_UNREADABLE = (
    (
        re.compile(r"^[ \t]*\d+[ \t]*[,;][ \t]*[-+.\d].*$", re.MULTILINE),
        "its columns are separated by commas or semicolons: {}. Separate them by spaces",
    ),
    (
        re.compile(r"^[ \t]*\d+[ \t]+[-+]?\d+,\d+.*$", re.MULTILINE),
        "its numbers have decimal commas: {}. Write decimal points",
    ),
    (
        re.compile(r"^[ \t]*\d+[ \t].*\d\.?[dD][-+]?\d+.*$", re.MULTILINE),
        "its numbers have exponents with D, which LAMMPS cannot read: {}. Write E instead",
    ),
)


def faults_of_text(text: str) -> list[str]:
    """Return line ends, separators and numbers that LAMMPS cannot read."""
    faults = []
    if re.search(r"\r(?!\n)", text):
        faults.append(
            "its lines end with a carriage return alone, so LAMMPS reads them as "
            "one line. Convert the line ends, for example with tr '\\r' '\\n'"
        )
    for pattern, said in _UNREADABLE:
        if match := pattern.search(text):
            faults.append(said.format(repr(match.group().strip()[:60])))
    return faults


def faults_of_header(section: Section, kind: TableKind) -> list[str]:
    """Return contradictions between header and rows, and header words that LAMMPS does not know."""
    header, data = section.header, section.data
    if len(section.odd_lines) > len(data):
        if [line.split()[0] for line in section.odd_lines[:3]] == ["1", "2", "3"]:
            return [
                f"its rows have no force: {section.odd_lines[0][:60]!r}. Add -dE/dr as the fourth "
                "column, or the word NOF after N in a dihedral table"
            ]
        return [
            f"its rows have no index: {section.odd_lines[0][:60]!r}. Begin each row with a "
            "whole number: 'index length energy force'"
        ]
    if "N" not in header:
        return [
            "LAMMPS does not read it, because no line 'N rows' precedes its rows. Add this line"
        ]
    faults = []
    unknown = [name for name in header if name not in _KNOWN[kind]]
    if unknown:
        faults.append(
            f"its header has {' and '.join(unknown)}, which LAMMPS refuses in {kind} "
            f"tables. Use only {', '.join(sorted(_KNOWN[kind]))}"
        )
    if not section.keyword or section.keyword.isdigit():
        faults.append("its section has no keyword. Write a name in the line before 'N rows'")
    faults += faults_of_lines(_without_skipped(section, kind))
    if header["N"][0] != len(data):
        faults.append(
            f"it says N {header['N'][0]:g} but has {len(data)} rows, so LAMMPS stops before "
            "its end or reads past it. Correct N"
        )
    elif kind != "dihedral" and not section.is_parted:
        faults.append(
            "LAMMPS skips its first row, because no empty line follows the line 'N "
            "rows'. Insert an empty line"
        )
    lengths = data[:, 0]
    if len(lengths) >= 2 and np.all(np.isfinite(lengths)):
        faults += _faults_of_range(section, kind)
    return faults


def _without_skipped(section: Section, kind: TableKind) -> Section:
    """
    Return a section as LAMMPS reads it for this kind.

    LAMMPS skips the line after the header, except in dihedral tables.
    """
    if kind != "dihedral" or not section.skipped:
        return section
    return replace(section, skipped="", odd_lines=(section.skipped, *section.odd_lines))


def notes_on_lines(section: Section, kind: TableKind) -> list[str]:
    """Return notes on lines that LAMMPS ignores."""
    section, notes = _without_skipped(section, kind), []
    if section.unread:
        notes.append(
            f"LAMMPS does not read the line {section.unread[:60]!r} before the keyword "
            f"{section.keyword}"
        )
    if section.skipped and section.skipped.split()[0] not in SETTINGS:
        notes.append(f"LAMMPS skips the line {section.skipped[:60]!r} after the line 'N rows'")
    return notes


def _faults_of_range(section: Section, kind: TableKind) -> list[str]:
    header, lengths = section.header, section.data[:, 0]
    low, high = float(lengths[0]), float(lengths[-1])
    faults = []
    if kind == "angle" and (abs(low) > _ANGLE_ENDS or abs(high - WHOLE_TURN) > _ANGLE_ENDS):
        is_radians = abs(low) < 0.1 and abs(high - np.pi) < 0.1
        help_ = ". Convert radians to degrees, and forces as well" if is_radians else ""
        faults.append(
            f"its angles go from {low:g} to {high:g}, which LAMMPS refuses. Give "
            f"angles from 0 to 180 degrees{help_}"
        )
    if kind == "dihedral":
        faults += _faults_of_turn(header, lengths)
    bounds = header.get("R") or header.get("RSQ") or header.get("BITMAP") or [low, high]
    if kind == "pair" and bounds[0] <= 0.0:
        faults.append(
            f"its distances begin at {bounds[0]:g}, which LAMMPS refuses. Give distances above 0"
        )
    if kind == "pair" and bounds[1] <= bounds[0]:
        faults.append(
            f"its range {bounds[0]:g} to {bounds[1]:g} is empty, which LAMMPS "
            "refuses. Give increasing distances"
        )
    elif kind == "pair":
        faults += faults_of_spacing(section)
    if "EQ" in header and not low <= header["EQ"][0] <= high:
        faults.append(
            f"it says EQ {header['EQ'][0]:g}, but its rows go from {low:g} to {high:g}. "
            "Give EQ inside this range"
        )
    return faults


def _faults_of_turn(header: dict[str, list[float]], angles: Array) -> list[str]:
    """Return a fault if a dihedral's angles cover more than a turn, or have the wrong unit."""
    low, high = float(angles[0]), float(angles[-1])
    in_radians = "RADIANS" in header
    whole = 2.0 * np.pi if in_radians else 360.0
    step = (high - low) / (len(angles) - 1)
    said = f"its angles go from {low:g} to {high:g}"
    if in_radians and high - low > 2.0 * whole:
        return [f"{said}, which LAMMPS refuses as radians. Replace RADIANS by DEGREES"]
    if not in_radians and abs(high + step - low - 2.0 * np.pi) < 1.5 * step + 0.01:
        return [f"{said}: a turn in radians. Write RADIANS after N"]
    if high - low >= whole:
        return [
            f"{said}; LAMMPS refuses a dihedral table of a whole turn of {whole:.6g} or more: "
            "leave out the last row, which repeats the first"
        ]
    return []


def faults_of_spacing(section: Section) -> list[str]:
    """Return a fault if distances in the file differ from those that LAMMPS recomputes."""
    name = next((name for name in ("R", "RSQ", "BITMAP") if name in section.header), None)
    if name is None:
        return []
    lengths = section.data[:, 0]
    bits = len(lengths).bit_length() - 1
    if name == "BITMAP" and 1 << bits != len(lengths):
        return [
            f"it is a BITMAP table of {len(lengths)} rows, which LAMMPS refuses. Give a "
            "number of rows that is a power of 2"
        ]
    made = lengths_of_header(section)
    off = np.abs(lengths - made) > _SAME_LENGTH * np.abs(made) + section.digits[:, 0]
    if not np.any(off):
        return []
    row, (low, high) = int(np.flatnonzero(off)[0]), section.header[name]
    # Here the rows of a bitmap are sorted by distance, unlike in the file.
    file_order = lengths_of_bitmap(section) if name == "BITMAP" else None
    first = 0 if file_order is None else int(np.argmin(file_order))
    in_file = (row + first) % len(lengths)
    return [
        f"{np.count_nonzero(off)} of {len(lengths)} distance values differ from those of its line "
        f"'{name} {low:g} {high:g}', which LAMMPS takes instead: row {in_file + 1} is at "
        f"{lengths[row]:.9g}, not {made[row]:.9g}. {_right_distances(section, name, made)}"
    ]


def _right_distances(section: Section, name: str, made: Array) -> str:
    """Return the remedy for distances that differ from those of the header."""
    lengths, room = section.data[:, 0], section.digits[:, 0]

    def are_same(others: Array) -> bool:
        return bool(np.all(np.abs(lengths - others) <= _SAME_LENGTH * np.abs(others) + room))

    low, high = float(np.min(lengths)), float(np.max(lengths))
    if are_same(made**2):
        return "The r column holds r squared: take its root"
    for word, power in (("R", 1), ("RSQ", 2)):
        if low > 0.0 and are_same(
            np.roll(
                np.linspace(low**power, high**power, len(lengths)) ** (1.0 / power),
                -int(np.argmin(lengths)),
            )
        ):
            return f"Write '{word} {low:.9g} {high:.9g}' after N"
    if name == "BITMAP" and np.allclose(np.sort(lengths), made, rtol=_SAME_LENGTH):
        return "Write the rows in the order of pair_write, not in rising order"
    return f"Recompute r, or leave out {name}"


def fault_of_values(header: dict[str, list[float]]) -> str | None:
    """Return a fault if a header has values that are not finite or too large, otherwise None."""
    for name, values in header.items():
        if not all(abs(value) <= LARGEST for value in values):
            said = " ".join(f"{value:g}" for value in values)
            return f"its header says {name} {said}. Give finite numbers of at most {LARGEST:g}"
    return None


def _right_order(data: Array) -> str:
    """Return the remedy for rows whose lengths do not increase."""
    steps = np.diff(data, axis=0)
    if np.all(steps[:, 0] < 0.0):
        return "Reverse the order of the rows"
    for column, name in ((1, "third"), (2, "fourth")):
        if np.all(steps[:, column] > 0.0) and np.ptp(steps[:, column]) < 1e-3 * np.ptp(
            data[:, column]
        ):
            return f"The {name} column rises evenly: exchange it with the second"
    if np.all(steps[:, 0] >= 0.0):
        return "Keep one of the rows, or write more digits"
    return "Sort the rows by length"


def fault_of_numbers(section: Section, kind: TableKind) -> str | None:
    """
    Return why the rows of a sorted section form no valid table; None if they form one.

    Lengths must increase. If LAMMPS recomputes distances from the header, only the recomputed
    distances must increase, because those in the file may be equal after rounding.
    """
    data, has_forces = section.data, "NOF" not in section.header
    columns = data if has_forces else data[:, :2]
    wrong = np.flatnonzero(~np.all(np.abs(columns) <= LARGEST, axis=1))
    if len(wrong):
        said = " ".join(f"{number:g}" for number in data[wrong[0]])
        return f"row {wrong[0] + 1} says '{said}'. Give finite numbers of at most {LARGEST:g}"
    if len(data) < LEAST_ROWS:
        return f"it has {len(data)} rows. Give at least {LEAST_ROWS}"
    lengths = with_lengths_of_header(section, kind).data[:, 0]
    steps = np.diff(lengths)
    falling = np.flatnonzero(steps <= 0.0)
    if len(falling):
        row = int(falling[0]) + 2
        return (
            f"{kind} table values are not increasing: row {row} at "
            f"{lengths[row - 1]:.9g} follows {lengths[row - 2]:.9g}, and LAMMPS "
            "refuses such a table or reads past its end. Sort the rows. "
            f"{_right_order(data)}"
        )
    nearest = int(np.argmin(steps))
    if steps[nearest] < _NEAREST:
        return f"rows {nearest + 1} and {nearest + 2} are closer than {_NEAREST:g}. Move them apart"
    if has_forces and np.all(data[:, 2] == 0.0) and np.ptp(data[:, 1]) > 0.0:
        return "all forces are 0. Write -dE/dr into the fourth column"
    return None


def count_of_warnings(section: Section, table: TableData) -> tuple[int, int]:
    """
    Return the numbers of forces and distances about which LAMMPS will warn.

    LAMMPS warns about a force that is not between the values of -dE/dr towards both neighbours, and
    about a distance that differs from its recomputed distance.
    """
    distances = 0
    if table.kind == "pair" and set(section.header) & {"R", "RSQ", "BITMAP"}:
        given, made = section.data[:, 0], table.lengths
        with np.errstate(divide="ignore", invalid="ignore"):
            distances = int(np.count_nonzero(np.abs(made - given) / given > _SAME_LENGTH))
    if table.kind not in ("bond", "pair") or table.is_bitmap:
        return 0, distances
    slopes = -np.diff(table.energies) / np.diff(table.lengths)
    low, high = np.minimum(slopes[:-1], slopes[1:]), np.maximum(slopes[:-1], slopes[1:])
    inside = table.forces[1:-1]
    return int(np.count_nonzero((inside < low) | (inside > high))), distances
