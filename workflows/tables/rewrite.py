"""Rewrite a table with any number of rows, all digits, and energies that match the forces."""

from pathlib import Path

import numpy as np

from chaincor.analysis.atomic_write import write_whole
from chaincor.analysis.output_paths import judge_output, resolve_output
from chaincor.lammps_inputs.bonds.table_rows import spline_through
from chaincor.lammps_inputs.bonds.table_text import section_text
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.tables.reading import in_order, read_table_sections, with_lengths_of_header
from chaincor.workflows.tables.report import TableReport


def refuse_existing(target: Path) -> None:
    """Raise InputError if the file of a new table exists, or cannot be written."""
    if resolve_output(target).exists():
        raise InputError(f"{str(target)!r} exists already. Give a new file for --write")
    judge_output(target, "table")


def rewrite_table(report: TableReport, target: Path, rows: int) -> None:
    """
    Write a consistent table of `rows` rows through the forces of a report's table.

    The forces follow a cubic spline through the rows. The energies are minus the integral of this
    spline, starting with the energy of the first row. The slopes in the header are derivatives of
    the spline. Raise InputError if the rows form no valid table, or if the target exists.
    """
    if report.error is None:
        raise InputError(
            f"{report.path!r} has no valid table to rewrite. Correct the faults of the file"
        )
    refuse_existing(target)
    section = in_order(read_table_sections(Path(report.path), report.keyword)[0])
    data = with_lengths_of_header(section, report.kind).data
    force = spline_through(data[:, 0], data[:, 2])
    energy = force.antiderivative()
    lengths = np.linspace(report.low, report.high, rows)
    energies = data[0, 1] - (energy(lengths) - energy(report.low))
    slopes = force(np.array([report.low, report.high]), 1)
    first = "FPRIME" if report.kind == "pair" else "FP"
    header = f"N {rows} {first} {slopes[0]:.17g} {slopes[1]:.17g}"
    if "EQ" in section.header:
        header += f" EQ {section.header['EQ'][0]:.17g}"
    if report.kind == "pair":
        header = f"N {rows} R {report.low:.17g} {report.high:.17g} " + header.split(maxsplit=2)[2]
    columns = (lengths, energies, force(lengths))
    write_whole(target, section_text(report.keyword or "TABLE", header, columns))
