"""What is wrong with a table of a bond, angle or pair, and what its rows and digits leave open."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.table_checks import Section, least_digits, sections_of
from chaincor.lammps_inputs.bonds.table_rows import LEAST_ROWS, Rows, spline_through
from chaincor.lammps_inputs.errors import InputError, TableError
from chaincor.lammps_inputs.small_file import refuse_endless, why_unreadable
from chaincor.workflows.tables.faults import (
    WHOLE_ANGLE,
    Kind,
    count_inconsistent,
    ends_by_zero,
    faults_of_header,
    faults_of_rows,
)

Array = NDArray[np.float64]
Style = Literal["linear", "spline", "lookup"]

KINDS: tuple[Kind, ...] = ("bond", "angle", "pair")
STYLES: tuple[Style, ...] = ("spline", "linear", "lookup")
# Of the largest force: what energies and forces may disagree by, and what rows are counted for
# where nobody says.
TOLERANCE = 1e-3
# Rows so many times further apart than those on either side have a gap between them, whose error
# is seen within so many rows.
_GAP, _AROUND = 1.9, 10
# Noise is no larger anywhere than so many times its median.
_EVEN = 10.0
# Interpolated between rows, curvature is looked at so many times finer.
_FINER = 8
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
        refuse_endless(path)
        text = path.read_bytes().decode("utf-8", "replace")
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read the table {str(path)!r}: {why_unreadable(error)}") from None
    if text.count("\n") > MOST_LINES:
        raise InputError(
            f"the table {str(path)!r} has more than {MOST_LINES} lines; expected fewer rows: none "
            "needs so many"
        )
    try:
        sections = sections_of(text, str(path), pair=True)
        section = _chosen(sections, keyword, path)
    except TableError as error:
        return TableReport(
            str(path), keyword or "", kind or "bond", style, 0, tolerance, (str(error),)
        )
    report = _report(section, path, kind or _kind_of(section), style, tolerance)
    alike = sum(each.keyword == section.keyword for each in sections)
    if alike == 1:
        return report
    fault = (
        f"it has {alike} sections named {section.keyword}, of which LAMMPS reads the first; "
        "expected a keyword of its own for each"
    )
    return replace(report, faults=(fault, *report.faults))


def _chosen(sections: list[Section], keyword: str | None, path: Path) -> Section:
    """Return the section asked for; raises InputError where it is not clear which."""
    names = list(dict.fromkeys(each.keyword for each in sections))
    if not sections:
        raise TableError(
            f"{str(path)!r} has no line 'N rows' and no row 'index length energy force'; expected "
            "a keyword, the line 'N rows', and the rows"
        )
    if keyword is None and len(names) == 1:
        return sections[0]
    found = [each for each in sections if each.keyword == keyword]
    if not found:
        raise InputError(
            f"{str(path)!r} has the sections {', '.join(names)}, and "
            f"{'none was chosen' if keyword is None else f'none is {keyword!r}'}; expected "
            "--keyword with one of them"
        )
    return found[0]


def _kind_of(section: Section) -> Kind:
    if set(section.header) & {"R", "RSQ", "BITMAP", "FPRIME"}:
        return "pair"
    lengths = section.data[:, 0]
    whole = len(lengths) > 0 and lengths[0] == 0.0 and abs(lengths[-1] - WHOLE_ANGLE) < 1.0
    return "angle" if whole else "bond"


def _report(
    section: Section, path: Path, kind: Kind, style: Style, tolerance: float | None
) -> TableReport:
    if "BITMAP" in section.header and len(section.data):
        # In the order of their bits, which begins somewhere inside.
        first = -int(np.argmin(section.data[:, 0]))
        section = replace(
            section,
            data=np.roll(section.data, first, axis=0),
            digits=np.roll(section.digits, first, axis=0),
        )
    data = section.data
    faults, notes = faults_of_header(section, kind), []
    wrong = np.flatnonzero(~np.all(np.isfinite(data), axis=1))
    usable = len(data) >= LEAST_ROWS and not len(wrong)
    if len(wrong):
        said = " ".join(f"{number:g}" for number in data[wrong[0]])
        faults.append(f"row {wrong[0] + 1} says '{said}'; expected finite numbers")
    elif not usable:
        faults.append(f"it has {len(data)} rows; expected {LEAST_ROWS} at least")
    elif np.any(np.diff(data[:, 0]) <= 0.0):
        row = int(np.flatnonzero(np.diff(data[:, 0]) <= 0.0)[0]) + 2
        faults.append(
            f"{kind} table values are not increasing: row {row} is at {data[row - 1, 0]:.9g} "
            f"behind {data[row - 2, 0]:.9g}; LAMMPS refuses that or reads past its table"
        )
        usable = False
    largest = float(np.max(np.abs(data[:, 2]))) if usable else 1.0
    nothing = usable and largest == 0.0 == np.ptp(data[:, 1])
    if largest == 0.0 and not nothing:
        faults.append("all forces are 0; expected -dE/dr in the fourth column")
    head = (str(path), section.keyword, kind, style, len(data), tolerance)
    if nothing:
        notes.append("all forces are 0, and all energies the same: no interaction")
        return TableReport(
            *head,
            faults=tuple(faults),
            notes=tuple(notes),
            low=float(data[0, 0]),
            high=float(data[-1, 0]),
            largest_force=0.0,
            error=0.0,
            noise=0.0,
            style_error=0.0,
        )
    if not usable or largest == 0.0:
        return TableReport(*head, tuple(faults))
    digits = least_digits(data, section.digits)
    lengths, energies, forces = data.T
    spline = spline_through(lengths, forces)
    slopes = np.abs(spline(lengths, 1))
    rows = Rows(lengths, forces, digits[:, 2] + slopes * digits[:, 0])
    faults += faults_of_rows(section, digits, rows, str(path), kind, TOLERANCE * largest)
    warned = count_inconsistent(lengths, energies, forces)
    if warned:
        notes.append(
            f"LAMMPS will warn: {warned} of {len(data)} force values in table {section.keyword} "
            "are inconsistent with -dE/dr"
        )
    if kind == "pair" and ends_by_zero(data):
        notes.append(f"its last row is 0: there the energy jumps by {-energies[-2]:.3g}")
    noise = float(np.max(rows.noise())) / largest
    left = rows.largest_error(float(lengths[0]), float(lengths[-1])) / largest
    limit = TOLERANCE if tolerance is None else tolerance
    by_style, wanted = _of_style(lengths, spline, style, largest, limit)
    error = left + by_style
    if error > limit:
        said = _too_large(rows, largest, left, by_style, style, limit, wanted)
        if tolerance is None:
            notes.append(said)
        else:
            faults.append(f"{said}; expected {tolerance:.2g} at most")
    zeros = spline.roots(extrapolate=False)
    zeros = zeros[np.isfinite(zeros)]
    if left < limit:
        wanted["spline"] = max(
            LEAST_ROWS, math.ceil(len(data) * (left / limit) ** 0.25)
        )  # what splines err by falls with the fourth power
    return TableReport(
        *head,
        faults=tuple(faults),
        notes=tuple(notes),
        low=float(lengths[0]),
        high=float(lengths[-1]),
        zeros=tuple(float(zero) for zero in zeros[:10]),
        largest_force=largest,
        error=error,
        noise=noise,
        style_error=by_style,
        rows_wanted=wanted,
    )


def _of_style(
    lengths: Array, spline: Callable[..., Array], style: Style, largest: float, tolerance: float
) -> tuple[float, dict[str, int]]:
    """Return the error of interpolation in as many rows, and the rows that reach the tolerance."""
    fine = np.interp(
        np.linspace(0.0, len(lengths) - 1.0, _FINER * len(lengths)),
        np.arange(len(lengths)),
        lengths,
    )
    span = float(lengths[-1] - lengths[0])
    curved = float(np.max(np.abs(spline(fine, 2)))) * span**2 / 8.0 / largest
    steep = float(np.max(np.abs(spline(fine, 1)))) * span / 2.0 / largest
    wanted = {
        "linear": math.ceil(math.sqrt(curved / tolerance)) + 1,
        "lookup": math.ceil(steep / tolerance) + 1,
    }
    intervals = len(lengths) - 1
    errors = {"linear": curved / intervals**2, "lookup": steep / intervals, "spline": 0.0}
    return errors[style], wanted


def _too_large(
    rows: Rows,
    largest: float,
    left: float,
    by_style: float,
    style: Style,
    tolerance: float,
    wanted: dict[str, int],
) -> str:
    """Say where an error beyond the tolerance comes from."""
    noises = rows.noise()
    # At a kink alone it is none.
    noise = 3.0 * float(min(np.max(noises), _EVEN * np.median(noises))) / largest
    digits = float(np.max(rows.digits)) / largest
    unit = "of the largest force"
    if by_style > tolerance >= left:
        return (
            f"{style} interpolation in {len(rows.strains)} rows errs by {by_style:.2g} {unit}: "
            f"take style spline, or {wanted[style]} rows"
        )
    steps = np.diff(rows.strains)
    wider = steps / np.maximum(np.append(0.0, steps[:-1]), np.append(steps[1:], 0.0))
    gap, worst = int(np.argmax(wider)), int(np.argmax(rows.errors()))
    if wider[gap] > _GAP and abs(gap - worst) <= _AROUND:
        return (
            f"between rows {gap + 1} and {gap + 2}, at {rows.strains[gap]:.9g} and "
            f"{rows.strains[gap + 1]:.9g}, rows are missing, which leaves an error of {left:.2g} "
            f"{unit}: give rows there"
        )
    if max(noise, digits) > 0.5 * left:
        cause = "its forces are noisy" if noise > digits else "its numbers have few digits"
        return (
            f"{cause}, which leaves an error of {left:.2g} {unit} near "
            f"{rows.strains[worst]:.9g}: write all digits, or smooth"
        )
    return (
        f"its {len(rows.strains)} rows leave an error of {left:.2g} {unit}: give more rows near "
        f"{rows.strains[worst]:.9g}, or a force without kinks"
    )
