"""What LAMMPS makes of a bond table, read back from LAMMPS and compared with the potential."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from lammps_inputs.bond_table import MARGIN_BINS, BondTable
from lammps_inputs.potentials import Potential
from workflows.engines.lammps_chain import LammpsChain

_FILE = "certificate.table"
_MOST_LENGTHS = 4001


@dataclass(frozen=True)
class TableCertificate:
    """
    Largest errors of a bond table as LAMMPS interpolates it.

    Attributes
    ----------
    style : str
        ``linear`` or ``spline``.
    rows : int
        Rows of the table.
    shortest, longest : float
        First and last bond length of the table.
    force_error, energy_error : float
        Largest |LAMMPS - analytic| over the lengths asked, away from the ends.
    edge_force_error, edge_energy_error : float
        The same within the margin at both ends, where no bond of an accepted run has been.
    lengths_asked : int
        How many lengths were compared.
    """

    style: str
    rows: int
    shortest: float
    longest: float
    force_error: float
    energy_error: float
    edge_force_error: float
    edge_energy_error: float
    lengths_asked: int

    def to_dict(self) -> dict[str, Any]:
        """
        Return the fields.

        Returns
        -------
        dict
            Names and values.
        """
        return asdict(self)


def certify_table(chain: LammpsChain, table: BondTable, bond: Potential) -> TableCertificate:
    """
    Ask LAMMPS for energies and forces between the rows and compare them with the potential.

    Parameters
    ----------
    chain : LammpsChain
        A chain that has read the table.
    table : BondTable
        The table.
    bond : Potential
        What it stands for.

    Returns
    -------
    TableCertificate
        The largest errors; those of an energy carry no constant.
    """
    # An even number of intervals that shares no factor with the rows falls between them.
    asked = min(2 * table.rows, _MOST_LENGTHS)
    first, last = float(table.lengths[0]), float(table.lengths[-1])
    inset = 0.25 * table.spacing
    file = chain.folder / _FILE
    chain.commands(
        f'bond_write 1 {asked} {first + inset!r} {last - inset!r} "{file.as_posix()}" CERTIFICATE'
    )
    rows = [line.split() for line in file.read_text().splitlines()]
    file.unlink()
    data = np.array([row for row in rows if len(row) == 4 and row[0].isdigit()], dtype=float)
    _, _, energies, forces = data.T
    # The file rounds lengths to 15 digits; LAMMPS itself used these.
    lengths = (first + inset) + (last - first - 2 * inset) / (asked - 1) * np.arange(asked)
    strains = lengths - 1.0
    energy_errors = np.abs(energies - bond.energy(strains))
    force_errors = np.abs(forces - bond.force(strains))
    margin = MARGIN_BINS * table.spacing
    inside = (lengths > first + margin) & (lengths < last - margin)
    return TableCertificate(
        style=table.style,
        rows=table.rows,
        shortest=float(first),
        longest=float(last),
        force_error=float(np.max(force_errors[inside], initial=0.0)),
        energy_error=float(np.max(energy_errors[inside], initial=0.0)),
        edge_force_error=float(np.max(force_errors[~inside], initial=0.0)),
        edge_energy_error=float(np.max(energy_errors[~inside], initial=0.0)),
        lengths_asked=asked,
    )
