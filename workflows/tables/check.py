"""Check the rows of a table and the force that LAMMPS interpolates between them."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.table_rows import spline_through
from chaincor.lammps_inputs.bonds.table_text import Section
from chaincor.lammps_inputs.errors import InputError, TableError
from chaincor.lammps_inputs.given_texts import path_given
from chaincor.workflows.tables.faults import TOLERANCE, contradictions, other_faults
from chaincor.workflows.tables.interpolation_causes import cause_of_error
from chaincor.workflows.tables.judge import Errors, Judge, judged_range, last_row
from chaincor.workflows.tables.lammps_curve import Style, TableData, TableKind
from chaincor.workflows.tables.notes import notes_beyond_cutoff, notes_on_ends
from chaincor.workflows.tables.reading import (
    KINDS,
    in_order,
    kind_of,
    read_table_sections,
    read_text,
    table_data,
    thermal_energy,
)
from chaincor.workflows.tables.report import TableReport, percent, sentence
from chaincor.workflows.tables.section_faults import (
    count_of_warnings,
    fault_of_numbers,
    fault_of_values,
    faults_of_header,
    faults_of_spacing,
    faults_of_text,
    notes_on_lines,
)

STYLES: tuple[Style, ...] = ("spline", "linear", "lookup")
# If no tolerance is given, forces may differ from the slope of the energy by this fraction of the
# local force.
CONTRADICTION = 0.01
# To find a number of rows that meets the tolerance, these multiples of the given number are tried.
_TRIED = (1, 2, 5, 10, 20, 50, 100, 1000)
_MOST_TRIED = 200_000


def check_table(
    path: Path | str,
    keyword: str | None = None,
    *,
    style: Style = "spline",
    kind: TableKind | None = None,
    tolerance: float | None = None,
    range: tuple[float, float] | None = None,
    rows: int | None = None,
) -> TableReport:
    r"""
    Check a table of ``bond_style``, ``angle_style``, ``dihedral_style`` or ``pair_style table``.

    The table's forces are compared with :math:`-dE/dr`. The force that LAMMPS interpolates is
    compared with polynomials through the neighbouring rows. Errors are given as fractions of the
    local force, which is the largest force within 5 % of the range on either side.

    Parameters
    ----------
    path : path
        The file.
    keyword : str, optional
        Keyword of the section. It may be omitted if the file has only one section.
    style : str, optional
        Interpolation in LAMMPS: ``spline``, ``linear`` or ``lookup``. The style has no effect on
        bitmap tables.
    kind : str, optional
        ``bond``, ``angle``, ``dihedral`` or ``pair``; by default found from the header and the
        rows.
    tolerance : float, optional
        Largest allowed error, as a fraction of the local force. If no tolerance is given, errors
        caused by few rows, few digits or noise are reported but do not count as faults.
        Contradictions between energies and forces of more than 1 % are always faults.
    range : (float, float), optional
        Range of lengths or angles that particles reach. By default, this is the range in which the
        energy is less than 10 kT above its minimum, with kT = 1 if the file names no units.
    rows : int, optional
        Number of rows in LAMMPS's style command; by default the number of rows in the file.

    Returns
    -------
    TableReport
        Error, faults and a summary.

    Raises
    ------
    InputError
        If the file cannot be read or lacks the section, or if an option is invalid.

    Examples
    --------
    >>> from chaincor import Scene, check_table, write_job
    >>> files = write_job(Scene(particles=5), "job")
    >>> report = check_table("job/bond.table")
    >>> report.rows, report.faults, bool(report.error < 1e-7)
    (201, (), True)
    """
    if tolerance is not None and not 0.0 < tolerance < math.inf:
        raise InputError(f"the tolerance is {tolerance}. Give a positive fraction of the force")
    if style not in STYLES or (kind is not None and kind not in KINDS):
        raise InputError(
            f"the table is of style {style!r} and kind {kind!r}. Use one of "
            f"{', '.join(STYLES)}, and one of {', '.join(KINDS)}"
        )
    if range is not None and not -math.inf < range[0] < range[1] < math.inf:
        raise InputError(f"the range is {range[0]} to {range[1]}. Give two increasing numbers")
    if rows is not None and rows < 4:
        raise InputError(f"the number of rows is {rows}. Give at least 4")
    path = path_given("path", path)
    text = read_text(path)
    report = TableReport(str(path), keyword or "", kind or "bond", style, 0, tolerance, ())
    try:
        section, *others = read_table_sections(path, keyword, text)
    except TableError as error:
        return replace(report, faults=(*faults_of_text(text), str(error)))
    kind = kind or kind_of(section)
    if style == "lookup" and kind != "pair":
        raise InputError(f"LAMMPS has no style lookup for a {kind} table. Use spline or linear")
    faults = faults_of_text(text)
    if others:
        faults.append(
            f"it has {1 + len(others)} sections named {section.keyword}, and LAMMPS "
            "reads only the first. Give each section its own keyword"
        )
    section = in_order(section)
    faults += faults_of_header(section, kind)
    report = replace(
        report,
        keyword=section.keyword,
        kind=kind,
        style="bitmap" if "BITMAP" in section.header else style,
        rows=len(section.data),
        faults=tuple(faults),
    )
    unusable = fault_of_values(section.header) or fault_of_numbers(section, kind)
    if unusable is not None:
        # If there are no rows, a fault of the header already says so.
        return replace(report, faults=(*faults, unusable) if len(section.data) else tuple(faults))
    table = table_data(section, kind)
    span = float(table.lengths[-1] - table.lengths[0])
    if (kind == "pair" and not table.lengths[0] > 0.0) or (table.period and span >= table.period):
        return report
    return _judged(report, section, table, range, rows, text)


def _judged(
    report: TableReport,
    section: Section,
    table: TableData,
    asked: tuple[float, float] | None,
    rows: int | None,
    text: str,
) -> TableReport:
    thermal, how = thermal_energy(text)
    low, high = float(table.lengths[0]), float(table.lengths[-1])
    warned, differing = count_of_warnings(section, table)
    report = replace(
        report,
        low=low,
        high=high,
        warnings=warned,
        style_rows=rows or report.rows,
        largest_force=float(np.max(np.abs(np.nan_to_num(table.forces)))),
    )
    notes = notes_on_lines(section, report.kind)
    if warned:
        notes.append(
            f"LAMMPS will warn: {warned} of {report.rows} force values in table {report.keyword} "
            "are inconsistent with -dE/dr"
        )
    if differing:
        notes.append(
            f"LAMMPS will warn: {differing} of {report.rows} distance values differ from those "
            "that it recomputes"
        )
    if report.largest_force == 0.0 and table.has_forces:
        said = "all forces are 0 and all energies are equal, so there is no interaction"
        return replace(
            report, notes=(said,), error=0.0, noise=0.0, style_error=0.0, range=(low, high)
        )
    if asked is None:
        bounds = judged_range(table, thermal)
        if table.is_bitmap:
            # The last rows of a bitmap lie beyond LAMMPS's cutoff.
            cutoff = section.header["BITMAP"][1]
            bounds = (bounds[0], min(bounds[1], cutoff) if cutoff > bounds[0] else bounds[1])
        how = f"energy below 10 kT above its minimum; {how}"
        notes += notes_on_ends(table, bounds, thermal)
    else:
        bounds, how = (max(asked[0], low), min(asked[1], high)), "as asked"
        if not bounds[0] < bounds[1]:
            raise InputError(
                f"the range {asked[0]:g} to {asked[1]:g} is outside the table, which "
                f"goes from {low:g} to {high:g}. Give a range inside it"
            )
    judge = Judge(table, _rounding(section), *bounds)
    return _with_errors(replace(report, range=bounds, range_reason=how), judge, section, notes)


def _rounding(section: Section) -> Array:
    """
    Return half a unit of the last digit of energies and forces, of shape (rows, 2).

    A zero is assumed to be as exact as its neighbours.
    """
    units = section.least_digits[:, 1:]
    beside = np.minimum(np.roll(units, 1, axis=0), np.roll(units, -1, axis=0))
    is_zero = section.data[:, 1:] == 0.0
    rounding: Array = 0.5 * np.where(is_zero, np.minimum(units, beside), units)
    return rounding


def _with_errors(
    report: TableReport, judge: Judge, section: Section, notes: list[str]
) -> TableReport:
    table, style, tolerance = judge.table, report.style, report.tolerance
    errors = judge.errors(style, report.style_rows)
    limit = tolerance or TOLERANCE
    faults = list(report.faults)
    # The forces belong to the distances in the file. If LAMMPS uses other distances, this
    # difference explains every contradiction.
    is_moved = table.kind == "pair" and bool(faults_of_spacing(section))
    found = None if is_moved else contradictions(judge, errors, tolerance or CONTRADICTION)
    cause, contradiction = found or (None, None)
    short = f"{cause.said}. {sentence(cause.help)}" if cause else ""
    faults += [contradiction] if contradiction else []
    faults += other_faults(report, judge, section)
    if table.is_bitmap or not table.has_forces:
        ideal = errors
    else:
        ideal = replace(errors, interpolation=np.zeros(len(errors.at)))
    if not is_moved and len(faults) == len(report.faults) and errors.largest > limit:
        cause = cause_of_error(judge, errors, style, report.style_rows)
        said = f"{cause.said}: an error of {errors.largest:.2g} of the local force"
        if tolerance is None:
            notes.append(f"{said}. {sentence(cause.help).removesuffix('.')}")
        else:
            faults.append(
                f"{said}, above {tolerance:.2g}. {sentence(cause.help).removesuffix('.')}"
            )
            short = f"{cause.said}, {percent(errors.largest)} of the local force"
            short = f"{short}. {sentence(cause.help)}"
    notes += notes_beyond_cutoff(table)
    return replace(
        report,
        faults=tuple(faults),
        notes=tuple(notes),
        zeros=_zeros(judge),
        error=errors.largest,
        worst=errors.worst,
        noise=float(np.max(errors.scatter)),
        style_error=float(np.max(errors.interpolation)),
        core_error=_core_error(report, judge),
        rows_wanted=_rows_wanted(report, judge, limit, ideal),
        cause=cause.name if cause else None,
        advice=cause.help if cause else "",
        verdict=short if len(faults) == 1 else "",
        good_range=_good_range(errors, limit if tolerance else CONTRADICTION),
        curves=judge,
    )


def _core_error(report: TableReport, judge: Judge) -> float | None:
    """Return the relative error below the range; None if there are no rows."""
    low = float(judge.table.lengths[0])
    if judge.table.period or not low < judge.low:
        return None
    return judge.errors(report.style, report.style_rows, low, judge.low).largest


def _rows_wanted(report: TableReport, judge: Judge, limit: float, ideal: Errors) -> dict[str, int]:
    """Return the number of rows that each style needs to meet a limit, if the style can meet it."""
    table, found = judge.table, dict[str, int]()
    if table.is_bitmap or ideal.largest > limit:
        return found
    styles = STYLES if table.kind == "pair" else STYLES[:2]
    for style in styles:
        for factor in _TRIED:
            rows = factor * report.style_rows
            if rows > _MOST_TRIED:
                break
            if judge.errors(style, rows).largest <= limit:
                found[str(style)] = rows
                break
    return found


def _zeros(judge: Judge) -> tuple[float, ...]:
    """Return the first ten zeros of the force within the table."""
    if not judge.table.has_forces:
        return ()
    kept = slice(last_row(judge.table) + 1)
    spline = spline_through(judge.table.lengths[kept], judge.table.forces[kept])
    zeros = spline.roots(extrapolate=False)
    return tuple(float(zero) for zero in zeros[np.isfinite(zeros)][:10])


def _good_range(errors: Errors, limit: float) -> tuple[float, float] | None:
    """Return the longest interval of the range in which the error is below a limit."""
    good = np.concatenate([[False], errors.whole <= limit, [False]])
    edges = np.flatnonzero(np.diff(good.astype(int)))
    starts, ends = edges[::2], edges[1::2] - 1
    if not len(starts):
        return None
    longest = int(np.argmax(errors.at[ends] - errors.at[starts]))
    low, high = float(errors.at[starts[longest]]), float(errors.at[ends[longest]])
    return (low, high) if low < high else None
