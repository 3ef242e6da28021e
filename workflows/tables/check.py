"""What is wrong with a table of a bond, angle or pair, and what its rows and digits leave open."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from chaincor.lammps_inputs.bonds.table_checks import Section, sections_of
from chaincor.lammps_inputs.bonds.table_rows import Rows, spline_through
from chaincor.lammps_inputs.errors import InputError, TableError
from chaincor.lammps_inputs.small_file import refuse_endless, why_unreadable
from chaincor.workflows.tables.faults import (
    WHOLE_ANGLE,
    Kind,
    count_inconsistent,
    ends_by_zero,
    fault_of_numbers,
    faults_of_header,
    faults_of_rows,
    left_open,
)

Style = Literal["linear", "spline", "lookup"]

KINDS: tuple[Kind, ...] = ("bond", "angle", "pair")
STYLES: tuple[Style, ...] = ("spline", "linear", "lookup")
# Of the largest force: what energies and forces may disagree by, and what rows are counted for
# where nobody says.
TOLERANCE = 1e-3
MOST_LINES = 10_000_000


@dataclass(frozen=True)
class TableReport:
    """
    What is known of a table.

    Attributes
    ----------
    path : str
        The file.
    keyword : str
        The section.
    kind, style : str
        What it is a table of, and how LAMMPS shall interpolate in it.
    rows : int
        How many were read.
    tolerance : float or None
        What a good table leaves open at most, where that was asked.
    faults : tuple of str
        What is wrong, a sentence each; none of a good table.
    notes : tuple of str
        What LAMMPS will warn of, where an error comes from, and what else is worth knowing.
    low, high : float
        First and last length, or angle.
    zeros : tuple of float
        Where the force vanishes.
    largest_force : float
        Of all rows; the unit of the errors below.
    error : float or None
        Largest error of the force that rows and digits leave, with that of the style; None where
        the rows are no table.
    noise : float or None
        Standard deviation of what no smooth force explains.
    style_error : float or None
        Largest error by interpolation in so many rows, of ``linear`` and ``lookup``; 0 of splines,
        whose error is that of the rows.
    rows_wanted : dict of str to int
        Rows that reach the tolerance, or 0.001 of the force, by style; without what no number of
        rows reaches.
    """

    path: str
    keyword: str
    kind: Kind
    style: Style
    rows: int
    tolerance: float | None
    faults: tuple[str, ...]
    notes: tuple[str, ...] = ()
    low: float = math.nan
    high: float = math.nan
    zeros: tuple[float, ...] = ()
    largest_force: float = math.nan
    error: float | None = None
    noise: float | None = None
    style_error: float | None = None
    rows_wanted: dict[str, int] = field(default_factory=dict)

    @property
    def is_good(self) -> bool:
        """Whether nothing is wrong."""
        return not self.faults


def check_table(
    path: Path | str,
    keyword: str | None = None,
    *,
    style: Style = "spline",
    kind: Kind | None = None,
    tolerance: float | None = None,
) -> TableReport:
    r"""
    Check a table that LAMMPS reads by ``bond_style``, ``angle_style`` or ``pair_style table``.

    Rows are compared with :math:`-dE/dr`, with each other and with the header. What lies between
    them is shown by leaving every second one out; digits, by what one unit of the last of them is.

    Parameters
    ----------
    path : path
        The file.
    keyword : str, optional
        The section; by default the only one.
    style : str, optional
        How LAMMPS interpolates: ``spline``, ``linear`` or ``lookup`` in as many rows as the file
        has.
    kind : str, optional
        ``bond``, ``angle`` or ``pair``; by default what header and range say.
    tolerance : float, optional
        Error of the force, as a part of the largest, beyond which a table is faulty. Without one
        the error is told and not judged: what is enough depends on what the table is for.

    Returns
    -------
    TableReport
        Error and faults.

    Raises
    ------
    InputError
        If the file cannot be read, has no such section, or an option makes no sense.

    Examples
    --------
    >>> from chaincor import Scene, check_table, write_job
    >>> files = write_job(Scene(particles=5), "job")
    >>> report = check_table("job/bond.table")
    >>> report.rows, report.faults, bool(report.error < 1e-7)
    (201, (), True)
    """
    if tolerance is not None and not 0.0 < tolerance < math.inf:
        raise InputError(f"the tolerance is {tolerance}; expected a positive part of the force")
    if style not in STYLES or (kind is not None and kind not in KINDS):
        raise InputError(
            f"the table is of style {style!r} and kind {kind!r}; expected one of "
            f"{', '.join(STYLES)}, and of {', '.join(KINDS)}"
        )
    path = Path(path)
    try:
        section, *others = read_sections(path, keyword)
    except TableError as error:
        return TableReport(
            str(path), keyword or "", kind or "bond", style, 0, tolerance, (str(error),)
        )
    report = _report(section, path, kind or _kind_of(section), style, tolerance)
    if not others:
        return report
    fault = (
        f"it has {1 + len(others)} sections named {section.keyword}, of which LAMMPS reads the "
        "first; expected a keyword of its own for each"
    )
    return replace(report, faults=(fault, *report.faults))


def read_sections(path: Path, keyword: str | None) -> list[Section]:
    """
    Return the sections of a table file that have a keyword, or that of all; in rising order.

    Raises InputError where the file cannot be read or it is not clear which section is meant, and
    TableError where it holds none or what cannot be read.
    """
    try:
        refuse_endless(path)
        text = path.read_bytes().decode("utf-8", "replace")
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read the table {str(path)!r}: {why_unreadable(error)}") from None
    if text.count("\n") > MOST_LINES:
        raise InputError(
            f"the table {str(path)!r} has more than {MOST_LINES} lines; expected fewer rows: none "
            "needs so many"
        )
    sections = sections_of(text, str(path), pair=True)
    if not sections:
        raise TableError(
            f"{str(path)!r} has no line 'N rows' and no row 'index length energy force'; expected "
            "a keyword, the line 'N rows', and the rows"
        )
    names = list(dict.fromkeys(each.keyword for each in sections))
    chosen = names[0] if keyword is None and len(names) == 1 else keyword
    found = [_in_order(each) for each in sections if each.keyword == chosen]
    if not found:
        named = ", ".join(name or "one without a keyword" for name in names)
        raise InputError(
            f"{str(path)!r} has the sections {named}, and "
            f"{'none was chosen' if keyword is None else f'none is {keyword!r}'}; expected "
            "--keyword with one of them"
        )
    return found


def _in_order(section: Section) -> Section:
    """Let rows in the order of their bits, which begins somewhere inside, begin with the least."""
    if "BITMAP" not in section.header or not len(section.data):
        return section
    first = -int(np.argmin(section.data[:, 0]))
    data, digits = (np.roll(rows, first, axis=0) for rows in (section.data, section.digits))
    return replace(section, data=data, digits=digits)


def _kind_of(section: Section) -> Kind:
    if set(section.header) & {"R", "RSQ", "BITMAP", "FPRIME"}:
        return "pair"
    lengths = section.data[:, 0]
    whole = len(lengths) > 0 and lengths[0] == 0.0 and abs(lengths[-1] - WHOLE_ANGLE) < 1.0
    return "angle" if whole else "bond"


def _report(
    section: Section, path: Path, kind: Kind, style: Style, tolerance: float | None
) -> TableReport:
    data, faults = section.data, faults_of_header(section, kind)
    head = (str(path), section.keyword, kind, style, len(data), tolerance)
    unusable = fault_of_numbers(data, kind)
    if unusable is not None:
        return TableReport(*head, (*faults, unusable))
    lengths, energies, forces = data.T
    largest = float(np.max(np.abs(forces)))
    whole = TableReport(
        *head,
        faults=tuple(faults),
        low=float(lengths[0]),
        high=float(lengths[-1]),
        largest_force=largest,
    )
    if largest == 0.0:
        said = "all forces are 0, and all energies the same: no interaction"
        return replace(whole, notes=(said,), error=0.0, noise=0.0, style_error=0.0)
    spline = spline_through(lengths, forces)
    rows = Rows.of(spline, forces, section.least_digits)
    faults += faults_of_rows(section, rows, str(path), kind, TOLERANCE * largest)
    notes = []
    warned = count_inconsistent(lengths, energies, forces)
    if warned:
        notes.append(
            f"LAMMPS will warn: {warned} of {len(data)} force values in table {section.keyword} "
            "are inconsistent with -dE/dr"
        )
    if kind == "pair" and ends_by_zero(data):
        notes.append(f"its last row is 0: there the energy jumps by {-energies[-2]:.3g}")
    left, cause = left_open(rows, spline, style, TOLERANCE if tolerance is None else tolerance)
    if tolerance is None and left["error"] > TOLERANCE:
        notes.append(cause)
    elif tolerance is not None and left["error"] > tolerance:
        faults.append(f"{cause}; expected {tolerance:.2g} at most")
    zeros = spline.roots(extrapolate=False)
    zeros = zeros[np.isfinite(zeros)]
    return replace(
        whole,
        faults=tuple(faults),
        notes=tuple(notes),
        zeros=tuple(float(zero) for zero in zeros[:10]),
        **left,
    )
