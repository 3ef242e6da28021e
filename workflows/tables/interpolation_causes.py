"""Find why LAMMPS's force is wrong although a table's energies and forces agree."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.tables.judge import Errors, Judge
from chaincor.workflows.tables.lammps_curve import Style

# Rounding and noise are searched in this many rows on both sides of the place with the largest
# error.
_ENDS = 8
# An error is attributed to noise if the scatter is larger than this fraction of the interpolation
# error. The fraction is small because noise also changes the polynomials.
_NOISY = 0.3


class TableFaultCause(NamedTuple):
    """Cause of an error and its remedy."""

    name: str  #: Short name of the cause.
    said: str  #: Description of the problem, as a clause.
    help: str  #: Description of the remedy, in the imperative.


def cause_of_error(judge: Judge, errors: Errors, style: Style, rows: int) -> TableFaultCause:
    """Return the cause of the largest error, provided that energies and forces agree."""
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
        text = f"{len(t.lengths)} rows of energies do not determine the force {near}"
        return TableFaultCause("rows", text, "Give more rows, or forces.")
    error = errors.largest
    slopes = _slopes_of_rows(judge)
    if slopes is not None and not t.is_bitmap:
        sloped = replace(judge, table=replace(t, slopes=slopes))
        better = sloped.errors(style, rows, judge.low, judge.high)
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
    rounded = rounded_lengths(x)
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


def rounded_lengths(x: Array) -> bool:
    """Return whether the lengths are a uniform grid that was rounded."""
    steps = np.diff(x)
    even = float(np.mean(steps))
    return bool(1e-6 * even < np.max(np.abs(steps - even)) < 1.01 * even and len(x) > _ENDS)


def _gap(judge: Judge, place: float) -> TableFaultCause | None:
    """
    Return a cause if rows are missing near a place, otherwise None.

    Rows are missing if the interval between two rows is about twice the neighbouring intervals.
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
    """
    Estimate dF/dr at both ends of the table, for FP.

    The result is None if the table has no forces or covers a full turn.
    """
    if judge.table.period or not judge.table.has_forces:
        return None
    x = judge.rows.padded[0]
    ends = np.array([x[0], x[-1]])
    step = 1e-3 * np.array([x[1] - x[0], x[-1] - x[-2]])
    inner = ends + step * [1.0, -1.0]
    values = [judge.rows.forces_at(at, np.ones(2, dtype=bool))[0] for at in (ends, inner)]
    slopes = (values[1] - values[0]) / (step * [1.0, -1.0])
    return float(slopes[0]), float(slopes[1])
