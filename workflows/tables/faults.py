"""Find faults in a table's forces: contradictions, outliers, wrong end slopes, a wrong EQ."""

import numpy as np

from chaincor.lammps_inputs.bonds.table_checks import fault_of_slopes
from chaincor.lammps_inputs.bonds.table_rows import BondRows, spline_through
from chaincor.lammps_inputs.bonds.table_text import Section
from chaincor.workflows.tables.contradictions import cause_of_contradiction
from chaincor.workflows.tables.interpolation_causes import TableFaultCause
from chaincor.workflows.tables.judge import Errors, Judge, last_row
from chaincor.workflows.tables.reading import with_lengths_of_header
from chaincor.workflows.tables.report import TableReport, sentence

# Without a tolerance, the recommended number of rows keeps the force's error below this fraction of
# the local force.
TOLERANCE = 1e-3
# Outside the range, a contradiction counts only if it exceeds the fraction _CORE_PART of the force
# in at least _CORE_ROWS consecutive intervals.
_CORE_ROWS, _CORE_PART = 5, 0.1


def contradictions(
    judge: Judge, errors: Errors, allowed: float
) -> tuple[TableFaultCause, str] | None:
    """Return why energies and forces contradict each other, and a sentence; None if they agree."""
    if not judge.table.has_forces:
        return None
    x = judge.rows.padded[0]
    _signed, systematic = judge.differences
    middle = 0.5 * (x[1:] + x[:-1])
    inside = (x[1:] > judge.low) & (x[:-1] < judge.high)
    size = judge.size_at(np.clip(middle, judge.low, judge.high))
    wrong = inside & (systematic > allowed * size)
    by_energies, by_forces, _ = judge.rows.mean_forces()
    own = np.maximum(np.abs(by_energies), np.abs(by_forces)) + 1e-300
    beyond = ~inside & (systematic > max(_CORE_PART, allowed) * own)
    runs = np.convolve(beyond, np.ones(_CORE_ROWS), mode="valid") >= _CORE_ROWS
    if not np.any(wrong) and np.any(runs):
        wrong, size = beyond, own
    if not np.any(wrong):
        return None
    places = np.flatnonzero(wrong)
    worst = int(places[np.argmax((systematic / size)[wrong])])
    where = f"between {x[places[0]]:.4g} and {x[places[-1] + 1]:.4g}"
    cause = cause_of_contradiction(judge, wrong, where)
    return cause, (
        f"{cause.said}: near {middle[worst]:.6g} the energies give a force of "
        f"{by_energies[worst]:.6g}, but the table has {by_forces[worst]:.6g}. "
        f"{sentence(cause.help).removesuffix('.')}"
    )


def other_faults(report: TableReport, judge: Judge, section: Section) -> list[str]:
    """Return faults: outliers, wrong slopes at the ends, missing energies, or a wrong EQ."""
    table = judge.table
    found: list[str] = []
    if table.has_forces and not table.period:
        kept = slice(last_row(table) + 1)
        lengths, forces = table.lengths[kept], table.forces[kept]
        spline = spline_through(lengths, forces)
        digits = section.least_digits[kept]
        outlier = BondRows.of(spline, forces, digits * [0.0, 1.0, 1.0]).outlier(report.path)
        if outlier and np.max(judge.errors(report.style, report.style_rows).scatter) > TOLERANCE:
            found.append(outlier)
        held = with_lengths_of_header(section, report.kind)
        if slopes := fault_of_slopes(held, report.path):
            found.append(slopes)
    if table.has_forces and np.ptp(table.energies) == 0.0:
        found.append("all its energies are the same. Write the energy into the third column")
    if "EQ" in section.header and table.has_forces:
        found += _fault_of_natural_length(section.header["EQ"][0], judge)
    return found


def _fault_of_natural_length(natural: float, judge: Judge) -> list[str]:
    """Return a fault if EQ is far from every zero of the force, otherwise an empty list."""
    x, forces = judge.table.lengths, judge.table.forces
    if not x[0] <= natural <= x[-1]:
        return []
    crossing = np.flatnonzero(forces[:-1] * forces[1:] <= 0.0)
    room = max(2.0 * float(np.max(np.diff(x))), 0.02 * float(x[-1] - x[0]))
    zeros = [*x[crossing], *x[crossing + 1]]
    # The natural angle may be the first or last angle, because the sine of the angle vanishes
    # there.
    ends = [x[0], x[-1]] if judge.table.kind == "angle" else []
    if not zeros or np.min(np.abs(np.array([*zeros, *ends]) - natural)) <= room:
        return []
    force = float(np.interp(natural, x, forces))
    nearest = zeros[int(np.argmin(np.abs(np.array(zeros) - natural)))]
    return [
        f"it says EQ {natural:g}, where the force is {force:.3g}. Give EQ where the "
        f"force vanishes, as near {nearest:.6g}"
    ]
