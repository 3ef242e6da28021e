"""Find why forces differ from -dE/dr: correct each possible cause on trial, and compare again."""

from dataclasses import dataclass, replace

import numpy as np

from chaincor.lammps_inputs.arrays import Array, Mask
from chaincor.workflows.tables.energy_faults import (
    ROUGH_ENERGIES,
    energies_are_rough,
    reversed_energies,
)
from chaincor.workflows.tables.interpolation_causes import TableFaultCause, rounded_lengths
from chaincor.workflows.tables.judge import Judge
from chaincor.workflows.tables.lammps_curve import TableData

# Forces or energies are often wrong by one of these factors. Most of the factors convert units.
_FACTORS = {
    "kcal and kJ": 4.184,
    "nm and Angstrom": 10.0,
    "eV and kcal/mol": 23.060548,
    "eV and kJ/mol": 96.485332,
    "Hartree and eV": 27.211386,
    "Hartree and kcal/mol": 627.50947,
    "Hartree and kJ/mol": 2625.4996,
    "radians and degrees": 180.0 / np.pi,
    "Bohr and Angstrom": 1.8897261,
    "a factor of 2": 2.0,
    "a factor of 3": 3.0,
    "a factor of 100": 100.0,
    "a factor of 1000": 1000.0,
}
# A cause is accepted if its correction leaves less than this fraction of the difference.
_EXPLAINS = 0.1
# Forces count as a constant multiple of the slopes of the energy if the ratio varies by less than
# this fraction.
_CONSTANT = 0.03
# A cause applies to the whole table if its correction improves more than the fraction _WHOLE of the
# rows. Otherwise the cause may apply to the longest sequence of improved rows. There may be at most
# _MOST_RUNS such sequences, and the longest must have at least _LEAST_RUN rows.
_WHOLE, _MOST_RUNS, _LEAST_RUN = 0.97, 3, 3
# If all contradictions lie within this many rows of the first or last row, the energy of a dihedral
# may not be periodic.
_NEAR_WRAP = 12


@dataclass(frozen=True)
class _Test:
    """Possible cause and the corrected table; `where` is empty if all rows were corrected."""

    cause: TableFaultCause
    undone: TableData
    where: str = ""


def cause_of_contradiction(judge: Judge, wrong: Mask, where: str) -> TableFaultCause:
    """
    Return why the forces differ from -dE/dr.

    `wrong`, of shape (rows - 1,), marks the intervals between rows in which forces and energies
    contradict each other. `where` describes their range in words. Each possible cause is corrected
    on trial, in the whole table and in a part of it. The result is the cause whose correction makes
    energies and forces agree best.
    """
    jump = _jump_of_a_turn(judge, wrong)
    if jump is not None:
        return jump
    before = _difference(judge, wrong)
    best, least = None, _EXPLAINS * before
    tests = [*_sign_and_factor(judge, wrong), *_of_forces(judge), *_of_lengths(judge)]
    is_rough = energies_are_rough(judge, wrong)
    if is_rough:  # smooth forces are not wrong in a part of the rows
        in_part = ("sign", "shifted column")
        tests = [test for test in tests if not (test.where and test.cause.name in in_part)]
    tests += [_Test(*correction) for correction in reversed_energies(judge)]
    for test in tests:
        after = _difference(replace(judge, table=test.undone), wrong)
        if after < least:
            best, least = test, after
    if best is not None:
        cause, place = best.cause, best.where
    else:
        place = where
        other = TableFaultCause(
            "other forces",
            "the forces belong to other energies",
            "recompute the force column as -dE/dr",
        )
        other = ROUGH_ENERGIES if is_rough else other
        cause = _differences_of_energies(judge, wrong) or other
    return cause._replace(said=f"{cause.said} {place}".rstrip())


def _difference(judge: Judge, wrong: Mask) -> float:
    """
    Return a measure of the relative difference between forces and -dE/dr.

    The measure is the median over the wrong intervals plus a tenth of the mean over all intervals.
    """
    with np.errstate(all="ignore"):
        by_energies, by_forces, _ = judge.rows.mean_forces()
        if len(by_energies) != len(wrong):
            return np.inf
        size = np.maximum(np.abs(by_energies), np.abs(by_forces)) + 1e-300
        off = np.nan_to_num(np.abs(by_energies - by_forces) / size, nan=1.0)
    return float(np.median(off[wrong]) + 0.1 * np.mean(off))


def _jump_of_a_turn(judge: Judge, wrong: Mask) -> TableFaultCause | None:
    """Return a cause if the energy of a dihedral jumps between the last row and the first."""
    table = judge.table
    if not table.period:
        return None
    x = judge.rows.padded[0]
    at_wrap = (x[1:] > table.lengths[-_NEAR_WRAP]) | (x[:-1] < table.lengths[_NEAR_WRAP])
    gap = table.lengths[0] + table.period - table.lengths[-1]
    by_forces = -0.5 * (table.forces[0] + table.forces[-1]) * gap
    jump = float(table.energies[0] - table.energies[-1])
    if np.any(wrong & ~at_wrap) or abs(jump - by_forces) < 0.01 * np.ptp(table.energies):
        return None
    return TableFaultCause(
        "not periodic",
        f"the energy is not periodic: it jumps by {jump:.3g} from the last row to the first",
        "use an energy that returns after a whole turn",
    )


def _in_whole_or_part(
    judge: Judge, forces: Array, cause: TableFaultCause, in_part: str
) -> list[_Test]:
    """
    Return tests of a cause of wrong forces, for all rows and for the rows that it improves.

    `forces` are the corrected forces, and `in_part` is the remedy if only a part of the rows is
    wrong.
    """
    table = judge.table
    tests = [_Test(cause, replace(table, forces=forces))]
    better = _improved(judge, forces)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], better, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2]
    if not 0 < len(starts) <= _MOST_RUNS or np.mean(better) > _WHOLE:
        return tests
    longest = int(np.argmax(ends - starts))
    first, end = int(starts[longest]), int(ends[longest])
    if end - first < _LEAST_RUN:
        return tests
    part = np.zeros(len(table.forces), dtype=bool)
    part[first:end] = True
    mixed = replace(table, forces=np.where(part, forces, table.forces))
    where = f"between {table.lengths[first]:.4g} and {table.lengths[end - 1]:.4g}"
    return [*tests, _Test(cause._replace(help=in_part), mixed, where)]


def _improved(judge: Judge, forces: Array) -> Mask:
    """Mark the rows before the cutoff at which `forces` fit -dE/dr better than given forces."""
    rows = judge.rows
    x, _, given, _ = rows.padded
    other = replace(judge, table=replace(judge.table, forces=forces)).rows.padded[2]
    with np.errstate(all="ignore"):
        slopes = rows.by_energies(x, 6)
        better = np.abs(other - slopes) < np.abs(given - slopes)
        is_clear = np.abs(other - given) > 1e-3 * np.maximum(np.abs(other), np.abs(given))
    # If the two forces agree at a row, the row is marked like the row before it.
    last_clear = np.maximum.accumulate(np.where(is_clear, np.arange(len(x)), 0))
    pad = (len(x) - len(rows.table.lengths)) // 2
    result: Mask = better[last_clear][pad : len(x) - pad]
    return result


def _sign_and_factor(judge: Judge, wrong: Mask) -> list[_Test]:
    by_energies, by_forces, _ = judge.rows.mean_forces()
    good = wrong & (np.abs(by_forces) > 0.0) & np.isfinite(by_forces) & np.isfinite(by_energies)
    if not np.any(good):
        return []
    ratios = by_energies[good] / by_forces[good]
    factor = float(np.median(ratios))
    if factor == 0.0 or np.median(np.abs(ratios / factor - 1.0)) > _CONSTANT:
        return []
    forces = judge.table.forces * factor
    if abs(factor + 1.0) < _CONSTANT:
        cause = TableFaultCause(
            "sign", "the forces have the wrong sign", "multiply the force column by -1"
        )
        tests = _in_whole_or_part(judge, forces, cause, "multiply these forces by -1")
        if judge.table.kind not in ("bond", "pair"):
            said = "forces and energies have opposite signs"
            help_ = "multiply the column with the wrong sign by -1"
            tests[0] = replace(tests[0], cause=TableFaultCause("sign", said, help_))
        elif judge.table.forces[0] > 0.0:
            # The first force is repulsive, as it should be, so the energies are wrong.
            said = "the energies have the wrong sign"
            cause = TableFaultCause("sign", said, "multiply the energy column by -1")
            tests[0] = replace(tests[0], cause=cause)
        return tests
    said = f"the forces are {1.0 / factor:.5g} times -dE/dr"
    help_ = "write -dE/dr into the force column"
    for units, known in _FACTORS.items():
        if min(abs(abs(factor) / known - 1.0), abs(abs(factor) * known - 1.0)) < _CONSTANT:
            said += (
                f", {units}" if units.startswith("a factor") else f", the factor between {units},"
            )
            help_ = "write both columns, and r, in the same units"
    cause = TableFaultCause("unit", said.rstrip(","), help_)
    tests = _in_whole_or_part(judge, forces, cause, help_)
    return [tests[0], *(replace(each, cause=cause._replace(said=said)) for each in tests[1:])]


def _of_forces(judge: Judge) -> list[_Test]:
    """Return tests for forces that are multiplied or divided by r, and for shifted forces."""
    t = judge.table
    r, forces = t.lengths, t.forces
    tests = []
    if np.all(r >= 0.0) and t.kind in ("bond", "pair"):
        positive = np.maximum(r, 1e-300)
        for name, undone in (
            ("divided by r", forces * positive),
            ("multiplied by r", forces / positive),
        ):
            cause = TableFaultCause(
                "force and r", f"the forces are {name}", "write the plain force -dE/dr"
            )
            tests.append(_Test(cause, replace(t, forces=undone)))
    for rows in (1, -1, 2, -2, 3, -3):
        shifted = np.roll(forces, -rows)
        # np.roll moves some forces from one end of the table to the other end. The nearest correct
        # force replaces them.
        if rows > 0:
            shifted[-rows:] = shifted[-rows - 1]
        else:
            shifted[:-rows] = shifted[-rows]
        side = "down" if rows > 0 else "up"
        many = f"{abs(rows)} row{'s' * (abs(rows) > 1)}"
        cause = TableFaultCause(
            "shifted column",
            f"the force column is shifted {side} by {many}",
            "move the forces back to their energies",
        )
        tests += _in_whole_or_part(judge, shifted, cause, cause.help)
    return tests


def _of_lengths(judge: Judge) -> list[_Test]:
    """Return tests for exchanged columns, squared lengths and rounded lengths."""
    t = judge.table
    r = t.lengths
    said = "the energy column holds the forces, and the force column the energies"
    cause = TableFaultCause("exchanged columns", said, "exchange the third and the fourth column")
    tests = [_Test(cause, replace(t, energies=t.forces, forces=t.energies))]
    if np.all(r >= 0.0) and t.kind in ("bond", "pair"):
        said = "the r column holds r squared"
        cause = TableFaultCause("r squared", said, "take the root of the r column")
        tests.append(_Test(cause, replace(t, lengths=np.sqrt(r))))
    if rounded_lengths(r):
        cause = TableFaultCause("digits of r", "the r column is rounded", "write r with all digits")
        tests.append(_Test(cause, replace(t, lengths=np.linspace(r[0], r[-1], len(r)))))
    return tests


def _differences_of_energies(judge: Judge, wrong: Mask) -> TableFaultCause | None:
    """Return a cause if the forces are one-sided differences of the energies, otherwise None."""
    x, energies, forces, _digits = judge.rows.padded
    slopes = -np.diff(energies) / np.diff(x)
    by_energies, by_forces, _ = judge.rows.mean_forces()
    off = np.median(np.abs(by_energies - by_forces)[wrong])
    for name, mine in (("next", forces[:-1]), ("last", forces[1:])):
        if np.median(np.abs(slopes - mine)[wrong]) < _EXPLAINS * off:
            return TableFaultCause(
                "one-sided difference",
                f"the forces are differences of the energy to the {name} row",
                "take differences over both neighbours, or -dE/dr itself",
            )
    return None
