"""Find the cause of an error in a table: undo each candidate, and see if the error vanishes."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array, Mask
from chaincor.workflows.tables.judge import Errors, Judge
from chaincor.workflows.tables.lammps_curve import Style, TableData

# Common factors by which forces or energies can be wrong, most of them between units.
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
# A cause is accepted if undoing it leaves less than this part of the difference.
_EXPLAINS = 0.1
# Forces are a constant times the slopes if the ratio of both varies by less than this part.
_CONSTANT = 0.03
# Rows on both sides of the worst place that are searched for rounding and noise.
_ENDS = 8
# Noise is the cause from this part of an error on, because noise moves the polynomials as well.
_NOISY = 0.3


class TableFaultCause(NamedTuple):
    """Cause of an error and its remedy."""

    name: str  #: Short name of the cause.
    said: str  #: The problem, as a clause.
    help: str  #: The remedy, as an imperative.


@dataclass(frozen=True)
class _Test:
    """Possible cause and the table without it."""

    cause: TableFaultCause
    undone: TableData


def cause_of_contradiction(judge: Judge, wrong: Mask) -> TableFaultCause:
    """
    Return why forces are not -dE/dr.

    `wrong` has the shape (rows - 1,) and marks the intervals between rows where forces and
    energies contradict each other. Each cause is undone on trial. The result is the cause without
    which energies and forces agree best.
    """
    before = _difference(judge, wrong)
    kinds = [*_sign_and_factor(judge, wrong), *_others(judge)]
    best, least = None, _EXPLAINS * before
    for test in kinds:
        after = _difference(replace(judge, table=test.undone), wrong)
        if after < least:
            best, least = test.cause, after
    return (
        best
        or _differences_of_energies(judge, wrong)
        or TableFaultCause(
            "other forces",
            "the forces belong to other energies",
            "recompute the force column as -dE/dr",
        )
    )


def _difference(judge: Judge, wrong: Mask) -> float:
    """Return how far forces differ from -dE/dr: median where wrong, plus a tenth of the mean."""
    with np.errstate(all="ignore"):
        by_energies, by_forces, _ = judge.rows.mean_forces()
        if len(by_energies) != len(wrong):
            return np.inf
        size = np.maximum(np.abs(by_energies), np.abs(by_forces)) + 1e-300
        off = np.nan_to_num(np.abs(by_energies - by_forces) / size, nan=1.0)
    return float(np.median(off[wrong]) + 0.1 * np.mean(off))


def _sign_and_factor(judge: Judge, wrong: Mask) -> list[_Test]:
    by_energies, by_forces, _ = judge.rows.mean_forces()
    good = wrong & (np.abs(by_forces) > 0.0) & np.isfinite(by_forces) & np.isfinite(by_energies)
    if not np.any(good):
        return []
    ratios = by_energies[good] / by_forces[good]
    factor = float(np.median(ratios))
    if factor == 0.0 or np.median(np.abs(ratios / factor - 1.0)) > _CONSTANT:
        return []
    undone = replace(judge.table, forces=judge.table.forces * factor)
    if abs(factor + 1.0) < _CONSTANT:
        text = "the forces have the wrong sign"
        return [_Test(TableFaultCause("sign", text, "multiply the force column by -1"), undone)]
    size, name = abs(factor), ""
    for units, known in _FACTORS.items():
        if min(abs(size / known - 1.0), abs(size * known - 1.0)) < _CONSTANT:
            name = units if units.startswith("a factor") else f"the factor between {units}"
    said = f"energies and forces differ by {f'{name}, ' if name else 'the factor '}{factor:.5g}"
    if factor < 0.0:
        said += ", with the wrong sign"
    help_ = "write both columns, and r, in the same units"
    return [_Test(TableFaultCause("unit", said, help_), undone)]


def _others(judge: Judge) -> list[_Test]:
    t = judge.table
    r, energies, forces = t.lengths, t.energies, t.forces
    tests = [
        _Test(
            TableFaultCause(
                "exchanged columns",
                "the energy column holds the forces, and the force column the energies",
                "exchange the third and the fourth column",
            ),
            replace(t, energies=forces, forces=energies),
        )
    ]
    if np.all(r >= 0.0) and t.kind in ("bond", "pair"):
        tests.append(
            _Test(
                TableFaultCause(
                    "r squared", "the r column holds r squared", "take the root of the r column"
                ),
                replace(t, lengths=np.sqrt(r)),
            )
        )
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
        # np.roll moves rows from one end to the other. They repeat the nearest moved force.
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
        tests.append(_Test(cause, replace(t, forces=shifted)))
    if not np.all(np.diff(judge.rows.padded[0]) > 0.0):
        return []
    return tests


def _differences_of_energies(judge: Judge, wrong: Mask) -> TableFaultCause | None:
    """Return a cause if the forces are differences of energies to one neighbour, else None."""
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


def cause_of_error(judge: Judge, errors: Errors, style: Style, rows: int) -> TableFaultCause:
    """Return why LAMMPS's force is wrong at the worst place, apart from contradictions."""
    k = int(np.argmax(np.maximum(errors.interpolation + errors.unsure, errors.scatter)))
    place, size = float(errors.at[k]), float(errors.size[k])
    near = f"near {place:.4g}"
    if errors.scatter[k] > _NOISY * (errors.interpolation[k] + errors.unsure[k]):
        return _of_scatter(judge, place, float(errors.scatter[k]) * size, near)
    gap = _gap(judge, place)
    if gap:
        return gap
    t = judge.table
    if not t.has_forces:
        text = f"{len(t.lengths)} rows of energies leave the force open {near}"
        return TableFaultCause("rows", text, "Give more rows, or forces.")
    error = errors.largest
    for slopes in (_slopes_of_rows(judge),):
        if slopes is not None and not t.is_bitmap:
            better = replace(judge, table=replace(t, slopes=slopes)).errors(
                style, rows, judge.low, judge.high
            )
            if better.largest < 0.3 * error and judge.size_at(errors.at)[k] > 0.0:
                word = "FPRIME" if t.kind == "pair" else "FP"
                blame = f"{word} is wrong" if t.slopes else "LAMMPS guesses the end slopes"
                said = f"{blame}, which shows {near}"
                return TableFaultCause(
                    "end slopes", said, f"write {word} {slopes[0]:.6g} {slopes[1]:.6g} after N"
                )
    many = 10 * max(rows, len(t.lengths))
    finer = judge.errors(style, many, judge.low, judge.high) if not t.is_bitmap else errors
    if finer.largest < 0.5 * error:
        said = f"style {style} in {rows} rows is coarse {near}"
        return TableFaultCause("interpolation", said, f"use more rows in {t.kind}_style table")
    if style == "spline" and not t.is_bitmap:
        lines = judge.errors("linear", 10 * many, judge.low, judge.high)
        if lines.largest < 0.1 * error:
            return TableFaultCause(
                "core",
                f"LAMMPS's spline in {rows} rows carries the steep core outwards, {near}",
                f"use {t.kind}_style table linear {10 * many}, or begin the table nearer to its "
                "range",
            )
    side = "below" if place < 0.5 * (judge.low + judge.high) else "above"
    if t.is_bitmap:
        return TableFaultCause(
            "bits", f"{len(t.lengths)} rows leave an error {near}", "write more bits"
        )
    text = f"{len(t.lengths)} rows leave an error {near}"
    return TableFaultCause("rows", text, f"more rows {side} {_round(place, side):.3g}")


def _round(place: float, side: str) -> float:
    step = 10.0 ** np.floor(np.log10(abs(place) + 1e-300) - 1.0)
    return float((np.ceil if side == "below" else np.floor)(place / step + 1e-9) * step)


def _of_scatter(judge: Judge, place: float, scatter: float, near: str) -> TableFaultCause:
    x, _, _, digits = judge.rows.padded
    row = int(np.argmin(np.abs(x - place)))
    around = slice(max(row - _ENDS, 0), row + _ENDS)
    if float(np.max(digits[around, 1])) > 0.3 * scatter:
        said = f"the numbers have few digits {near}"
        return TableFaultCause("digits", said, "write forces with more digits")
    rounded = _rounded_lengths(x)
    if rounded:
        return TableFaultCause(
            "digits of r", f"the r column is rounded {near}", "write r with all digits"
        )
    six, share = judge.rows.left_out(6)
    four, share_of_four = judge.rows.left_out(4)
    forces = judge.rows.padded[2]
    fine = np.median((np.abs(forces - six) / share)[around])
    coarse = np.median((np.abs(forces - four) / share_of_four)[around])
    if coarse > 3.0 * fine:
        return TableFaultCause("rows", f"{len(x)} rows leave an error {near}", f"more rows {near}")
    return TableFaultCause(
        "noise", f"the forces are noisy {near}", "smooth the forces, or fit a function"
    )


def _rounded_lengths(x: Array) -> bool:
    """Return whether lengths are a uniform grid that was rounded."""
    steps = np.diff(x)
    even = float(np.mean(steps))
    return bool(1e-6 * even < np.max(np.abs(steps - even)) < 1.01 * even and len(x) > _ENDS)


def _gap(judge: Judge, place: float) -> TableFaultCause | None:
    """
    Return a cause if rows are missing near a place, else None.

    Rows are missing if a step is about twice the steps on both sides.
    """
    x = judge.rows.padded[0]
    steps = np.diff(x)
    wider = steps / np.maximum(np.append(0.0, steps[:-1]), np.append(steps[1:], 0.0))
    gap = int(np.argmax(wider))
    if wider[gap] <= 1.9 or abs(gap - int(np.searchsorted(x, place))) > 10:
        return None
    return TableFaultCause(
        "gap",
        f"between rows {gap + 1} and {gap + 2}, at {x[gap]:.9g} and {x[gap + 1]:.9g}, rows are "
        "missing",
        "give rows there",
    )


def _slopes_of_rows(judge: Judge) -> tuple[float, float] | None:
    """Estimate dF/dr at both ends from the rows, for FP; None for full turns and without forces."""
    if judge.table.period or not judge.table.has_forces:
        return None
    x = judge.rows.padded[0]
    ends = np.array([x[0], x[-1]])
    step = 1e-3 * np.array([x[1] - x[0], x[-1] - x[-2]])
    inner = ends + step * [1.0, -1.0]
    values = [judge.rows.forces_at(at, np.ones(2, dtype=bool))[0] for at in (ends, inner)]
    slopes = (values[1] - values[0]) / (step * [1.0, -1.0])
    return float(slopes[0]), float(slopes[1])
