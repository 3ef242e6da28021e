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
# LAMMPS refuses the exact ends of some tables, so the comparison keeps this relative distance.
_INSIDE = 1e-6
# The comparison keeps this distance from 0 and 180 degrees. Nearer to them, LAMMPS's forces on
# atoms are wrong, because it raises the sine of an angle to at least 0.001.
_ANGLES = 0.06


@dataclass(frozen=True)
class TableComparison:
    """Forces from LAMMPS, from this program's model of LAMMPS, and from the neighbouring rows."""

    lammps: LammpsTable
    modelled: Array  #: LAMMPS's force according to `lammps_curve`.
    expected: Array  #: Force from polynomials through the neighbouring rows.
    slopes: Array  #: -dE/dr of LAMMPS's energies, by central differences.
    error: float  #: Largest difference of LAMMPS and the rows, as a part of the local force.
    model_error: float  #: Largest difference of LAMMPS and the model, as a part of the local force.

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
        """Return the comparison as lines of a short table."""
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
    Run LAMMPS on a table, in the style and range of its report.

    If LAMMPS refuses the table, the curves are empty and `lammps.error` is its message. Raises
    InputError if the rows form no table, and RunError if LAMMPS is missing or gives no result.
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
