"""A user's bond table, as LAMMPS reads it, made a potential."""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.table_checks import check_table, header_of
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.small_file import refuse_endless, why_unreadable

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


# Through every second of fewer rows there is hardly a spline.
_FEW = 7


def read_bond_table(path: Path) -> Potential:
    """
    Read a LAMMPS bond table as a potential: a cubic spline of its forces, and their integral.

    The force of a table with few digits, or rows, vanishes a little beside length 1. Where that is
    within its last digits, or what the spline may err between rows, the zero of the force is taken
    for the natural length.

    Parameters
    ----------
    path : pathlib.Path
        A file with one section of rows "index length energy force". Lengths must be scaled so
        that the natural length is 1. Energies, and N and FP of the header, are not used, but must
        be those of the forces; energies that are all the same, and FP 0 0, say nothing.

    Returns
    -------
    Potential
        Usable like a named potential, within the table's lengths.

    Raises
    ------
    TableError
        If the file cannot be read, holds no usable table, contradicts itself, or its force
        vanishes elsewhere than at length 1.
    """
    try:
        refuse_endless(Path(path))
        text = Path(path).read_bytes().decode("utf-8")
    except (OSError, ValueError) as error:
        raise TableError(
            f"cannot read the bond table {str(path)!r}: {why_unreadable(error)}"
        ) from None
    return _bond_of(text, str(path))


# By content: a scene is read and replaced many times, and each bond has compiled loops.
@lru_cache(maxsize=16)
def _bond_of(text: str, path: str) -> Potential:
    rows, digits = [], []
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if len(words) == 4 and words[0].isdigit():
            try:
                rows.append([float(word) for word in words[1:]])
                digits.append([_last_digit(word) for word in words[1:]])
            except ValueError:
                raise TableError(
                    f"bond table {path!r} has the row {line.strip()[:60]!r}; expected "
                    "'index length energy force'"
                ) from None
    data = np.array(rows, dtype=float).reshape(-1, 3)
    lengths, _, forces = data.T
    if len(lengths) < 4 or not np.all(np.isfinite(data)) or np.any(np.diff(lengths) <= 0):
        raise TableError(
            f"bond table {path!r} has {len(lengths)} usable rows; expected at least 4 rows "
            "'index length energy force' of finite numbers with increasing length"
        )
    if not lengths[0] < 1.0 < lengths[-1]:
        raise TableError(
            f"bond table {path!r} spans lengths {lengths[0]:g} to {lengths[-1]:g}; expected "
            "the natural length 1 inside: scale lengths so that it is"
        )
    force = _smooth(lengths - 1.0, forces)
    if force is None:
        raise TableError(
            f"bond table {path!r} has forces up to {np.max(np.abs(forces)):.3g}, which no "
            "smooth curve follows; expected forces in units of stiffness times bond length"
        )
    check_table(header_of(text, path), data, np.array(digits), path)
    zero = _natural_strain(force, np.array(digits), path)
    if zero != 0.0:
        force = _smooth(lengths - (1.0 + zero), forces)
        assert force is not None
    return TableBond(text, path, force)


class TableBond(UserBond):
    """
    The bond of a table; what is sent to worker processes is the table's text.

    Parameters
    ----------
    text : str
        What the file held when it was read.
    path : str
        Where it was.
    force : scipy.interpolate.CubicSpline
        Through its forces.
    """

    def __init__(self, text: str, path: str, force: "CubicSpline") -> None:
        self.text, self._path = text, path
        energy = force.antiderivative()
        energy.c *= -1.0
        super().__init__(
            energy=energy,
            force=force,
            name=Path(path).stem,
            strain_min=float(force.x[0]),
            strain_max=float(force.x[-1]),
        )

    def __reduce__(self) -> tuple[Callable, tuple[str, str]]:
        return _bond_of, (self.text, self._path)


def _last_digit(word: str) -> float:
    """Return one unit of the last digit a number was written with."""
    mantissa, _, exponent = word.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(f"1e{int(exponent or 0) - decimals}")


def _natural_strain(force: "CubicSpline", digits: NDArray[np.float64], path: str) -> float:
    """Return the strain nearest to 0 of no force, within what digits and rows leave open."""
    pushes = float(force(0.0))
    stiffness = -float(force(0.0, 1))
    row = max(int(np.searchsorted(force.x, 0.0)) - 1, 0)
    near = slice(max(row - 1, 0), row + 3)
    length_digit, _, force_digit = np.max(digits[near], axis=0).tolist()
    # Half a unit of each of the rows around, which a cubic adds up to 1.25 times of.
    allowed = 0.625 * (force_digit + abs(stiffness) * length_digit)
    # And what rows this far apart leave open: a spline through half of them errs some times more.
    coarser = _smooth(force.x[::2], force(force.x[::2])) if len(force.x) > _FEW else None
    if coarser is not None and coarser.x[-1] > 0.0:
        allowed += abs(pushes - float(coarser(0.0)))
    if abs(pushes) <= 1e-9 * abs(stiffness):
        return 0.0
    zeros = force.roots(extrapolate=False)
    zeros = zeros[np.isfinite(zeros)]
    nearest = float(zeros[np.argmin(np.abs(zeros))]) if len(zeros) else None
    if abs(pushes) <= allowed and nearest is not None and stiffness > 0.0:
        return nearest
    where = "nowhere" if nearest is None else f"at length {1.0 + nearest:.9g}"
    raise TableError(
        f"bond table {path!r} pushes with {pushes:.3g} at length 1, more than its digits and "
        f"rows leave open, {allowed:.1g}, and with nothing {where}; expected no force at length 1: "
        "divide lengths by the natural one"
    )


def _smooth(strains: NDArray[np.float64], forces: NDArray[np.float64]) -> "CubicSpline | None":
    """Return a spline without values beyond its data; None where its numbers overflow."""
    from scipy.interpolate import CubicSpline

    with np.errstate(all="ignore"):
        try:
            spline = CubicSpline(strains, forces, extrapolate=False)
        except ValueError:
            return None
        finite = np.all(np.isfinite(spline.antiderivative().c))
    return spline if finite else None
