"""Check the energies and slopes of a table against its forces."""

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.table_text import SETTINGS, Section

# Relative rounding error of numbers that are written with all digits.
_EPSILON = 1e-14


def faults_of_lines(section: Section) -> list[str]:
    """Return mistakes: repeated words in the header, and lines that LAMMPS cannot use."""
    faults = []
    if section.repeated:
        faults.append(
            f"its header has {', '.join(section.repeated)}, and LAMMPS takes the last. Keep one"
        )
    if section.odd_lines:
        line = section.odd_lines[0]
        remedy = "Write rows as 'index length energy force'"
        if line.split()[0] in SETTINGS:
            remedy = "Write all header words in the line 'N rows'"
        faults.append(
            f"it has the line {line[:60]!r} among its rows, which LAMMPS refuses. {remedy}"
        )
    if section.skipped and section.skipped.split()[0] in SETTINGS:
        faults.append(
            f"LAMMPS skips the line {section.skipped[:60]!r} after the line 'N rows'. Write all "
            "header words in the line 'N rows', then an empty line"
        )
    return faults


@np.errstate(over="ignore", invalid="ignore")
def fault_of_energies(data: Array, digits: Array, path: str, allowed: float = 0.0) -> str:
    """
    Compare the mean forces between rows, from the energies, with the tabulated forces.

    Return the mistake, or an empty text if the energies agree with the forces or are all equal.

    The mean force between two rows must lie in the range of the forces of these rows and their
    neighbours. The mean may be outside this range by its width, because rows may be too far apart
    to resolve the stiffness. The mean may also be outside by `allowed`.
    """
    lengths, energies, forces = data.T
    if np.ptp(energies) == 0.0:
        return ""  # the table gives no energies
    steps = np.diff(lengths)
    means = -np.diff(energies) / steps
    around = np.lib.stride_tricks.sliding_window_view(np.pad(forces, 1, mode="edge"), 4)
    last = 0.5 * (digits[:-1] + digits[1:])
    steepest = np.max(np.abs(around), axis=1)
    rounding = _EPSILON * (np.abs(energies[:-1]) + np.abs(energies[1:]))
    room = np.ptp(around, axis=1) + last[:, 2] + _EPSILON * steepest
    room += (last[:, 1] + last[:, 0] * steepest + rounding) / steps
    low, high = np.min(around, axis=1) - room, np.max(around, axis=1) + room
    off = np.maximum(low - means, means - high)
    worst = int(np.argmax(off))
    if off[worst] <= allowed:
        return ""
    return (
        f"table {path!r} has energies that fall by {means[worst]:.6g} per length "
        f"between {lengths[worst]:.6g} and {lengths[worst + 1]:.6g}, but forces of "
        f"{around[worst].min():.6g} to {around[worst].max():.6g} there. Correct one of "
        "them so that force = -dE/dr, or set all energies to 0: only forces are used"
    )


def fault_of_slopes(section: Section, path: str) -> str:
    """
    Compare FP with the slopes of the first and the last four rows; return the mistake.

    If slopes between these rows differ by half, they do not determine the slope at the end and are
    not compared.
    """
    given = section.header.get("FP", section.header.get("FPRIME", [0.0, 0.0]))
    # As in the LAMMPS manual, tables give these values if the slopes are unknown.
    if given == [0.0, 0.0]:
        return ""
    for slope, end, name in (
        (given[0], slice(4), "first"),
        (given[1], slice(None, -5, -1), "last"),
    ):
        lengths, _, forces = section.data[end].T
        slopes = np.diff(forces) / np.diff(lengths)
        bends = np.abs(np.diff(slopes))
        expected = slopes[0] - 0.5 * (slopes[1] - slopes[0])
        step = float(np.min(np.abs(np.diff(lengths))))
        largest = np.max(section.least_digits[end], axis=0)
        steepest = float(np.max(np.abs(slopes)))
        if np.max(bends) > 0.5 * steepest:
            continue
        room = 3.0 * bends[0] + 2.0 * bends[1] + _EPSILON * steepest
        room += 8.0 * (largest[2] + largest[0] * steepest) / step
        if not abs(slope - expected) <= room:
            return (
                f"table {path!r} gives FP {given[0]:g} {given[1]:g}, but its forces change by "
                f"{expected:.6g} per length at the {name} row. Set FP to dF/dr, or leave FP out"
            )
    return ""
