"""Find energies that are wrong where the forces of a table are smooth."""

from dataclasses import replace

import numpy as np

from chaincor.lammps_inputs.arrays import Mask
from chaincor.workflows.tables.interpolation_causes import TableFaultCause
from chaincor.workflows.tables.judge import Judge
from chaincor.workflows.tables.lammps_curve import TableData

# Energies are rough if, within _AROUND intervals of a contradiction, the largest second difference
# of their slopes exceeds that of the forces by the factor _ROUGHER.
_ROUGHER, _AROUND = 4.0, 4
# Reversed energies cover at least this many intervals, and at most this fraction of the table.
_LEAST_RUN, _MOST = 2, 0.97

ROUGH_ENERGIES = TableFaultCause(
    "energies",
    "the forces are smooth, but the energies jump",
    "correct the energies. If the forces are right, option --write computes energies from them",
)


def energies_are_rough(judge: Judge, wrong: Mask) -> bool:
    """Return whether slopes of energies are much rougher than forces near the intervals `wrong`."""
    by_energies, by_forces, _ = judge.rows.mean_forces()
    near = np.convolve(wrong, np.ones(2 * _AROUND + 1))[_AROUND : _AROUND + len(wrong)] > 0.0
    rough, smooth = (
        float(np.max(np.abs(np.diff(forces, 2)), where=near[1:-1], initial=0.0))
        for forces in (by_energies, by_forces)
    )
    return rough > _ROUGHER * smooth


def reversed_energies(judge: Judge) -> list[tuple[TableFaultCause, TableData, str]]:
    """
    Return corrections of a part of the rows in which the energies have the wrong sign.

    Each correction has a cause, the corrected table and the range in words. The energies jump at
    both ends of the part, and their slope there may have either sign. Therefore the part may begin
    and end one row further inside.
    """
    table, (x, *_) = judge.table, judge.rows.padded
    pad = (len(x) - len(judge.rows.table.lengths)) // 2
    by_energies, by_forces, _ = judge.rows.mean_forces()
    opposite = np.abs(by_energies + by_forces) < np.abs(by_energies - by_forces)
    opposite = opposite[pad : len(opposite) - pad]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], opposite, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2]
    most = _MOST * len(opposite)
    if not len(starts) or not _LEAST_RUN <= np.max(ends - starts) <= most:
        return []
    longest = int(np.argmax(ends - starts))
    cause = TableFaultCause(
        "sign", "the energies have the wrong sign", "multiply these energies by -1"
    )
    found = []
    for later, earlier in ((0, 0), (1, 0), (0, 1), (1, 1)):
        first, last = int(starts[longest]) + later, int(ends[longest]) - earlier
        energies = table.energies.copy()
        energies[first : last + 1] *= -1.0
        where = f"between {table.lengths[first]:.4g} and {table.lengths[last]:.4g}"
        found.append((cause, replace(table, energies=energies), where))
    return found
