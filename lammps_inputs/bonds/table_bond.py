"""Read a user's bond table as a potential, by a cubic spline of its forces."""

import hashlib
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.named_bond import LARGEST, SMALLEST
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.table_checks import (
    fault_of_energies,
    fault_of_slopes,
    faults_of_lines,
)
from chaincor.lammps_inputs.bonds.table_rows import LEAST_ROWS, BondRows
from chaincor.lammps_inputs.bonds.table_text import Section, sections_of
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.small_file import refuse_endless, why_unreadable

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


class SplineParameters(NamedTuple):
    """Cubic spline for compiled loops."""

    knots: Array  #: Strains of the knots, of shape (rows,).
    #: Coefficients of the cubics in the distance from the previous knot, from the cube to the
    #: constant; of shape (4, rows - 1).
    terms: Array
    #: Smallest strain with a force. The outer cubics continue beyond the knots to `low` and `high`.
    low: float
    high: float  #: Largest strain with a force.


def spline_force(strain: float, parameters: SplineParameters) -> float:
    """Return the spline at one strain; NaN beyond its ends."""
    if not parameters.low <= strain <= parameters.high:
        return np.nan
    knots, terms = parameters.knots, parameters.terms
    first, last = 0, terms.shape[1]
    while last - first > 1:
        middle = (first + last) // 2
        if strain < knots[middle]:
            last = middle
        else:
            first = middle
    s = strain - knots[first]
    force: float = ((terms[0, first] * s + terms[1, first]) * s + terms[2, first]) * s
    return force + terms[3, first]


class SplineBond(UserBond):
    """
    Bond whose force is a cubic spline of the strain; the energy is its integral.

    The force is 0 at strain 0. The spline may be continued beyond its rows by `reach`.
    """

    force_kernel = staticmethod(spline_force)
    _both_given = False

    def __init__(self, force: "CubicSpline", name: str, reach: float = 0.0) -> None:
        energy = force.antiderivative()
        energy.c *= -1.0
        super().__init__(energy, force, name, float(force.x[0]) - reach, float(force.x[-1]) + reach)
        self.force_spline = force
        knots, terms = (np.ascontiguousarray(a, dtype=float) for a in (force.x, force.c))
        self.parameters = SplineParameters(knots, terms, self.strain_min, self.strain_max)


class TableBond(SplineBond):
    """Bond from a table; it is sent to worker processes as the text of the table."""

    def __init__(self, text: str, path: str, force: "CubicSpline", rows: BondRows) -> None:
        self.text, self.path, self.rows = text, path, rows
        super().__init__(force, Path(path).stem)

    def as_keys(self) -> dict[str, Any]:
        """Return a hash of the table."""
        return {"bond_file": hashlib.sha256(self.text.encode()).hexdigest()}

    def __reduce__(self) -> tuple[Callable, tuple[str, str]]:
        return _bond_of, (self.text, self.path)


def read_bond_table(path: Path) -> Potential:
    """
    Read a LAMMPS bond table as a potential: a cubic spline of the forces, and its integral.

    Lengths must be scaled so that the natural length is 1. In a table with few digits or rows, the
    force vanishes only near length 1. If the last digits, or the error of the spline between rows,
    explain the difference, the zero of the force becomes the natural length. Energies, and N and FP
    in the header, are not used but must agree with the forces. Energies that are all equal, and FP
    0 0, are ignored.

    Raises TableError if the file cannot be read, contains no usable table or contradictions, or if
    its force does not vanish near length 1.
    """
    try:
        refuse_endless(Path(path))
        text = Path(path).read_bytes().decode("utf-8")
    except (OSError, ValueError) as error:
        raise TableError(
            f"cannot read the bond table {str(path)!r}: {why_unreadable(error)}"
        ) from None
    return _bond_of(text, str(path))


# The cache compares the contents of tables. Without the cache, each new scene with the same table
# would have a new bond, which needs new compiled loops.
@lru_cache(maxsize=16)
def _bond_of(text: str, path: str) -> Potential:
    section = _only_section(text, path)
    lengths, _, forces = section.data.T
    if len(lengths) < LEAST_ROWS:
        raise TableError(
            f"bond table {path!r} has {len(lengths)} usable rows. Give at least "
            f"{LEAST_ROWS} rows 'index length energy force'"
        )
    finite = np.all(np.isfinite(section.data), axis=1)
    rising = np.append(True, lengths[1:] > lengths[:-1])
    wrong = np.flatnonzero(~(finite & rising))
    if len(wrong):
        row = " ".join(f"{number:.9g}" for number in section.data[wrong[0]])
        raise TableError(
            f"bond table {path!r} has '{row}' in row {wrong[0] + 1}. Give a finite length, "
            "energy and force in each row, and let the lengths increase"
        )
    if not lengths[0] < 1.0 < lengths[-1]:
        raise TableError(
            f"bond table {path!r} spans lengths {lengths[0]:g} to {lengths[-1]:g}. Scale "
            "the lengths so that the natural length 1 is inside"
        )
    force, largest = _smooth(lengths - 1.0, forces), float(np.max(np.abs(forces)))
    if force is None:
        raise TableError(
            f"bond table {path!r} has forces up to {largest:.3g}, too large to interpolate "
            "smoothly. Give forces in units of stiffness times bond length"
        )
    if 0.0 < largest < SMALLEST or largest > LARGEST:
        raise TableError(
            f"bond table {path!r} has forces up to {largest:.3g}. Choose units in which "
            f"forces are between {SMALLEST:g} and {LARGEST:g}"
        )
    rows = BondRows.of(force, forces, section.least_digits)
    said = section.header.get("N", [len(lengths)])[0]
    fault = (
        f"table {path!r} says N {said:g} and has {len(lengths)} rows. Correct N, or the "
        "rows that are not 'index length energy force'"
        if said != len(lengths)
        else fault_of_energies(section.data, section.least_digits, path)
        or fault_of_slopes(section, path)
        or rows.outlier(path)
    )
    if fault:
        raise TableError(fault)
    zero = _natural_strain(force, rows, path)
    if zero != 0.0:
        force = _smooth(lengths - (1.0 + zero), forces)
        assert force is not None
    return TableBond(text, path, force, replace(rows, strains=force.x))


def _only_section(text: str, path: str) -> Section:
    """Return the only section of a bond's file; raise TableError for another number of sections."""
    sections = sections_of(text, path)
    if not any(len(each.data) for each in sections):
        return Section("", {}, *np.zeros((2, 0, 3)))
    if not sections[0].header:
        raise TableError(
            f"table {path!r} has no line 'N rows' before its rows, so LAMMPS cannot read "
            "it. Write a keyword, then the line 'N rows', then the rows"
        )
    if len(sections) > 1:
        raise TableError(
            f"table {path!r} has {len(sections)} sections. Put each section into a file of its own"
        )
    if faults := faults_of_lines(sections[0]):
        raise TableError(f"table {path!r} cannot be used: {faults[0]}")
    return sections[0]


def _natural_strain(force: "CubicSpline", rows: BondRows, path: str) -> float:
    """Return the strain of zero force, which must be 0 within the error of digits and rows."""
    pushes = float(force(0.0))
    stiffness = -float(force(0.0, 1))
    # Largest force that is allowed at length 1. The strains are then shifted to the zero of the
    # force; the error bar of a collision includes the effect of this shift.
    allowed = 2.0 * rows.largest_error(0.0, 0.0)
    if abs(pushes) <= 1e-9 * abs(stiffness):
        return 0.0
    zeros = force.roots(extrapolate=False)
    zeros = zeros[np.isfinite(zeros)]
    nearest = float(zeros[np.argmin(np.abs(zeros))]) if len(zeros) else None
    if abs(pushes) <= allowed and nearest is not None and stiffness > 0.0:
        return nearest
    where = "nowhere" if nearest is None else f"at length {1.0 + nearest:.9g}"
    raise TableError(
        f"bond table {path!r} has the force {pushes:.3g} at length 1, where it "
        f"must be 0 up to rounding ({allowed:.1g}). The force is 0 {where}. "
        "Divide all lengths by the natural length"
    )


def _smooth(strains: Array, forces: Array) -> "CubicSpline | None":
    """Return a spline without extrapolation; None if numbers overflow."""
    from scipy.interpolate import CubicSpline

    with np.errstate(all="ignore"):
        try:
            spline = CubicSpline(strains, forces, extrapolate=False)
        except ValueError:
            return None
        finite = np.all(np.isfinite(spline.antiderivative().c))
    return spline if finite else None
