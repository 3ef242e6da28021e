"""Compare a table with the forces and energies of the installed LAMMPS."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.tables.lammps_run import LammpsTable, run_lammps
from chaincor.workflows.tables.report import TableReport, percent

_POINTS, _SHOWN = 1001, 12
# LAMMPS refuses the exact ends of some tables. The comparison omits this fraction of the range at
# each end.
_INSIDE = 1e-6
# The comparison excludes angles within this distance of 0 and 180 degrees. There LAMMPS's forces on
# atoms are wrong, because LAMMPS replaces the sine of an angle by 0.001 if the sine is smaller.
_ANGLES = 0.06


@dataclass(frozen=True)
class TableComparison:
    """Forces from LAMMPS, from chaincor's model of LAMMPS, and from polynomials through rows."""

    lammps: LammpsTable
    modelled: Array  #: Force according to chaincor's model, `lammps_curve`.
    expected: Array  #: Force from polynomials through the neighbouring rows.
    slopes: Array  #: -dE/dr from LAMMPS's energies, by central differences.
    #: Largest difference between LAMMPS's force and the expected force, as a fraction of the local
    #: force.
    error: float
    #: Largest difference between LAMMPS's force and the modelled force, as a fraction of the local
    #: force.
    model_error: float

    def as_keys(self) -> dict[str, Any]:
        """Return the fields for JSON."""
        return {
            "lengths": self.lammps.lengths.tolist(),
            "lammps_forces": self.lammps.forces.tolist(),
            "lammps_energies": self.lammps.energies.tolist(),
            "modelled_forces": self.modelled.tolist(),
            "expected_forces": self.expected.tolist(),
            "error": self.error,
            "model_error": self.model_error,
            "warnings": self.lammps.warned_forces,
            "refusal": self.lammps.error or None,
        }

    def lines(self) -> list[str]:
        """Return the lines of a short table with the comparison."""
        if self.lammps.error:
            return [f"LAMMPS refuses the table: {self.lammps.error}"]
        found = [f"{'r':>12} {'rows':>14} {'LAMMPS':>14} {'-dE/dr LAMMPS':>14}"]
        for k in np.linspace(0, len(self.modelled) - 1, _SHOWN).astype(int).tolist():
            numbers = (self.expected[k], self.lammps.forces[k], self.slopes[k])
            found.append(
                f"{self.lammps.lengths[k]:>12.6g} " + " ".join(f"{x:>14.7g}" for x in numbers)
            )
        found.append(
            f"LAMMPS's force differs from the rows by at most {percent(self.error)} "
            "of the local force, and from this program's model of LAMMPS by "
            f"{percent(self.model_error)}"
        )
        return found


def compare_with_lammps(report: TableReport, points: int = _POINTS) -> TableComparison:
    """
    Compare a table with LAMMPS, with the interpolation style and the range of its report.

    If LAMMPS refuses the table, the arrays are empty and `lammps.error` contains LAMMPS's message.
    Raise InputError if the rows form no valid table, and RunError if LAMMPS is missing or gives no
    result.
    """
    judge = report.curves
    if judge is None or report.range is None:
        raise InputError(
            f"{report.path!r} has no valid table to compare. Correct the faults of the file"
        )
    table = judge.table
    low, high = report.range
    margin = max(_INSIDE * (high - low), _ANGLES if report.kind == "angle" else 0.0)
    is_bitmap = report.style == "bitmap"
    lammps = run_lammps(
        Path(report.path),
        report.keyword,
        report.kind,
        report.style,
        report.rows.bit_length() - 1 if is_bitmap else report.style_rows,
        (low + margin, high - margin),
        points,
        period=table.period or 360.0,
    )
    if lammps.error:
        nothing = np.zeros(0)
        return TableComparison(lammps, nothing, nothing, nothing, 0.0, 0.0)
    at = lammps.lengths
    modelled = judge.curve(report.style, report.style_rows).force(at)
    expected, _ = judge.rows.forces_at(at, np.zeros(len(at), dtype=bool))
    size = judge.size_at(at)
    return TableComparison(
        lammps,
        modelled,
        expected,
        -np.gradient(lammps.energies, at),
        float(np.max(np.abs(lammps.forces - expected) / size)),
        float(np.max(np.abs(lammps.forces - modelled) / size)),
    )
