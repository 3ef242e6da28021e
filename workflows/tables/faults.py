"""What in a table contradicts another part or LAMMPS refuses, and what it leaves open, and why."""

import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.named_bond import LARGEST
from chaincor.lammps_inputs.bonds.table_checks import (
    Section,
    fault_of_energies,
    fault_of_slopes,
)
from chaincor.lammps_inputs.bonds.table_rows import LEAST_ROWS, Rows

Kind = Literal["bond", "angle", "pair"]

# LAMMPS works lengths out of R and RSQ again, and warns of a relative difference beyond this.
_SAME_LENGTH = 1e-6
WHOLE_ANGLE = 180.0
# Cubics between rows that are closer overflow.
_NEAREST = 1e-30
# Rows so many times further apart than those on either side have a gap between them, whose error
# is seen within so many rows.
_GAP, _AROUND = 1.9, 10
# Noise is no larger anywhere than so many times its median.
_EVEN = 10.0
# Interpolated between rows, curvature is looked at so many times finer.
_FINER = 8


def faults_of_header(section: Section, kind: Kind) -> list[str]:
    """Compare the header with the rows."""
    header, data = section.header, section.data
    if "N" not in header:
        return ["it has no line 'N rows' before its rows, without which LAMMPS does not read it"]
    faults = []
    if not section.keyword or section.keyword.isdigit():
        faults.append("its section has no keyword; expected a name in the line before 'N rows'")
    if header["N"][0] != len(data):
        faults.append(
            f"it says N {header['N'][0]:g} and has {len(data)} rows; expected as many as it says: "
            "LAMMPS reads past the section, or stops before its end"
        )
    lengths = data[:, 0]
    if len(lengths) < 2 or not np.all(np.isfinite(lengths)):
        return faults
    if kind == "angle" and (lengths[0] != 0.0 or abs(lengths[-1] - WHOLE_ANGLE) > 1e-9):
        faults.append(
            f"its angles go from {lengths[0]:g} to {lengths[-1]:g}; LAMMPS expects an angle table "
            "from 0 to 180 degrees"
        )
    if kind == "pair" and lengths[0] <= 0.0:
        faults.append(f"its distances begin at {lengths[0]:g}; LAMMPS expects positive ones")
    faults += _of_spacing(header, lengths, section.digits[:, 0])
    if "EQ" in header and not lengths[0] <= header["EQ"][0] <= lengths[-1]:
        faults.append(
            f"it says EQ {header['EQ'][0]:g}, and its rows go from {lengths[0]:g} to "
            f"{lengths[-1]:g}; expected the natural value inside"
        )
    return faults


def fault_of_numbers(data: Array, kind: Kind) -> str | None:
    """Say why rows are no table at all; None where they are one."""
    wrong = np.flatnonzero(~np.all(np.abs(data) <= LARGEST, axis=1))
    if len(wrong):
        said = " ".join(f"{number:g}" for number in data[wrong[0]])
        return f"row {wrong[0] + 1} says '{said}'; expected finite numbers, of {LARGEST:g} at most"
    if len(data) < LEAST_ROWS:
        return f"it has {len(data)} rows; expected {LEAST_ROWS} at least"
    falling = np.flatnonzero(np.diff(data[:, 0]) <= 0.0)
    if len(falling):
        row = int(falling[0]) + 2
        return (
            f"{kind} table values are not increasing: row {row} is at {data[row - 1, 0]:.9g} "
            f"behind {data[row - 2, 0]:.9g}; LAMMPS refuses that or reads past its table"
        )
    nearest = int(np.argmin(np.diff(data[:, 0])))
    if np.diff(data[:, 0])[nearest] < _NEAREST:
        return f"rows {nearest + 1} and {nearest + 2} are closer than {_NEAREST:g}; expected more"
    if np.all(data[:, 2] == 0.0) and np.ptp(data[:, 1]) > 0.0:
        return "all forces are 0; expected -dE/dr in the fourth column"
    return None


def _of_spacing(header: dict[str, list[float]], lengths: Array, digits: Array) -> list[str]:
    """Compare distances with those that LAMMPS works out of R and RSQ, but for lost digits."""
    for name, power in (("R", 1), ("RSQ", 2)):
        if name in header:
            low, high = header[name]
            made = np.linspace(low**power, high**power, len(lengths)) ** (1.0 / power)
            off = np.abs(lengths - made) > _SAME_LENGTH * np.abs(made) + digits
            if np.any(off):
                row = int(np.flatnonzero(off)[0])
                return [
                    f"{np.count_nonzero(off)} of {len(lengths)} distance values differ from those "
                    f"of its line '{name} {low:g} {high:g}', which LAMMPS takes instead: row "
                    f"{row + 1} is at {lengths[row]:.9g}, not {made[row]:.9g}"
                ]
    return []


def faults_of_rows(
    section: Section, rows: Rows, path: str, kind: Kind, allowed: float
) -> list[str]:
    """Compare rows with each other, energies with forces, and slopes with both."""
    whole = slice(-1 if kind == "pair" and ends_by_zero(section.data) else None)
    found = [
        rows.outlier(path),
        fault_of_energies(section.data[whole], section.least_digits[whole], path, allowed),
        fault_of_slopes(section, path),
    ]
    if np.ptp(section.data[:, 1]) == 0.0:
        found.append("all its energies are the same; expected the energy in the third column")
    return [fault for fault in found if fault]


def ends_by_zero(data: Array) -> bool:
    """Return whether a last row of zeros stands for the cutoff, as LAMMPS's pair_write has it."""
    return bool(np.all(data[-1, 1:] == 0.0) and data[-2, 1] != 0.0)


def count_inconsistent(lengths: Array, energies: Array, forces: Array) -> int:
    """Count forces outside the slopes of the energy to both neighbours, as LAMMPS does."""
    slopes = -np.diff(energies) / np.diff(lengths)
    low, high = np.minimum(slopes[:-1], slopes[1:]), np.maximum(slopes[:-1], slopes[1:])
    inside = forces[1:-1]
    return int(np.count_nonzero((inside < low) | (inside > high)))


def left_open(
    rows: Rows, spline: Callable[..., Array], style: str, limit: float
) -> tuple[dict[str, Any], str]:
    """
    Return what a report says of the error, and where that comes from and what would help.

    `spline` is the force through the rows, in which curvature and slope are looked for.
    """
    lengths, count = rows.strains, len(rows.strains)
    largest = float(np.max(np.abs(rows.forces)))
    fine = np.interp(np.linspace(0.0, count - 1.0, _FINER * count), np.arange(count), lengths)
    span = float(lengths[-1] - lengths[0])
    curved = float(np.max(np.abs(spline(fine, 2)))) * span**2 / 8.0 / largest
    steep = float(np.max(np.abs(spline(fine, 1)))) * span / 2.0 / largest
    errors = {"linear": curved / (count - 1) ** 2, "lookup": steep / (count - 1), "spline": 0.0}
    missed, noises = rows.errors(), rows.noise()
    by_rows = float(np.max(missed)) / largest
    wanted = {
        "linear": math.ceil(math.sqrt(curved / limit)) + 1,
        "lookup": math.ceil(steep / limit) + 1,
    }
    if by_rows < limit:
        # What splines err by falls with the fourth power.
        wanted["spline"] = max(LEAST_ROWS, math.ceil(count * (by_rows / limit) ** 0.25))
    unit = "of the largest force"
    if errors[style] > limit >= by_rows:
        cause = (
            f"{style} interpolation in {count} rows errs by {errors[style]:.2g} {unit}: take style "
            f"spline, or {wanted[style]} rows"
        )
    else:
        cause = _of_rows(rows, largest, f"an error of {by_rows:.2g} {unit}", missed, noises)
    said = {
        "error": by_rows + errors[style],
        "noise": float(np.max(noises)) / largest,
        "style_error": errors[style],
        "rows_wanted": wanted,
    }
    return said, cause


def _of_rows(rows: Rows, largest: float, error: str, missed: Array, noises: Array) -> str:
    """Say whether a gap, noise, digits or few rows are the cause."""
    lengths = rows.strains
    # At a kink alone it is none.
    noise = 3.0 * float(min(np.max(noises), _EVEN * np.median(noises))) / largest
    digits = float(np.max(rows.digits)) / largest
    steps = np.diff(lengths)
    wider = steps / np.maximum(np.append(0.0, steps[:-1]), np.append(steps[1:], 0.0))
    gap, worst = int(np.argmax(wider)), int(np.argmax(missed))
    if wider[gap] > _GAP and abs(gap - worst) <= _AROUND:
        return (
            f"between rows {gap + 1} and {gap + 2}, at {lengths[gap]:.9g} and "
            f"{lengths[gap + 1]:.9g}, rows are missing, which leaves {error}: give rows there"
        )
    if max(noise, digits) > 0.5 * missed[worst] / largest:
        cause = "its forces are noisy" if noise > digits else "its numbers have few digits"
        near = f"near {lengths[worst]:.9g}"
        return f"{cause}, which leaves {error} {near}: write all digits, or smooth"
    return (
        f"its {len(lengths)} rows leave {error}: give more rows near {lengths[worst]:.9g}, or a "
        "force without kinks"
    )
