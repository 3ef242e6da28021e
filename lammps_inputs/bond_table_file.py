"""A user's bond table, as LAMMPS reads it, made a potential."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lammps_inputs.errors import TableError
from lammps_inputs.potential import Potential
from lammps_inputs.user_bond import UserBond

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


def read_bond_table(path: Path) -> Potential:
    """
    Read a LAMMPS bond table as a potential: a cubic spline of its forces, and their integral.

    Parameters
    ----------
    path : pathlib.Path
        A file with one section of rows "index length energy force". Lengths must be scaled so
        that the natural length is 1.

    Returns
    -------
    Potential
        Usable like a named potential, within the table's lengths.

    Raises
    ------
    TableError
        If the file cannot be read or holds no usable table.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or type(error).__name__
        raise TableError(f"cannot read the bond table {str(path)!r}: {reason}") from None
    rows = []
    for line in lines:
        words = line.split("#")[0].split()
        if len(words) == 4 and words[0].isdigit():
            try:
                rows.append([float(word) for word in words[1:]])
            except ValueError:
                raise TableError(
                    f"bond table {str(path)!r} has the row {line.strip()[:60]!r}; expected "
                    "'index length energy force'"
                ) from None
    data = np.array(rows, dtype=float).reshape(-1, 3)
    lengths, _, forces = data.T
    if len(lengths) < 4 or not np.all(np.isfinite(data)) or np.any(np.diff(lengths) <= 0):
        raise TableError(
            f"bond table {str(path)!r} has {len(lengths)} usable rows; expected at least 4 rows "
            "'index length energy force' of finite numbers with increasing length"
        )
    if not lengths[0] < 1.0 < lengths[-1]:
        raise TableError(
            f"bond table {str(path)!r} spans lengths {lengths[0]:g} to {lengths[-1]:g}; expected "
            "the natural length 1 inside: scale lengths so that it is"
        )
    force = _smooth(lengths - 1.0, forces)
    if force is None:
        raise TableError(
            f"bond table {str(path)!r} has forces up to {np.max(np.abs(forces)):.3g}, which no "
            "smooth curve follows; expected forces in units of stiffness times bond length"
        )
    work = force.antiderivative()
    return UserBond(
        energy=lambda strain: -work(strain),
        force=force,
        name=Path(path).stem,
        strain_min=float(lengths[0] - 1.0),
        strain_max=float(lengths[-1] - 1.0),
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
