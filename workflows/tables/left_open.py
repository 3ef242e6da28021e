"""What the rows, the digits and the style of a table leave open of its force, and why."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.table_rows import LEAST_ROWS, Rows

# Rows so many times further apart than those on either side have a gap between them, whose error
# is seen within so many rows.
_GAP, _AROUND = 1.9, 10
# Noise is no larger anywhere than so many times its median.
_EVEN = 10.0
# Interpolated between rows, curvature is looked at so many times finer.
_FINER = 8


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
