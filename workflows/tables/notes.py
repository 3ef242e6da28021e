"""Write notes on the ends of a table."""

import numpy as np

from chaincor.workflows.tables.judge import THERMAL_ENERGIES, last_row
from chaincor.workflows.tables.lammps_curve import TableData


def notes_on_ends(table: TableData, bounds: tuple[float, float], thermal: float) -> list[str]:
    """Return a note if particles at 10 kT reach the end of a bond or pair table."""
    if table.kind not in ("bond", "pair"):
        return []
    limit = float(np.min(table.energies)) + THERMAL_ENERGIES * thermal
    rows = (0, -1) if table.kind == "bond" else (0,)
    reached = [
        f"{table.lengths[row]:.6g}"
        for row in rows
        if table.lengths[row] in bounds and table.energies[row] < limit
    ]
    if not reached:
        return []
    return [
        f"at {' and '.join(reached)}, the energy is less than 10 kT above its minimum, and LAMMPS "
        f"stops if a {table.kind} leaves the table. Add rows"
    ]


def notes_beyond_cutoff(table: TableData) -> list[str]:
    """Return a note if the energy jumps at the cutoff."""
    notes = []
    end = last_row(table)
    if end < len(table.energies) - 1:
        notes.append(
            f"the energy jumps by {-table.energies[end]:.3g} to the zeros that "
            f"begin at {table.lengths[end + 1]:.6g}, and LAMMPS's force is wrong "
            "near this jump"
        )
    return notes
