"""What is wrong with a table of a bond, angle or pair, and what its rows and digits leave open."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.table_checks import (
    Section,
    check_energies,
    check_slopes,
    least_digits,
    sections_of,
)
from chaincor.lammps_inputs.bonds.table_rows import LEAST_ROWS, Rows, spline_through
from chaincor.lammps_inputs.errors import InputError, TableError
from chaincor.lammps_inputs.small_file import refuse_endless, why_unreadable

Array = NDArray[np.float64]
Kind = Literal["bond", "angle", "pair"]
Style = Literal["linear", "spline", "lookup"]

KINDS: tuple[Kind, ...] = ("bond", "angle", "pair")
STYLES: tuple[Style, ...] = ("spline", "linear", "lookup")
# Of the largest force: what a good table leaves open at most, where nobody says.
TOLERANCE = 1e-3
# LAMMPS works lengths out of R and RSQ again, and warns of a relative difference beyond this.
_SAME_LENGTH = 1e-6
_WHOLE_ANGLE = 180.0
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
    tolerance : float
        What a good table leaves open at most.
    rows_wanted : dict of str to int
        Rows that reach the tolerance, by style; without what no number of rows reaches.
    faults : tuple of str
        What is wrong, a sentence each; none of a good table.
    notes : tuple of str
        What LAMMPS will warn of, and what else is worth knowing.
    """

    path: str
    keyword: str
    kind: Kind
    style: Style
    rows: int
    low: float
    high: float
    zeros: tuple[float, ...]
    largest_force: float
    error: float | None
    noise: float | None
    style_error: float | None
    tolerance: float
    rows_wanted: dict[str, int]
    faults: tuple[str, ...]
    notes: tuple[str, ...]

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
    tolerance: float = TOLERANCE,
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
        Error of the force, as a part of the largest, that a good table leaves open at most.

    Returns
    -------
    TableReport
        Error and faults.

    Raises
    ------
    InputError
        If the file cannot be read, has no such section, or an option makes no sense.
    """
    if not 0.0 < tolerance < math.inf:
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
        return _unreadable(path, keyword, kind or "bond", style, tolerance, str(error))
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
    whole = len(lengths) > 0 and lengths[0] == 0.0 and abs(lengths[-1] - _WHOLE_ANGLE) < 1.0
    return "angle" if whole else "bond"


def _report(
    section: Section, path: Path, kind: Kind, style: Style, tolerance: float
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
    faults, notes = _of_header(section, kind), []
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
    if not usable:
        return _unreadable(path, section.keyword, kind, style, tolerance, *faults, section=section)
    digits = least_digits(data, section.digits)
    lengths, energies, forces = data.T
    largest = float(np.max(np.abs(forces)))
    if largest == 0.0:
        faults.append("all forces are 0; expected -dE/dr in the fourth column")
        return _unreadable(path, section.keyword, kind, style, tolerance, *faults, section=section)
    spline = spline_through(lengths, forces)
    slopes = np.abs(spline(lengths, 1))
    rows = Rows(lengths, forces, digits[:, 2] + slopes * digits[:, 0])
    faults += _of_rows(section, digits, rows, str(path), kind, tolerance * largest)
    warned = _inconsistent(lengths, energies, forces)
    if warned:
        notes.append(
            f"LAMMPS will warn: {warned} of {len(data)} force values in table {section.keyword} "
            "are inconsistent with -dE/dr"
        )
    if kind == "pair" and _ends_by_zero(data):
        notes.append(f"its last row is 0: there the energy jumps by {-energies[-2]:.3g}")
    noise = float(np.max(rows.noise())) / largest
    left = rows.largest_error(float(lengths[0]), float(lengths[-1])) / largest
    by_style, wanted = _of_style(lengths, spline, style, largest, tolerance)
    error = left + by_style
    if error > tolerance:
        faults.append(_too_large(rows, largest, left, by_style, style, tolerance, wanted))
    zeros = spline.roots(extrapolate=False)
    zeros = zeros[np.isfinite(zeros)]
    if left < tolerance:
        wanted["spline"] = max(
            LEAST_ROWS, math.ceil(len(data) * (left / tolerance) ** 0.25)
        )  # what splines err by falls with the fourth power
    return TableReport(
        path=str(path),
        keyword=section.keyword,
        kind=kind,
        style=style,
        rows=len(data),
        low=float(lengths[0]),
        high=float(lengths[-1]),
        zeros=tuple(float(zero) for zero in zeros[:10]),
        largest_force=largest,
        error=error,
        noise=noise,
        style_error=by_style,
        tolerance=tolerance,
        rows_wanted=wanted,
        faults=tuple(faults),
        notes=tuple(notes),
    )


def _unreadable(
    path: Path,
    keyword: str | None,
    kind: Kind,
    style: Style,
    tolerance: float,
    *faults: str,
    section: Section | None = None,
) -> TableReport:
    """Report a table that holds no force to be judged."""
    return TableReport(
        path=str(path),
        keyword=keyword or "",
        kind=kind,
        style=style,
        rows=0 if section is None else len(section.data),
        low=math.nan,
        high=math.nan,
        zeros=(),
        largest_force=math.nan,
        error=None,
        noise=None,
        style_error=None,
        tolerance=tolerance,
        rows_wanted={},
        faults=faults,
        notes=(),
    )


def _of_header(section: Section, kind: Kind) -> list[str]:
    """Compare the header with the rows."""
    header, data = section.header, section.data
    if "N" not in header:
        return ["it has no line 'N rows' before its rows, without which LAMMPS does not read it"]
    faults = []
    if not section.keyword or section.keyword.isdigit():
        faults.append("its section has no keyword; expected a name in the line before 'N rows'")
    if header["N"][0] != len(data):
        faults.append(
            f"it says N {header['N'][0]:g} and has {len(data)} rows; expected as many as it says: "
            "LAMMPS reads past the section, or stops before its end"
        )
    lengths = data[:, 0]
    if len(lengths) < 2 or not np.all(np.isfinite(lengths)):
        return faults
    if kind == "angle" and (lengths[0] != 0.0 or abs(lengths[-1] - _WHOLE_ANGLE) > 1e-9):
        faults.append(
            f"its angles go from {lengths[0]:g} to {lengths[-1]:g}; LAMMPS expects an angle table "
            "from 0 to 180 degrees"
        )
    if kind == "pair" and lengths[0] <= 0.0:
        faults.append(f"its distances begin at {lengths[0]:g}; LAMMPS expects positive ones")
    faults += _of_spacing(header, lengths, section.digits[:, 0])
    if "EQ" in header and not lengths[0] <= header["EQ"][0] <= lengths[-1]:
        faults.append(
            f"it says EQ {header['EQ'][0]:g}, and its rows go from {lengths[0]:g} to "
            f"{lengths[-1]:g}; expected the natural value inside"
        )
    return faults


def _of_spacing(header: dict[str, list[float]], lengths: Array, digits: Array) -> list[str]:
    """Compare distances with those that LAMMPS works out of R and RSQ, but for lost digits."""
    for name, power in (("R", 1), ("RSQ", 2)):
        if name in header:
            low, high = header[name]
            made = np.linspace(low**power, high**power, len(lengths)) ** (1.0 / power)
            off = np.abs(lengths - made) > _SAME_LENGTH * np.abs(made) + digits
            if np.any(off):
                row = int(np.flatnonzero(off)[0])
                return [
                    f"{np.count_nonzero(off)} of {len(lengths)} distance values differ from those "
                    f"of its line '{name} {low:g} {high:g}', which LAMMPS takes instead: row "
                    f"{row + 1} is at {lengths[row]:.9g}, not {made[row]:.9g}"
                ]
    return []


def _of_rows(
    section: Section, digits: Array, rows: Rows, path: str, kind: Kind, allowed: float
) -> list[str]:
    """Compare rows with each other, energies with forces, and slopes with both."""
    slopes = section.header.get("FP", section.header.get("FPRIME", [0.0, 0.0]))
    whole = slice(-1 if kind == "pair" and _ends_by_zero(section.data) else None)
    checks: list[Callable[[], None]] = [
        lambda: rows.refuse_outlier(path),
        lambda: check_energies(section.data[whole], digits[whole], path, allowed),
    ]
    if slopes != [0.0, 0.0]:
        checks.append(lambda: check_slopes(slopes, section.data, digits, path))
    faults = []
    for check in checks:
        try:
            check()
        except TableError as error:
            faults.append(str(error))
    if np.ptp(section.data[:, 1]) == 0.0:
        faults.append("all its energies are the same; expected the energy in the third column")
    return faults


def _ends_by_zero(data: Array) -> bool:
    """Return whether a last row of zeros stands for the cutoff, as LAMMPS's pair_write has it."""
    return bool(np.all(data[-1, 1:] == 0.0) and data[-2, 1] != 0.0)


def _inconsistent(lengths: Array, energies: Array, forces: Array) -> int:
    """Count forces outside the slopes of the energy to both neighbours, as LAMMPS does."""
    slopes = -np.diff(energies) / np.diff(lengths)
    low, high = np.minimum(slopes[:-1], slopes[1:]), np.maximum(slopes[:-1], slopes[1:])
    inside = forces[1:-1]
    return int(np.count_nonzero((inside < low) | (inside > high)))


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
    """Say why a table leaves too much open."""
    noises = rows.noise()
    # At a kink alone it is none.
    noise = 3.0 * float(min(np.max(noises), _EVEN * np.median(noises))) / largest
    digits = float(np.max(rows.digits)) / largest
    asked = f"of the largest force; expected {tolerance:.2g} at most"
    if by_style > tolerance >= left:
        return (
            f"{style} interpolation in {len(rows.strains)} rows errs by {by_style:.2g} {asked}: "
            f"take style spline, or {wanted[style]} rows"
        )
    steps = np.diff(rows.strains)
    wider = steps / np.maximum(np.append(0.0, steps[:-1]), np.append(steps[1:], 0.0))
    gap, worst = int(np.argmax(wider)), int(np.argmax(rows.errors()))
    if wider[gap] > _GAP and abs(gap - worst) <= _AROUND:
        return (
            f"between rows {gap + 1} and {gap + 2}, at {rows.strains[gap]:.9g} and "
            f"{rows.strains[gap + 1]:.9g}, rows are missing, which leaves an error of {left:.2g} "
            f"{asked}: give rows there"
        )
    if max(noise, digits) > 0.5 * left:
        cause = "its forces are noisy" if noise > digits else "its numbers have few digits"
        return (
            f"{cause}, which leaves an error of {left:.2g} near {rows.strains[worst]:.9g}, "
            f"{asked}: write all digits, or smooth"
        )
    return (
        f"its {len(rows.strains)} rows leave an error of {left:.2g} {asked}: give more rows near "
        f"{rows.strains[worst]:.9g}, or a force without kinks"
    )
