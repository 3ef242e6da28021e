"""Read table files as LAMMPS does, and find faults for which LAMMPS refuses a file."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.table_text import SETTINGS, Section, sections_of
from chaincor.lammps_inputs.errors import InputError, TableError
from chaincor.lammps_inputs.small_file import refuse_endless, why_unreadable
from chaincor.workflows.tables.lammps_curve import TableData, TableKind, bitmap_lengths

KINDS: tuple[TableKind, ...] = ("bond", "angle", "dihedral", "pair")
MOST_LINES = 10_000_000
WHOLE_TURN = 180.0
# The slope of the energy in this last part of the range distinguishes pairs from bonds.
_TAIL = 0.1
_UNITS = re.compile(r"UNITS:\s*(\w+)")
# Values of kT at 300 K for each style of units; kT = 1 for lj. In files that LAMMPS wrote, the
# first line names the units.
_THERMAL = {"lj": 1.0, "real": 0.59616, "metal": 0.025852, "electron": 9.5004e-4, "si": 4.1419e-21}


def read_text(path: Path) -> str:
    """Return the text of a table file; raise InputError if it cannot be read."""
    try:
        refuse_endless(path)
        return path.read_bytes().decode("utf-8", "replace")
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot read the table {str(path)!r} ({why_unreadable(error)}). Give a readable file"
        ) from None


def read_table_sections(path: Path, keyword: str | None, text: str | None = None) -> list[Section]:
    """
    Return the sections with a keyword.

    If no keyword is given, return the only section.

    Raise InputError if the file cannot be read, if no section has the keyword, or if the file has
    several sections and no keyword is given. Raise TableError if the file has no section or has
    unreadable lines.
    """
    text = read_text(path) if text is None else text
    if text.count("\n") > MOST_LINES:
        raise InputError(
            f"the table {str(path)!r} has more than {MOST_LINES} lines. Give fewer rows"
        )
    sections = sections_of(text, str(path), SETTINGS)
    if not sections:
        raise TableError(
            f"{str(path)!r} has no line 'N rows' and no row 'index length energy force'. "
            "Write a keyword, the line 'N rows', and the rows"
        )
    names = list(dict.fromkeys(each.keyword for each in sections))
    chosen = names[0] if keyword is None and len(names) == 1 else keyword
    found = [each for each in sections if each.keyword == chosen]
    if not found:
        named = ", ".join(name or "one without a keyword" for name in names)
        raise InputError(
            f"{str(path)!r} has the sections {named}, and "
            f"{('none was chosen' if keyword is None else f'none is {keyword!r}')}. Choose "
            "one with --keyword"
        )
    return found


def thermal_energy(text: str) -> tuple[float, str]:
    """Return kT in a file's unit of energy, and how this value was found."""
    match = _UNITS.search(text[:1000])
    units = match.group(1) if match else ""
    if units in _THERMAL:
        how = "lj units" if units == "lj" else f"300 K in {units} units"
        return _THERMAL[units], f"kT = {_THERMAL[units]:g}, {how}"
    return 1.0, "kT = 1 assumed; the file names no units"


def kind_of(section: Section) -> TableKind:
    """Guess the kind of a table from its header, range and energies."""
    words = set(section.header)
    if words & {"R", "RSQ", "BITMAP", "FPRIME"}:
        return "pair"
    if words & {"NOF", "DEGREES", "RADIANS"}:
        return "dihedral"
    x, energies, _ = section.data.T
    if len(x) < 2 or not np.all(np.isfinite(x)):
        return "bond"
    low, high = float(x[0]), float(x[-1])
    for turn in (360.0, 2.0 * np.pi):
        step = (high - low) / (len(x) - 1)
        if abs(high + step - low - turn) < 1.5 * step + 1e-3 * turn and (
            abs(low) < 2.0 * step or abs(low + turn / 2.0) < 2.0 * step
        ):
            return "dihedral"
    if -1.0 <= low <= 2.0 and abs(high - WHOLE_TURN) <= 2.0:
        return "angle"
    if abs(low) < 1e-3 and abs(high - np.pi) < 1e-2:
        return "angle"
    if "EQ" in words or "FP" in words:
        return "bond"
    outside = energies[np.argmin(energies) :]
    # At the cutoff, energies of pairs vanish with nearly no slope.
    change = abs(energies[-1] - np.interp(high - _TAIL * (high - low), x, energies)) / _TAIL
    if len(outside) > 2 and abs(energies[-1]) + change < 0.35 * float(np.ptp(outside)):
        return "pair"
    return "bond"


def table_data(section: Section, kind: TableKind) -> TableData:
    """
    Return the rows of a sorted section as LAMMPS stores them.

    If the header of a pair table has R, RSQ or BITMAP, the distances are recomputed from it as in
    LAMMPS. The rows must have passed `fault_of_numbers`.
    """
    header = section.header
    lengths, energies, forces = with_lengths_of_header(section, kind).data.T
    slopes = header.get("FPRIME" if kind == "pair" else "FP")
    period = 0.0
    if kind == "dihedral":
        period = 2.0 * np.pi if "RADIANS" in header else 360.0
    return TableData(
        kind,
        lengths,
        energies,
        forces if "NOF" not in header else np.full(len(lengths), np.nan),
        (slopes[0], slopes[1]) if slopes else None,
        is_bitmap=kind == "pair" and "BITMAP" in header,
        period=period,
    )


def in_order(section: Section) -> Section:
    """
    Return a section; if it is a bitmap, sort its rows by distance.

    A bitmap's first row in the file does not have the smallest distance. LAMMPS computes each
    distance from the index of the row, so the order does not depend on the distances in the file.
    """
    if "BITMAP" not in section.header or not len(section.data):
        return section
    lengths = lengths_of_bitmap(section)
    first = -int(np.argmin(section.data[:, 0] if lengths is None else lengths))
    data, digits = (np.roll(rows, first, axis=0) for rows in (section.data, section.digits))
    return replace(section, data=data, digits=digits)


def with_lengths_of_header(section: Section, kind: TableKind) -> Section:
    """Return a sorted section; for pairs, replace its distances by those that LAMMPS recomputes."""
    if kind != "pair" or not set(section.header) & {"R", "RSQ", "BITMAP"}:
        return section
    lengths = lengths_of_header(section)
    data, digits = section.data.copy(), section.digits.copy()
    data[:, 0], digits[:, 0] = lengths, np.spacing(lengths)
    return replace(section, data=data, digits=digits)


def lengths_of_header(section: Section) -> Array:
    """Return the distances that LAMMPS computes from R, RSQ or BITMAP, in increasing order."""
    header, lengths = section.header, section.data[:, 0]
    for name, power in (("R", 1), ("RSQ", 2)):
        if name in header:
            low, high = header[name]
            made: Array = np.linspace(low**power, high**power, len(lengths)) ** (1.0 / power)
            return made
    made_of_bits = lengths_of_bitmap(section)
    return lengths if made_of_bits is None else np.sort(made_of_bits)


def lengths_of_bitmap(section: Section) -> Array | None:
    """Return the distances of a bitmap's rows in the file's order; None if LAMMPS computes none."""
    rows = len(section.data)
    bits = rows.bit_length() - 1
    if "BITMAP" not in section.header or 1 << bits != rows:
        return None
    try:
        return bitmap_lengths(section.header["BITMAP"][0], section.header["BITMAP"][1], bits)
    except (ValueError, OverflowError):
        return None
